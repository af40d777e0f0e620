"""What a person edited in a farm's overview, taken into the farm before anything is written anew.

``farm.gpkg`` remembers digests of each field as it was written. A field whose outline, name,
obstacles, tracks or columns of a person's own differ from them was edited: its plan takes the edits
in, its tracks are planned again, and it counts as reviewed from then on, like one put back with
``geofield farm put``.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Collection, Iterable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import geopandas as gpd
import pandas as pd

from geofield import schema
from geofield.errors import FieldWarning, FormatError, FormatWarning
from geofield.farm import edited_tracks
from geofield.farm.as_left import (
    DETAILS,
    DIGESTS,
    OWN,
    TRACKS,
    lines_with_owners,
    obstacles_with_owners,
    record_in,
    table_in,
)
from geofield.farm.as_written import digests_of, own_digests, own_names, unlike, with_rest
from geofield.farm.dissolved import TOLD, undissolved
from geofield.farm.doubles import changed_elsewhere, refuse_double, tell_double
from geofield.farm.edited_in_place import BEGUN
from geofield.farm.edited_plan import Edits, edited_plan, planned
from geofield.farm.folder import REVIEWED, Record
from geofield.farm.layers import FIELD_ID
from geofield.farm.neighbours import shared
from geofield.farm.put_back import keep_plans, refuse_unseen, replace_plans
from geofield.farm.store import Store
from geofield.farm.value import Farm, read_farm
from geofield.formats import origin
from geofield.model.merged_rows import parts_apart
from geofield.notes import listening, warn
from geofield.plan import Plan
from geofield.wording import command, counted, some_of

#: The edits that the farm holds already, while the overview is older than it.
TAKEN = f"{REVIEWED}/.taken.json"
#: Ground that an outline gained, square metres, that is worth a word.
_LEAST_M2 = 1.0


def remember_own(overview: Path, written: Mapping[str, gpd.GeoDataFrame]) -> None:
    """Note in an overview what its columns of a person's own hold, as they read from the file.

    `written` are the tables that it was made of: in the file some columns have other names.
    """

    def as_read(layers: Iterable[schema.Layer]) -> dict[schema.Layer, gpd.GeoDataFrame]:
        """Layers of which one has such columns; none where none has: tracks are many."""
        some = [of for of in layers if of.name in written]
        has_own = any(own_names(of, written[of.name]) for of in some)
        if not has_own:
            return {}
        return {of: table_in(overview, of, written[of.name].crs) for of in some}

    standing, driven = as_read((schema.FIELD, schema.OBSTACLES)), as_read(edited_tracks.EDITED)
    names = {
        of.name: dict(zip(own_names(of, table), own_names(of, written[of.name]), strict=True))
        for of, table in {**standing, **driven}.items()
    }
    if not names:
        return
    told: dict[str, Any] = {OWN: {"columns": names, "digests": own_digests(standing)}}
    if driven:
        told[TRACKS] = edited_tracks.track_digests(driven)
    with closing(sqlite3.connect(overview)) as file, file:
        (text,) = file.execute(
            "SELECT metadata FROM gpkg_metadata WHERE md_standard_uri = ?", (origin.URI,)
        ).fetchone()
        content = json.loads(text)
        content["evidence"] |= told
        text = json.dumps(content, ensure_ascii=False, indent=1)
        file.execute(
            "UPDATE gpkg_metadata SET metadata = ? WHERE md_standard_uri = ?", (text, origin.URI)
        )


def _edits(farm: Farm, overview: Path, taken: Mapping[str, str]) -> Edits:
    """What was edited in the overview, but for the edits that were `taken` before.

    Raises
    ------
    FormatError
        When an edit cannot be understood; says which field and why.
    """
    noted = record_in(overview)
    record = {DIGESTS: {}, DETAILS: False, **noted.provenance.evidence}
    written = record[DIGESTS]
    fields, obstacles = (
        table_in(overview, of, noted.crs) for of in (schema.FIELD, schema.OBSTACLES)
    )
    _refuse_strange(overview, fields, written)
    names = record.get(OWN, {}).get("columns", {})
    obstacles, now, told = _obstacles(farm, obstacles, fields, record, names)
    tables = {schema.FIELD: fields, schema.OBSTACLES: obstacles}
    gone = sorted(written.keys() - set(fields[FIELD_ID]))
    if gone:
        warn(
            f"{overview.name}: {counted(len(gone), 'field is', 'fields are')} deleted there "
            f"({', '.join(gone[:5])}), and a "
            "farm holds every place. Take their rows out of the places file, then --fresh.",
            FormatWarning,
        )
    own, own_before = own_digests(tables), _own_before(overview, tables, record)
    tracks, driven = _tracks(farm, overview, fields, record, names)
    for one in edited_tracks.saying_nothing_new(farm, driven, tracks, names):
        del driven[one]
    marks = {
        one: f"{written[one]} {told[one]} {own.get(one)} {driven.get(one, '')}".rstrip()
        for one in fields[FIELD_ID]
        if one in taken  # perhaps to take back what was said
        or now[one] != written[one]
        or one in driven
        or (own_before is not None and own.get(one) != own_before.get(one))
    }
    marks = {one: mark for one, mark in marks.items() if taken.get(one) != mark}
    standing = obstacles if record[DETAILS] else None
    return Edits(marks, fields, standing, names, tracks, driven)


def _obstacles(
    farm: Farm,
    left: gpd.GeoDataFrame,
    fields: gpd.GeoDataFrame,
    record: Mapping[str, Any],
    names: edited_tracks.Names,
) -> tuple[gpd.GeoDataFrame, dict[str, str], dict[str, str]]:
    """Obstacles of an overview with the fields that they are of, and the digests of these.

    The second ones are those of the rows as they were left, whatever the farm holds by now.
    """
    written, of = record[DIGESTS], schema.OBSTACLES
    obstacles = obstacles_with_owners(left, fields, written)
    now = digests_of(fields, obstacles)
    edited = [one for one in fields[FIELD_ID] if now[one] != written[one]]
    if not edited:
        return obstacles, now, now
    were = edited_tracks.layers_of(farm, [schema.FIELD, of], edited, fields.crs, names)
    there = {schema.FIELD: fields, of: obstacles if record[DETAILS] else were[of]}
    some = {each: table[table[FIELD_ID].isin(edited)] for each, table in there.items()}
    as_before = {one: written[one] for one in set(edited) - unlike(some, were)}
    if len(as_before) == len(edited) or not record[DETAILS]:
        return obstacles, now | as_before, now
    left, merged = undissolved(of, left, were[of], fields)
    obstacles = obstacles_with_owners(parts_apart(left), fields, written)
    return obstacles, digests_of(fields, obstacles) | as_before, with_rest(now, merged)


def _tracks(
    farm: Farm,
    overview: Path,
    fields: gpd.GeoDataFrame,
    record: Mapping[str, Any],
    names: edited_tracks.Names,
) -> tuple[edited_tracks.Tables, dict[str, str]]:
    """Tracks and segments of an overview, and digests of the fields where they were changed.

    None where it does not remember how they were. A layer that was deleted or emptied is no word
    on any one track, nor is a field of which no row is left.
    """
    written = record.get(TRACKS)
    if not written:
        return {}, {}
    there = edited_tracks.layers_in(overview)
    left = {of: table_in(overview, of, fields.crs) for of in edited_tracks.EDITED if of in there}
    whole = len(left) == len(edited_tracks.EDITED) and all(len(table) for table in left.values())
    tables = {of: lines_with_owners(table, fields, written) for of, table in left.items()}
    digests = edited_tracks.track_digests(tables) if whole else {}
    bare = _bare(tables, fields, written)
    edited = [one for one in written if whole and digests.get(one) != written[one]]
    driven: dict[str, str] = {}
    if edited:
        were = edited_tracks.layers_of(farm, edited_tracks.EDITED, edited, fields.crs, names)
        found = {of: undissolved(of, table, were[of], fields) for of, table in left.items()}
        tables = {of: lines_with_owners(table, fields, written) for of, (table, _) in found.items()}
        told = with_rest(digests, set().union(*(merged for _, merged in found.values())))
        now = edited_tracks.track_digests(tables)
        driven = {one: told.get(one, "") for one in now if now[one] != written.get(one)}
        bare = _bare(tables, fields, written)
    for of, some in bare.items():
        if some:
            warn(
                f"{overview.name}: no {of.name} are left of field {some_of(some, TOLD)}. No field "
                "is left without any: they come back.",
                FormatWarning,
            )
    return (tables, driven) if whole else ({}, {})


def _bare(
    tables: edited_tracks.Tables, fields: gpd.GeoDataFrame, written: Collection[str]
) -> dict[schema.Layer, list[str]]:
    """By layer the fields of which no row is left."""
    known = set(fields[FIELD_ID]) & set(written)
    return {
        of: sorted(known - set(tables[of][FIELD_ID] if of in tables else ()))
        for of in edited_tracks.EDITED
    }


def _own_before(
    overview: Path, tables: Mapping[schema.Layer, gpd.GeoDataFrame], record: Mapping[str, Any]
) -> dict[str, str] | None:
    """The digests of a person's own columns as they were; None where they tell nothing."""
    before = record.get(OWN)
    if before is None:
        return None
    for of, table in tables.items():
        gone = [name for name in before["columns"].get(of.name, ()) if name not in table]
        if gone:
            warn(
                f"{overview.name}: columns {', '.join(gone)} of layer {of.name!r} are gone and "
                "come back; what else was written into columns of your own is not taken in.",
                FormatWarning,
            )
            return None
    digests: dict[str, str] = before["digests"]
    return digests


def _refuse_strange(overview: Path, fields: gpd.GeoDataFrame, known: Mapping[str, str]) -> None:
    """Refuse outlines that are of no field of the farm, or several of one."""
    ids = fields[FIELD_ID]
    if ids.isna().any() or not set(ids) <= known.keys():
        strange = ids[~ids.isin(list(known))].iloc[0]
        raise FormatError(
            f"{overview.name} has an outline without a field_id."
            if pd.isna(strange)
            else f"{overview.name} has a field {strange!r} that the farm does not know.",
            hint="Give it its field_id back; new fields are rows of the places file.",
        )
    if ids.duplicated().any():
        raise FormatError(
            f"{overview.name} has several outlines of field {ids[ids.duplicated()].iloc[0]!r}.",
            hint="Delete or merge (Edit > Merge Selected Features) all but one; to have two "
            "fields, give both a row in the places file.",
        )


def is_overview(path: Path) -> bool:
    """Whether a file is the overview of a farm."""
    try:
        return bool(record_in(path).provenance.evidence.get(DIGESTS))
    except FormatError:
        return False


def _tell_not_looked_up(store: Store, farm: Farm, edited: Mapping[str, Plan]) -> None:
    """Tell where an outline was moved over ground on which the file of obstacles was not read."""
    file = (Record.read(store) or Record()).imagery.get("obstacles")
    wider = [
        one
        for one, plan in edited.items()
        if plan.field.polygon.difference(farm[one].field.polygon).area > _LEAST_M2
    ]
    if file and wider:
        words = (
            f"The obstacles of {file} are not looked up yet on ground that field "
            f"{', '.join(wider[:5])} gained: `geofield batch` with --fresh does that."
        )
        warn(words, FieldWarning)


def is_edited(folder: Path, overview: Path) -> bool:
    """Whether an overview has edits that its farm has not taken in, or cannot understand."""
    if not overview.is_file():
        return False
    taken = _taken(Store.of(folder), overview)
    with listening(FormatWarning):
        try:
            return bool(_edits(read_farm(folder), overview, taken).marks)
        except FormatError:
            return True


def _taken(store: Store, overview: Path) -> dict[str, str]:
    """The edits of a farm's own overview that it holds already; none of another one."""
    own = store.folder is not None and overview.parent.samefile(store.folder)
    return store.noted(TAKEN) if own else {}


def put_edits(
    folder: Path,
    overview: Path,
    *,
    only: Collection[str] | None = None,
    but: str | None = None,
    anyway: bool = False,
    around: gpd.GeoDataFrame | None = None,
) -> tuple[list[str], list[str]]:
    """Take the edits of an overview into the farm, or `only` those of some fields.

    Fields that were changed elsewhere, too, are refused unless the edits are to hold `anyway`,
    which is told; `but` is a field of which another plan is about to be put back; `around` are the
    obstacles of a file of their own, for outlines that were moved.

    Returns
    -------
    ids : list of str
        The fields that are now as edited, and those that an edited obstacle reaches into.
    waiting : list of str
        Edited fields of which the farm has no plan, or not yet.

    Raises
    ------
    FormatError
        When an edit cannot be understood, or its field was changed elsewhere; the farm is as it was
        then.
    """
    if not overview.is_file():
        return [], []
    store, farm = Store.of(folder), read_farm(folder)
    taken = _taken(store, overview)
    edits = _edits(farm, overview, taken)
    # Edited fields without a plan until now cannot have been changed.
    elsewhere = changed_elsewhere(farm, overview, edits) if only is None else []
    if elsewhere and not anyway:
        refuse_double(overview, elsewhere)
    if but in edits.marks:
        raise FormatError(
            f"Field {but} is edited in {overview.name}, too.",
            hint=f"Take those edits in first: {command('farm', 'put', overview, folder)}. What is "
            "put back last, holds.",
        )
    asked = [one for one in edits.marks if only is None or one in only]
    here = [one for one in asked if one in farm]
    waiting = [one for one in asked if one not in farm]
    if not here:
        return here, waiting
    outlines = farm.layer(schema.FIELD.name).set_index(FIELD_ID).geometry
    outlines = outlines.to_crs(edits.fields.crs)
    edited = {one: edited_plan(farm[one], edits, outlines, around) for one in here}
    plans = shared(edited, farm)
    if around is None:
        _tell_not_looked_up(store, farm, edited)
    put = [planned(plan) for plan in plans.values()]
    tell_double(store, overview, elsewhere)
    refuse_unseen(store, plans.keys())
    # Where all ends amid this, the same is done again, from the farm as it is until then.
    store.note(BEGUN, [str(overview.absolute()), *plans])
    keep_plans(store, put)
    store.note(TAKEN, taken | {one: edits.marks[one] for one in here})
    store.remove(BEGUN)
    replace_plans(store, put)
    return list(plans), waiting
