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
        What it is wrong with: an IRI in angle brackets, or the file.
    line : int or None
        At which the subject is described first, where that is known.
    hint : str
        What to do about it; empty where it is obvious.
    rule : str
        The rule that is broken, for programs: a shape's constraint and property, or a check.
    """

    message: str
    subject: str = ""
    line: int | None = None
    hint: str = ""
    rule: str = ""

    @property
    def place(self) -> str:
        """The line and the subject."""
        return ", ".join(filter(None, (f"line {self.line}" if self.line else "", self.subject)))

    @property
    def words(self) -> str:
        """The message and what to do."""
        return f"{self.message} {self.hint}".strip()

    def __str__(self) -> str:
        return f"{self.place}: {self.words}" if self.place else self.words
