"""A session: a plan that is being edited, with undo, redo, and tracks that follow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from geofield.earlier import is_planned
from geofield.errors import TrackError
from geofield.notes import listening
from geofield.pipeline import run_tracks, tracks_of_plan
from geofield.plan import Plan
from geofield.review.commands import Command, EditError, apply_command
from geofield.review.ground import Ground
from geofield.settings import Settings

#: Steps that can be undone; a plan shares its unchanged tables with its neighbours.
MOST_STEPS = 500


@dataclass(frozen=True, slots=True)
class Step:
    """One state of the plan."""

    #: With the tracks that belong to it.
    plan: Plan
    #: What led to it; None for the plan that was opened.
    command: Command | None = None
    #: What the planner had to tell.
    notes: tuple[str, ...] = ()
    #: Whether the route that its settings want is not planned yet.
    waits: bool = False


class Session:
    """A plan and the edits made on it.

    Examples
    --------
    >>> session = Session(gf.read_plan("out/field.gpkg"))             # doctest: +SKIP
    >>> session.do({"do": "status", "no": 3, "status": "rejected"})   # doctest: +SKIP
    >>> session.undo()                                                # doctest: +SKIP

    Parameters
    ----------
    plan : Plan
        Field and obstacles count as they are; tracks are planned where there are none, or where
        they are of before a person's edits in another program. Where none can be planned it is
        shown without, until an edit mends that.
    ground : Ground, optional
        Finds the outline again for the edit ``ground``.
    """

    def __init__(self, plan: Plan, ground: Ground | None = None) -> None:
        self._ground = ground
        as_shown = plan.tracks is not None and is_planned(plan)
        #: Whether what lies in the file was edited since its tracks were planned.
        self.outdated = plan.tracks is not None and not as_shown
        #: Why no tracks can be planned for what lies in the file.
        self.unplanned: TrackError | None = None
        try:
            first = Step(plan) if as_shown else planned(plan, None, with_route=False)
        except TrackError as error:
            # The outline or the settings are put right here, as nothing else can.
            self.unplanned = error
            first = Step(replace(plan, tracks=None), notes=(error.message,))
        self._steps = [first]
        self._at = 0
        self._saved: Step | None = first if as_shown else None

    @property
    def step(self) -> Step:
        """The state that is shown."""
        return self._steps[self._at]

    @property
    def plan(self) -> Plan:
        """The plan as edited so far."""
        return self.step.plan

    @property
    def edited(self) -> bool:
        """Whether there is anything that was not saved."""
        return self.step is not self._saved

    @property
    def can_undo(self) -> bool:
        """Whether there is an edit to undo."""
        return self._at > 0

    @property
    def can_redo(self) -> bool:
        """Whether an undone edit can be made again."""
        return self._at + 1 < len(self._steps)

    def do(self, command: Command) -> Step:
        """Make an edit and plan the tracks again; the route only where the edit names one.

        Planning it takes seconds where obstacles are many: it waits for :meth:`whole`.

        Raises
        ------
        GeofieldError
            When the edit or the tracks after it are refused; nothing has changed then.
        """
        edited = self._edited(command)
        asked = command["do"] == "tracks" and "route" in command["settings"]
        step = planned(edited, command, with_route=asked)
        self._steps = [*self._steps[: self._at + 1], step][-MOST_STEPS:]
        self._at = len(self._steps) - 1
        return step

    def preview(self, command: Command) -> Plan:
        """The plan that an edit would lead to, its tracks and nothing else brought up to date.

        It follows a hand that drags: what is shown then needs no record of who said what.
        """
        plan = self._edited(command)
        settings = plan.settings or Settings()
        with listening():
            return replace(plan, tracks=tracks_of_plan(plan, settings))

    def _edited(self, command: Command) -> Plan:
        if command.get("do") != "ground":
            return apply_command(self.plan, command)
        if self._ground is None:
            raise EditError("There is no picture beside this plan to find its outline on.")
        return self._ground.find(self.plan, command)

    def undo(self) -> Step:
        """Go one edit back, if there is one."""
        self._at = max(self._at - 1, 0)
        return self.step

    def redo(self) -> Step:
        """Go one edit forth, if there is one."""
        self._at = min(self._at + 1, len(self._steps) - 1)
        return self.step

    def whole(self) -> Step:
        """The state that is shown, with its route: what is written.

        Raises
        ------
        TrackError
            When it has no tracks, as none could be planned.
        """
        from geofield.tracks import route_with_settings

        plan = self.plan
        if plan.tracks is None and self.unplanned is not None:
            raise self.unplanned
        if self.step.waits and plan.tracks is not None and plan.settings is not None:
            with listening():  # the tracks tell it
                tracks = route_with_settings(plan.tracks, plan.settings.tracks, plan.field.polygon)
            whole = replace(self.step, plan=replace(plan, tracks=tracks), waits=False)
            self._steps[self._at] = whole
        return self.step

    def mark_saved(self, step: Step) -> None:
        """Know that this state lies in the file now; what led to it can still be undone."""
        self._saved = step

    def forget(self) -> None:
        """Begin anew from the state that is shown: what led to it cannot be undone any more."""
        self._steps, self._at = [self.step], 0


def planned(plan: Plan, command: Mapping[str, Any] | None, *, with_route: bool = True) -> Step:
    """A plan with the tracks that follow from its field, obstacles and settings."""
    settings = plan.settings or Settings()
    with listening() as heard:
        after = run_tracks(plan, settings=settings, with_route=with_route)
    known = () if after.tracks is None else after.tracks.notes
    notes = [each for each in dict.fromkeys(map(str, heard)) if each not in known]
    kept = after.evidence.track_edits.in_words()
    waits = not with_route and settings.tracks.route != "none"
    return Step(after, command, (*notes, kept) if kept else tuple(notes), waits)
