"""The fields of a farm on the desk, the most doubtful first; saving puts them back into the farm.

A field that is edited lies as a GeoPackage in FARM/reviewing until the session ends, with its
journal beside it, as any other plan.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from geofield.errors import ChangedError, FormatError, GeofieldError
from geofield.farm import read_farm
from geofield.farm.finish import renew_unless_edited
from geofield.farm.folder import OVERVIEW
from geofield.farm.marks import CHANGED
from geofield.farm.pictures import pictures_of
from geofield.farm.put_back import put_back
from geofield.farm.reviewed import name_of
from geofield.farm.store import Store
from geofield.formats.names import safe_name
from geofield.plan import Plan, read_plan
from geofield.plan_files import save_plan
from geofield.review.desk import Desk
from geofield.review.plans import REVIEWING, journal_path
from geofield.staging import claimed
from geofield.wording import command

#: Fields up to which a farm's overview is written anew (seconds) whenever one is saved; that of a
#: larger farm when the session ends.
_AT_ONCE = 1000


class FarmDesk(Desk):
    """A field of a farm, by its id."""

    def __init__(
        self, folder: Path, field_id: str, picture: Path | None, found: Path | None
    ) -> None:
        self._folder, self._field_id = folder, field_id
        self._put_back = False
        path = _file_of(folder, field_id)
        path.parent.mkdir(exist_ok=True)
        self._fetch(path)
        super().__init__(path, picture, found=found)

    def _fetch(self, path: Path) -> None:
        """Have the field's plan as the farm has it, and keep a journal that belongs to it."""
        self._there = self._in_farm()
        if not (path.exists() and journal_path(path).exists() and read_plan(path) == self._there):
            save_plan(self._there, path, overwrite=True)

    def _exports(self) -> tuple[Path, str]:
        return self._folder / "export" / self.path.stem, safe_name(self._field_id)

    def _in_farm(self) -> Plan:
        return read_farm(self._folder)[self._field_id]

    def save(self, target: str | None = None) -> dict[str, Any]:
        """Put the field back into the farm, or write it under another name."""
        if target is not None:
            return super().save(target)
        with self.lock, claimed(self._folder):
            if self._in_farm() != self._there:
                raise ChangedError(
                    f"Another program changed {self._field_id} in the farm since it was opened "
                    "here.",
                    hint="Reload it (edits made here are made again where they fit), or save your "
                    "edits under another name (see More).",
                )
            with tempfile.TemporaryDirectory(prefix="geofield-") as name:
                whole = Path(name) / "field.gpkg"
                save_plan(self.session.whole().plan, whole)
                put_back(whole, self._folder, anyway=True)  # compared above
            self._put_back = True
            self._there = self._in_farm()
            saved = {**super().save(), "saved_as": self._folder.name}
            if len(read_farm(self._folder)) <= _AT_ONCE:
                self._renewed()
            return saved

    def reload(self) -> dict[str, Any]:
        """Take the field as the farm has it now; edits that were not saved are kept beside it."""
        with self.lock:
            if not self.journal.refused:
                self._fetch(self.path)
            return super().reload()

    def end(self) -> str | None:
        """Leave nothing in the farm but edits that were not saved; where those are, in words."""
        words = super().end()
        if words is None:
            for each in (self.path, self.path.with_name(f"{self.path.name}.bak")):
                each.unlink(missing_ok=True)
            self.path.with_suffix(".qgz").unlink(missing_ok=True)
            if not any(self.path.parent.iterdir()):
                self.path.parent.rmdir()
        return words or (self._renewed() if self._put_back else None)

    def _renewed(self) -> str | None:
        """Write the farm's overview anew; why it stays as it is, in words.

        What was saved is safe in the farm then, and the next run writes the overview.
        """
        store, overview = Store.of(self._folder), self._folder / OVERVIEW
        if store.get(CHANGED) is None or not overview.is_file():
            return None
        try:
            with claimed(self._folder):
                if renew_unless_edited(store):
                    return None
        except GeofieldError as error:
            return f"{overview} does not show yet what was saved: {error}"
        return (
            f"{overview} does not show yet what was saved: it has edits of its own. Take them in: "
            f"{command('farm', 'put', overview, self._folder)}"
        )


def farm_desks(folder: Path, picture: Path | None) -> list[tuple[str, Callable[[], Desk]]]:
    """What the fields of a farm are called, and how each comes on the desk.

    First come those with edits that were not saved, then those that nobody reviewed: the doubtful
    ones before the others, the least certain before all.
    """
    found = read_farm(folder).status
    found = found[found["status"].isin(["done", "doubtful"])]
    if not len(found):
        raise FormatError(f"{folder} holds no plan yet.", hint="Go on with `geofield batch`.")
    doubtful = found["status"] == "doubtful"
    found = found.assign(
        _begun=[not journal_path(_file_of(folder, one)).exists() for one in found["field_id"]],
        _sure=~doubtful,
        _likely=found["certainty"].astype(float).fillna(1.0),
    )
    found = found.sort_values(["_begun", "reviewed", "_sure", "_likely"], kind="stable")
    below = pictures_of(folder)
    return [
        (_title(row), partial(FarmDesk, folder, str(row.field_id), picture, below))
        for row in found.itertuples()
    ]


def _file_of(folder: Path, field_id: str) -> Path:
    return folder / REVIEWING / name_of(field_id)


def _title(row: Any) -> str:
    name = row.name if row.name in ("", row.field_id) else f"{row.name} ({row.field_id})"
    mark = "✓" if row.reviewed else "?" if row.status == "doubtful" else ""
    return " ".join(part for part in (name or row.field_id, mark) if part)
