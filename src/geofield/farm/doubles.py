"""Fields that were edited in a farm's overview, and changed in the farm since that was written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from geofield import schema
from geofield.errors import FieldWarning, FormatError
from geofield.farm import edited_tracks
from geofield.farm.as_left import DETAILS, DIGESTS, OWN, TRACKS, record_in
from geofield.farm.as_written import digests_of
from geofield.farm.edited_plan import Edits
from geofield.farm.layers import FIELD_ID
from geofield.farm.reviewed import file_of, reviewed_files
from geofield.farm.store import Store
from geofield.farm.value import Farm
from geofield.notes import warn
from geofield.staging.generations import earlier_of
from geofield.wording import command


def changed_elsewhere(farm: Farm, overview: Path, edits: Edits) -> list[str]:
    """The edited fields that the farm has otherwise than when the overview was written."""
    edited, crs = list(edits.marks), edits.fields.crs
    if not edited:
        return []
    ours = farm.layer(schema.FIELD.name)
    if ours.crs != crs:
        return []
    record = record_in(overview).provenance.evidence
    theirs = farm.layer(schema.OBSTACLES.name).to_crs(crs)
    theirs = theirs if record.get(DETAILS) else theirs.iloc[:0]
    there = digests_of(ours[ours[FIELD_ID].isin(edited)], theirs[theirs[FIELD_ID].isin(edited)])
    double = [one for one in there if there[one] != record[DIGESTS][one]]
    if TRACKS in record:
        names = record.get(OWN, {}).get("columns", {})
        were = edited_tracks.layers_of(farm, edited_tracks.EDITED, edited, crs, names)
        driven = edited_tracks.track_digests(were)
        double += [one for one in edited if driven.get(one) != record[TRACKS].get(one)]
    return list(dict.fromkeys(double))


def refuse_double(overview: Path, double: Sequence[str]) -> NoReturn:
    """Refuse to choose.

    Raises
    ------
    FormatError
    """
    raise FormatError(
        f"Field {double[0]} was edited in {overview.name}, and changed in the farm since that "
        "was written.",
        hint=f"To have the one of {overview.name}: "
        f"{command('farm', 'put', overview, overview.parent)}; to have the other, move "
        f"{overview.name} out of the farm.",
    )


def tell_double(store: Store, overview: Path, double: Sequence[str]) -> None:
    """Tell of what the overview is about to be put over, and where that stays."""
    there = reviewed_files(store)
    for one in double:
        stays = ""
        if file_of(one) in there:
            stays = f"; the other plan stays as {earlier_of(Path(file_of(one)))}"
        warn(
            f"Field {one} was changed in the farm since {overview.name} was written, too: what "
            f"{overview.name} says holds{stays}.",
            FieldWarning,
        )
