"""The plans of a session: one, or all that lie in a folder; a desk for each that is opened."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

from geofield.errors import FormatError
from geofield.review.desk import Desk
from geofield.review.guard import OtherTabError
from geofield.review.plans import is_farm, plans_in


class Shelf:
    """Plans that can be reviewed in one session: a GeoPackage, a farm, or a folder with several.

    Raises
    ------
    FormatError
        When a folder holds no plan.
    """

    def __init__(self, place: Path, picture: Path | None = None) -> None:
        made = _desks_of(place, picture)
        self.names = [name for name, _ in made]
        self._make = [make for _, make in made]
        self._desks: dict[int, Desk] = {}
        self._lock = threading.RLock()
        self._holder: str | None = None
        self.current = 0
        self.desk_of(0)

    @property
    def desk(self) -> Desk:
        """The plan that is worked on."""
        return self.desk_of(self.current)

    def desk_of(self, number: int) -> Desk:
        """A plan by its place in the list; what was edited on it is as it was left."""
        with self._lock:
            if number not in self._desks:
                self._desks[number] = self._make[number]()
            return self._desks[number]

    def open(self, number: int) -> None:
        """Work on another plan."""
        if not 0 <= number < len(self.names):
            raise FormatError(f"There is no plan {number} here.")
        with self._lock:
            self.desk_of(number)
            self.current = number

    def end(self) -> list[str]:
        """What there is to say of plans that were edited and not saved."""
        ended = [desk.end() for desk in self._desks.values()]
        return [words for words in ended if words is not None]

    def refuse_loss(self) -> None:
        """Refuse to end while edits lie nowhere on the disk.

        Raises
        ------
        FormatError
        """
        for desk in self._desks.values():
            desk.refuse_loss()

    @property
    def noted(self) -> bool:
        """Whether edits that were not saved lie in notes, where the next session finds them."""
        return any(
            desk.session.edited and not (desk.journal.is_empty or desk.journal.refused)
            for desk in self._desks.values()
        )

    @property
    def lost(self) -> bool:
        """Whether edits were neither saved nor noted when the session ended."""
        return any(desk.lost for desk in self._desks.values())

    def take(self, tab: str, *, force: bool = False) -> bool:
        """Whether a tab of the browser may edit: the first one, or one that takes over."""
        with self._lock:
            if self._holder is None or force:
                self._holder = tab
            return self._holder == tab

    def refuse_others(self, tab: str) -> None:
        """Refuse what a tab asks that may not edit.

        Raises
        ------
        OtherTabError
        """
        if self._holder != tab:
            raise OtherTabError(
                "Another tab is editing this plan.", hint="Go on there, or take over here."
            )

    def refuse_outdated(self, stamp: str | None) -> None:
        """Refuse an edit of a plan that a page shows as it was: it would change something else.

        Raises
        ------
        OtherTabError
        """
        if stamp is not None and stamp != self.desk.stamp:
            raise OtherTabError(
                "This page does not show the plan as it is: it was changed in another tab.",
                hint="Go on there, or take over here.",
            )


def _desks_of(place: Path, picture: Path | None) -> list[tuple[str, Callable[[], Desk]]]:
    """What the plans of a place are called, and how each comes on the desk."""
    if place.is_file():
        return [(place.name, partial(Desk, place, picture))]
    if is_farm(place):
        from geofield.review.farm import farm_desks

        return farm_desks(place, picture)
    return [
        (str(path.relative_to(place)), partial(Desk, path, picture)) for path in plans_in(place)
    ]
