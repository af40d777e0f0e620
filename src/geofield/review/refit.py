"""Edits that were noted on a plan, made again on another version of it, as far as they fit.

With each edit is noted what it changes, as that was. Where the other version has it so, too, the
edit means the same there, whatever number an obstacle has by now.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import takewhile
from typing import Any

from geofield.errors import GeofieldError
from geofield.model.evidence import is_outline, outline_record
from geofield.plan import Plan
from geofield.review.commands import EditError
from geofield.review.session import Session

Entry = Mapping[str, Any]
#: Edits of the outline, which mean something else on another one.
_OF_OUTLINE = ("outline", "choose", "ground")


def noted(plan: Plan, command: Entry) -> dict[str, Any]:
    """An edit with what it changes, as it `was` on the plan before it."""
    was: Any = None
    if command.get("do") in _OF_OUTLINE:
        was = _outline_of(plan)
    elif "no" in command and plan.obstacles is not None:
        was = _obstacles_of(plan).get(command["no"])
    return dict(command) if was is None else {**command, "was": was}


def standing(entries: Sequence[Entry]) -> tuple[list[Entry], list[Entry]]:
    """The edits that lead from what was saved to where a journal ends, and those taken back."""
    steps: list[Entry] = []
    saved: list[Entry] = []
    at = 0
    for entry in entries:
        if "saved" in entry:
            saved = steps[:at]
        elif entry.get("do") == "undo":
            at = max(at - 1, 0)
        elif entry.get("do") == "redo":
            at = min(at + 1, len(steps))
        else:
            steps, at = [*steps[:at], entry], at + 1
    pairs = zip(saved, steps[:at], strict=False)
    both = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))
    return steps[both:at], saved[both:]


def refitted(plan: Plan, entry: Entry) -> dict[str, Any]:
    """An edit for another version of the plan that it was made on.

    Raises
    ------
    EditError
        When that has not what the edit changes, or has it otherwise.
    """
    command = {name: value for name, value in entry.items() if name != "was"}
    if command.get("do") in _OF_OUTLINE and not _has_outline(plan, entry.get("was")):
        raise EditError("the outline is another one.")
    if command.get("do") not in _OF_OUTLINE and "no" in command:
        fits = [entry.get("was")]
        if command["do"] == "status" and fits[0]:  # said there meanwhile, too
            fits.append([*fits[0][:-1], command["status"]])
        there = [no for no, was in _obstacles_of(plan).items() if was in fits]
        if not there:
            raise EditError(f"obstacle {command['no']} is not there as it was.")
        command["no"] = there[0]
    return command


def refit(session: Session, entries: Sequence[Entry]) -> tuple[list[Entry], list[str]]:
    """Make the edits of a journal on another version of its plan.

    What comes back are those made, as to be noted there, and in words why others were not.
    """
    made: list[Entry] = []
    edits, back = standing(entries)
    lost = [f"{each.get('do')} was saved and then taken back" for each in back]
    for entry in edits:
        try:
            command = refitted(session.plan, entry)
            again = noted(session.plan, command)
            session.do(command)
        except GeofieldError as error:
            lost.append(f"{entry.get('do')}: {error}".rstrip("."))
        else:
            made.append(again)
    return made, lost


def _outline_of(plan: Plan) -> list[Any]:
    return [outline_record(plan.field.polygon), len(plan.field.alternatives)]


def _has_outline(plan: Plan, was: Any) -> bool:
    recorded, choices = was or ("", -1)
    return choices == len(plan.field.alternatives) and is_outline(recorded, plan.field.polygon)


def _obstacles_of(plan: Plan) -> dict[int, list[Any]]:
    """Where each obstacle stands, how large it is, and what is said of it, by its number."""
    rows = plan.obstacles
    if rows is None:
        return {}
    centres = rows.geometry.centroid
    facts = zip(
        centres.x.round(2), centres.y.round(2), rows.area.round(1), rows["status"], strict=True
    )
    numbers = rows["obstacle_no"].fillna(0).astype(int)
    return {
        int(no): [float(x), float(y), float(area), str(status)]
        for no, (x, y, area, status) in zip(numbers, facts, strict=True)
    }
