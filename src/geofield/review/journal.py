"""The journal: every edit is on the disk before the page hears of it.

A text file beside the plan, a JSON value per line: first which plan it belongs to, then what was
done, and when that was saved. When the program is killed, the next session does the same again. A
session that saved can still undo what came before: the plan as it was opened is kept until the end.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import shapely

from geofield.errors import GeofieldError
from geofield.plan import Plan, read_plan
from geofield.review.plans import SUFFIX, journal_path
from geofield.review.presence import hold, is_open_elsewhere, release
from geofield.review.refit import refit
from geofield.review.session import Session
from geofield.staging import log_of
from geofield.wording import counted


def fingerprint(plan_path: Path) -> str:
    """What tells one version of a plan's file from another, its write-ahead log included."""
    version = hashlib.sha256(plan_path.read_bytes())
    with suppress(FileNotFoundError):
        version.update(log_of(plan_path).read_bytes())
    return version.hexdigest()


def content_of(plan: Plan) -> str:
    """What tells a plan from every other one, however its file is written."""
    dataset = plan.to_dataset()
    provenance = dataset.provenance
    facts = [dataset.crs.srs, provenance.settings, provenance.evidence]
    digest = hashlib.sha256(json.dumps(facts, sort_keys=True, default=str).encode())
    for name, table in sorted(dataset.tables.items()):
        digest.update(name.encode())
        digest.update(b"".join(shapely.to_wkb(table.geometry.to_numpy())))
        digest.update(table.drop(columns=table.geometry.name).to_csv(index=False).encode())
    return digest.hexdigest()


class Journal:
    """The edits of one session on a plan's GeoPackage, on the disk.

    `plan` is what that holds; `is_own` where the same session reads it again.
    """

    def __init__(self, plan_path: Path, plan: Plan, *, is_own: bool = False) -> None:
        self.plan_path = plan_path
        self.path = journal_path(plan_path)
        #: The plan as it was when the journal began; there only where that was saved over.
        self.opened = plan_path.with_name(f".{plan_path.stem}.review-opened.gpkg")
        self.refused: str | None = None
        #: The whole lines of the file as this session left it, and what it does not count.
        self._kept, self._rest = b"", b""
        self._waiting: list[Mapping[str, Any]] = []
        self._plan = content_of(plan)
        self._is_own = is_own
        self._lost: str | None = None
        #: What was noted on another version of the plan, and what stands behind a damaged line.
        self._elsewhere: list[dict[str, Any]] = []
        self._damaged: Path | None = None
        self._adopt()
        #: Whether the notes that were found are those of a session that still runs.
        self._is_shared = is_open_elsewhere(self.path)
        self._entries = self._read()
        if self._kept:
            hold(self.path)

    @property
    def begins_at(self) -> Path:
        """The file that the journal's first edit was made on."""
        saved = any("saved" in entry for entry, _ in self._entries)
        return self.opened if saved else self.plan_path

    def replay(self, session: Session) -> str | None:
        """Make the edits of a session that ended without saving, or still runs, again.

        The session is on the plan in :attr:`begins_at`. What was brought back, or why it was not,
        is told in words.
        """
        told, self._lost = self._lost, None
        if self._elsewhere:
            return self._refit(session)
        whole = self._kept + self._rest
        unsaved = done = 0
        begin = self._entries[0][1] if self._entries else 0
        last = max((end for entry, end in self._entries if "saved" in entry), default=0)
        for entry, end in self._entries[1:]:
            if "saved" in entry:
                if end == last:  # this one lies in the file
                    session.mark_saved(session.whole())
                unsaved, begin = 0, end
                continue
            try:
                play(session, entry)
            except GeofieldError as error:
                # What follows is no part of this session: its next edit is written over it.
                self._kept, self._rest = whole[:begin], whole[begin:]
                kept = self._copy()
                return f"{_back(done)} brought back; then: {error} All are in {kept.name}."
            begin = end
            done, unsaved = done + 1, unsaved + 1
        if self._damaged is not None:
            return (
                f"{_back(done)} brought back; the line of the notes after them is damaged. All "
                f"are in {self._damaged.name}, where what follows can be read."
            )
        if unsaved and self._is_shared:
            edits = counted(unsaved, "edit")
            return (
                f"Another review of this plan is open: what it did not save ({edits}) is here, "
                "too. Go on in one of them and close the other: only one can note and save edits."
            )
        if unsaved and not self._is_own:
            were = "was" if unsaved == 1 else "were"
            edits = counted(unsaved, "edit")
            return f"{edits} of a session that ended without saving {were} brought back."
        return told

    def write(self, entry: Mapping[str, Any]) -> None:
        """Append what was done, and wait until the disk has it.

        What the disk does not take waits for the next time, and :attr:`refused` says why.
        """
        if not self._kept and not self._waiting:
            self._waiting = [{"plan": self._plan}]
        self._waiting.append(dict(entry))
        self.flush()

    def flush(self) -> None:
        """Write what waits, if anything does, and all of it where the file is gone."""
        there = self.path.is_file()
        if not self._waiting and (there or not self._kept):
            return
        if not self._is_mine():
            self.refused = "another review of this plan is open, whose notes lie there"
            return
        whole = self._kept + "".join(json.dumps(each) + "\n" for each in self._waiting).encode()
        kept = len(self._kept) if there else 0
        try:
            with self.path.open("r+b" if kept else "wb") as file:
                # A line that was written by half, now or before a kill, is written anew.
                file.truncate(kept)
                file.seek(kept)
                file.write(whole[kept:])
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            self.refused = error.strerror or str(error)
            return
        self._kept, self._rest = whole, b""
        self._waiting, self.refused = [], None
        hold(self.path)

    def before_saving(self) -> None:
        """Keep the plan as it was opened, so that what was done on it can be undone."""
        if self._kept and not self.opened.exists():
            try:
                shutil.copyfile(self.plan_path, self.opened)
            except OSError:
                self.opened.unlink(missing_ok=True)  # half of it, on a full disk
                raise

    def saved(self) -> None:
        """The edits so far lie in the plan now."""
        self._plan = content_of(read_plan(self.plan_path))
        if self._kept or self._waiting:
            self.write({"saved": self._plan})

    @property
    def is_empty(self) -> bool:
        """Whether nothing was done since the session began, or all was forgotten."""
        return not (self._kept or self._waiting)

    def clear(self) -> None:
        """Nothing is left that another session would need."""
        if self._is_mine():
            self._remove()
        self._kept, self._waiting, self._entries, self.refused = b"", [], [], None

    def _remove(self) -> None:
        release(self.path)
        for path in (self.path, self.opened):
            if path.is_file():  # a folder that takes no notes may refuse to forget any, too
                path.unlink()
        self._kept, self._rest = b"", b""

    def _is_mine(self) -> bool:
        """Whether the file is as this session left it, but for half a line that was cut off."""
        if not self.path.is_file():
            return True
        there = self.path.read_bytes()
        rest = there[len(self._kept) :]
        return there.startswith(self._kept) and (rest == self._rest or b"\n" not in rest)

    def _adopt(self) -> None:
        """Take the notes that were made on this plan when its file had another name."""
        if self.path.exists():
            return
        for notes in self.path.parent.glob(f"*{SUFFIX}"):
            if not notes.is_file() or notes.with_name(notes.name.removesuffix(SUFFIX)).exists():
                continue
            entries = [_parsed(line) or {} for line in notes.read_bytes().splitlines(keepends=True)]
            marks = filter(None, (each.get("saved", each.get("plan")) for each in entries))
            if [None, *marks][-1] == self._plan:
                notes.rename(self.path)
                return

    def _read(self) -> list[tuple[dict[str, Any], int]]:
        """The entries of an earlier session; none where they are not of this file, or all saved."""
        if not self.path.exists():
            self._remove()
            return []
        entries: list[tuple[dict[str, Any], int]] = []
        there, size = self.path.read_bytes(), 0
        for line in there.splitlines(keepends=True):
            entry = _parsed(line)
            if entry is None:
                break
            size += len(line)
            entries.append((entry, size))
        self._kept, self._rest = there[:size], there[size:]
        if b"\n" in self._rest:  # only a last line may be cut off by a kill
            self._damaged = self._copy()
            self.path.write_bytes(self._kept)
            self._rest = b""
        if len(entries) < 2 or "saved" in entries[-1][0]:
            self._remove()
            if self._damaged is not None:
                self._lost = (
                    "The notes of an earlier session are damaged, and its edits were not made "
                    f"again; they are kept in {self._damaged.name}, where they can be read."
                )
            return []
        first = entries[0][0].get("plan")
        marks = [entry["saved"] for entry, _ in entries if "saved" in entry]
        whole = not marks
        with suppress(GeofieldError):  # gone, or only half was written when the session was killed
            whole = whole or content_of(read_plan(self.opened)) == first
        if whole and [first, *marks][-1] == self._plan:
            return entries
        self._elsewhere = [entry for entry, _ in entries[1:]]
        return []

    def _refit(self, session: Session) -> str:
        """Make edits again that were noted on another version of the plan, where they fit."""
        kept = self._damaged or self._copy()
        self._remove()
        made, lost = refit(session, self._elsewhere)
        for entry in made:
            self.write(entry)
        since, whose = "an earlier session ended without saving", "its"
        if self._is_shared:
            since = "another review of it, which is still open, noted its edits"
        elif self._is_own:
            since, whose = "it was opened here", "your"
        edits, were = counted(len(made) + len(lost), "edit"), "was" if len(made) == 1 else "were"
        words = (
            f"The plan was changed since {since}: {len(made)} of {whose} {edits} {were} made again."
        )
        if not lost and self._damaged is None and self.refused is None:
            kept.unlink()
            return words
        by_hand = f" Make these by hand: {'; '.join(lost)}." if lost else ""
        return f"{words}{by_hand} All are kept in {kept.name}."

    def _copy(self) -> Path:
        number = 1
        while (kept := self.path.with_name(f"{self.path.name}.{number}")).exists():
            number += 1
        shutil.copyfile(self.path, kept)
        return kept


def _back(done: int) -> str:
    return f"{counted(done, 'edit')} {'was' if done == 1 else 'were'}"


def play(session: Session, entry: Mapping[str, Any]) -> None:
    """Do what a line of the journal says."""
    if entry.get("do") == "undo":
        session.undo()
    elif entry.get("do") == "redo":
        session.redo()
    else:
        session.do(entry)


def _parsed(line: bytes) -> dict[str, Any] | None:
    """A line's value; None for a last line that was cut off by the kill."""
    try:
        value = json.loads(line) if line.endswith(b"\n") else None
    except ValueError:
        return None
    return value if isinstance(value, dict) else None
