"""The journal: every edit is on the disk before the page hears of it.

A text file beside the plan, a JSON value per line: first which file it belongs to, then what was
done. When the program is killed, the next session makes the same edits again; when the
plan is saved, the journal goes.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from geofield.errors import GeofieldError
from geofield.review.session import Session

SUFFIX = ".review.jsonl"


def journal_path(plan_path: Path) -> Path:
    """Where the edits of a plan are kept until they are saved."""
    return plan_path.with_name(plan_path.name + SUFFIX)


def fingerprint(plan_path: Path) -> str:
    """What tells one version of a plan's file from another."""
    return hashlib.sha256(plan_path.read_bytes()).hexdigest()


class Journal:
    """The edits of one session, on the disk.

    Parameters
    ----------
    plan_path : Path
        The plan's GeoPackage.
    """

    def __init__(self, plan_path: Path) -> None:
        self.plan_path = plan_path
        self.path = journal_path(plan_path)
        self._started = False

    def replay(self, session: Session) -> str | None:
        """Make the edits of a session that ended without saving again.

        Returns
        -------
        str or None
            What was brought back, or why it was not, in words.
        """
        if not self.path.exists():
            return None
        lines = self.path.read_text(encoding="utf-8").splitlines()
        entries = [entry for line in lines if (entry := _parsed(line)) is not None]
        if not entries or entries[0].get("sha256") != fingerprint(self.plan_path):
            kept = self._set_aside()
            return (
                "Edits of an earlier session belong to another version of this file and were "
                f"not made again; they are kept in {kept.name}."
            )
        done = 0
        for entry in entries[1:]:
            try:
                play(session, entry)
            except GeofieldError as error:
                kept = self._set_aside()
                return f"{done} edits were brought back; then: {error} All are in {kept.name}."
            done += 1
        self._started = True
        return f"{done} edits of a session that ended without saving were brought back."

    def write(self, entry: Mapping[str, Any]) -> None:
        """Append what was done, and wait until the disk has it."""
        new = not self._started
        with self.path.open("w" if new else "a", encoding="utf-8") as file:
            if new:
                json.dump({"sha256": fingerprint(self.plan_path)}, file)
                file.write("\n")
            json.dump(dict(entry), file)
            file.write("\n")
            file.flush()
            os.fsync(file.fileno())
        self._started = True

    def clear(self) -> None:
        """The edits lie in the plan now."""
        self.path.unlink(missing_ok=True)
        self._started = False

    def _set_aside(self) -> Path:
        number = 1
        while (kept := self.path.with_name(f"{self.path.name}.{number}")).exists():
            number += 1
        self.path.rename(kept)
        return kept


def play(session: Session, entry: Mapping[str, Any]) -> None:
    """Do what a line of the journal says."""
    if entry.get("do") == "undo":
        session.undo()
    elif entry.get("do") == "redo":
        session.redo()
    else:
        session.do(entry)


def _parsed(line: str) -> dict[str, Any] | None:
    """A line's value; None for a last line that was cut off by the kill."""
    try:
        value = json.loads(line)
    except json.JSONDecodeError:
        return None
    return value if isinstance(value, dict) else None
