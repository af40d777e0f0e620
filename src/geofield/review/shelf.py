"""The plans of a session: one, or all that lie in a folder; a desk for each that is opened."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path

from geofield.errors import FormatError
from geofield.review.desk import Desk

#: The file that makes a folder a farm.
FARM = "farm.json"
#: Folders below the one that was named: `farm/field.gpkg` and `farm/field-7/field.gpkg`.
_DEPTH = ("*.gpkg", "*/*.gpkg")


class Shelf:
    """Plans that can be reviewed in one session.

    Parameters
    ----------
    place : Path
        A GeoPackage of geofield, a farm, or a folder in which several GeoPackages lie.
    picture : Path, optional
        Shown below; the picture beside each plan when not given.

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

    def take(self, tab: str, *, force: bool = False) -> bool:
        """Whether a tab of the browser may edit: the first one, or one that takes over."""
        with self._lock:
            if self._holder is None or force:
                self._holder = tab
            return self._holder == tab

    def holds(self, tab: str) -> bool:
        """Whether a tab may edit."""
        return self._holder == tab


def _desks_of(place: Path, picture: Path | None) -> list[tuple[str, Callable[[], Desk]]]:
    """What the plans of a place are called, and how each comes on the desk."""
    if place.is_file():
        return [(place.name, partial(Desk, place, picture))]
    if (place / FARM).is_file():
        from geofield.review.farm import farm_desks

        return farm_desks(place, picture)
    return [
        (str(path.relative_to(place)), partial(Desk, path, picture)) for path in plans_in(place)
    ]


def plans_in(folder: Path) -> list[Path]:
    """The plans of geofield in a folder and the folders in it, by name."""
    places = [path for pattern in _DEPTH for path in sorted(folder.glob(pattern))]
    found = [path for path in places if not path.name.startswith(".") and _is_plan(path)]
    if not found:
        raise FormatError(
            f"{folder} holds no plan of geofield.",
            hint="Name a GeoPackage that `geofield run` wrote, or a folder with such files.",
        )
    return found


def _is_plan(path: Path) -> bool:
    try:
        with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as file:
            return bool(file.execute("SELECT 1 FROM gpkg_metadata").fetchone())
    except sqlite3.Error:
        return False
