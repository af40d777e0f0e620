"""Problem: one thing that is wrong with a file, in words for the person who must mend it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Problem:
    """What a validator found.

    Attributes
    ----------
    message : str
        What is wrong, in plain words.
    subject : str
        What it is wrong with: an IRI, a layer and row, a file in an archive.
    line : int or None
        Of the file, where it has lines and the place is known.
    hint : str
        What to do about it; empty where it is obvious.
    rule : str
        The rule that is broken: a shape, a clause of a specification; for programs.
    """

    message: str
    subject: str = ""
    line: int | None = None
    hint: str = ""
    rule: str = ""

    def __str__(self) -> str:
        where = f"line {self.line}: " if self.line else ""
        about = f"{self.subject}: " if self.subject else ""
        hint = f" {self.hint}" if self.hint else ""
        return f"{where}{about}{self.message}{hint}"
