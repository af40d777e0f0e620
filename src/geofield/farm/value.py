"""Farm: many plans under one schema; what is written as a folder and read back."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import geopandas as gpd
import pyarrow as pa
import pyarrow.compute as pc
import shapely

from geofield import schema
from geofield.errors import FormatError, MissingFileError, OutputExistsError
from geofield.farm import folder as place
from geofield.farm.failed import FAILED
from geofield.farm.layers import (
    FIELD_ID,
    KEPT,
    LAYERS,
    PLAN,
    Tables,
    frame_of,
    layer_table,
    plan_of,
    stacked,
    tables_of,
)
from geofield.farm.stac import COLLECTION, ITEMS
from geofield.farm.status import Outcome, outcome_words, status_table
from geofield.farm.store import Store
from geofield.model.card import card, field_drawn, words
from geofield.plan import Plan
from geofield.staging import refuse_locked
from geofield.staging.generations import earlier_of
from geofield.wording import counted

#: Fields per chunk of a farm that is written from memory.
CHUNK_FIELDS = 250
_SHOWN = 200


class Farm:
    """Many plans: a mapping of `field_id` to plan, and tables over all of them.

    >>> farm = gf.read_farm("farm/")                                  # doctest: +SKIP
    >>> farm.tracks.groupby("field_id")["length_m"].sum()             # doctest: +SKIP
    >>> farm["7"].write("one/")                                       # doctest: +SKIP

    Tables are GeoDataFrames with `field_id` and `utm_epsg` in every row: in the metric CRS where
    all fields share one, else in WGS 84, or, of fields near 180 degrees, in Pacific Mercator
    (EPSG:3832), where none is cut. Lengths (m) and areas (ha) in their columns are true.

    Parameters
    ----------
    plans : iterable of Plan
        Each with a `field_id` of its own.
    """

    def __init__(self, plans: Iterable[Plan] = ()) -> None:
        made = _Memory(list(plans))
        self._chunks: Sequence[int] = made.chunks
        self._table: Callable[..., Any] = made.table
        self._where: dict[str, int] = {}
        for chunk in self._chunks:
            for one in self._ids(chunk):
                if one in self._where:
                    raise FormatError(
                        f"Two plans have the field id {one!r}.",
                        hint="Give each field an id of its own.",
                    )
                self._where[one] = chunk

    @classmethod
    def _in(cls, store: Store) -> Farm:
        """The farm in a folder, of which only chunks with a status count."""
        farm = cls()
        farm._chunks, farm._table = place.committed(store), partial(place.read_part, store)
        farm._where = {one: chunk for chunk in farm._chunks for one in farm._ids(chunk)}
        return farm

    def _ids(self, chunk: int) -> list[str]:
        table = self._table(PLAN, chunk, [FIELD_ID])
        return [] if table is None else table[FIELD_ID].to_pylist()

    # -- a mapping of plans ------------------------------------------------------------------

    @property
    def ids(self) -> list[str]:
        """The field ids, neighbours beside each other."""
        return list(self._where)

    def __len__(self) -> int:
        return len(self._where)

    def __contains__(self, field_id: object) -> bool:
        return field_id in self._where

    def __iter__(self) -> Iterator[Plan]:
        """The plans, one after the other; only some of them are in memory."""
        for chunk in self._chunks:
            yield from self._plans(chunk)

    def __getitem__(self, field_id: str) -> Plan:
        if field_id not in self._where:
            close = difflib.get_close_matches(str(field_id), self._where, n=1)
            raise KeyError(
                f"no field {field_id!r} in this farm of {len(self)}"
                + (f"; did you mean {close[0]!r}?" if close else "")
            )
        tables = self._part(self._where[field_id])
        mine = {name: t.filter(pc.equal(t[FIELD_ID], field_id)) for name, t in tables.items()}
        return plan_of(mine)

    def _part(self, chunk: int) -> Tables:
        found = {name: self._table(name, chunk) for name in KEPT}
        return {name: table for name, table in found.items() if table is not None}

    def _plans(self, chunk: int) -> Iterator[Plan]:
        tables = self._part(chunk)
        rows = {name: _runs(table) for name, table in tables.items()}
        for one in rows[PLAN]:
            yield plan_of(
                {name: tables[name].slice(*rows[name][one]) for name in tables if one in rows[name]}
            )

    # -- tables over all ---------------------------------------------------------------------

    def layer(self, name: str) -> gpd.GeoDataFrame:
        """A layer of all fields; one without rows where no field has it.

        Parameters
        ----------
        name : str
            `field`, `obstacles`, `tracks`, `segments`, `gaps`, `headland`, `headland_tracks`,
            `route`, `turns` or `alternatives`.
        """
        if name not in {each.name for each in LAYERS}:
            raise FormatError(
                f"A farm has no layer {name!r}.",
                hint=f"Layers: {', '.join(each.name for each in LAYERS)}.",
            )
        found = (self._table(name, chunk) for chunk in self._chunks)
        parts = [part for part in found if part is not None]
        return frame_of(stacked(parts or [layer_table(schema.layer(name))]))

    @cached_property
    def fields(self) -> gpd.GeoDataFrame:
        """The outlines, with the user's own columns of the places."""
        return self.layer(schema.FIELD.name)

    @cached_property
    def obstacles(self) -> gpd.GeoDataFrame:
        """What stands in the fields."""
        return self.layer(schema.OBSTACLES.name)

    @cached_property
    def tracks(self) -> gpd.GeoDataFrame:
        """The tracks."""
        return self.layer(schema.TRACKS.name)

    @cached_property
    def segments(self) -> gpd.GeoDataFrame:
        """Their drivable pieces."""
        return self.layer(schema.SEGMENTS.name)

    @cached_property
    def gaps(self) -> gpd.GeoDataFrame:
        """What lies between those."""
        return self.layer(schema.GAPS.name)

    @cached_property
    def headland(self) -> gpd.GeoDataFrame:
        """The headlands, where they were planned."""
        return self.layer(schema.HEADLAND.name)

    @cached_property
    def headland_tracks(self) -> gpd.GeoDataFrame:
        """The tracks in the headlands."""
        return self.layer(schema.HEADLAND_TRACKS.name)

    @cached_property
    def route(self) -> gpd.GeoDataFrame:
        """The routes, where they were planned."""
        return self.layer(schema.ROUTE.name)

    @cached_property
    def turns(self) -> gpd.GeoDataFrame:
        """The turns of the routes."""
        return self.layer(schema.TURNS.name)

    @cached_property
    def status(self) -> gpd.GeoDataFrame:
        """What became of each place: `status`, `error`, `hint`, `certainty`, `doubts`, seconds.

        Places that failed have rows here alone.
        """
        parts = [self._table(place.STATUS, chunk) for chunk in self._chunks]
        table = pa.concat_tables([*parts, status_table([])], promote_options="permissive")
        shapes = shapely.from_wkb(table["geometry"].to_numpy())
        rest = table.drop_columns("geometry").to_pandas()
        texts = [name for name in rest if table.schema.field(name).type == pa.string()]
        rest[texts] = rest[texts].fillna("")
        return gpd.GeoDataFrame(rest, geometry=shapes, crs=4326)

    # -- writing and showing -----------------------------------------------------------------

    def write(self, folder: str | Path, *, overwrite: bool = False) -> Path:
        """Write the farm as a folder of GeoParquet files.

        Parameters
        ----------
        folder : path
            A new or empty one, or a farm that may be replaced.
        overwrite : bool
            Replace the farm that is there.

        Returns
        -------
        Path
            The folder.
        """
        store = Store.of(folder)
        there = store.names("")
        if there and not (overwrite and place.Record.read(store) is not None):
            raise OutputExistsError(
                f"{folder} is not empty.", hint="Choose another folder, or allow overwriting."
            )
        # Read before it is cleared: it may be this very farm.
        parts = [(self._part(one), self._table(place.STATUS, one)) for one in self._chunks]
        if there:
            _clear_all(store)
        store.put(place.RECORD, place.Record(chunks=len(parts)).to_json())
        for number, (tables, status) in enumerate(parts):
            place.write_chunk(store, number, tables, status)
        return Path(folder)

    def __repr__(self) -> str:
        return words(f"Farm of {counted(len(self), 'field')}", self._figures())

    def _repr_html_(self) -> str:
        shapes = self.fields.geometry.iloc[:_SHOWN]
        return card(
            f"Farm of {counted(len(self), 'field')}",
            self._figures(),
            [field_drawn(s) for s in shapes],
        )

    def _figures(self) -> dict[str, str]:
        def total(layer: schema.Layer, column: str) -> float:
            parts = (self._table(layer.name, one, [column]) for one in self._chunks)
            return sum(pc.sum(part[column]).as_py() or 0.0 for part in parts if part is not None)

        area_ha, length_m = total(schema.FIELD, "area_ha"), total(schema.TRACKS, "length_m")
        figures = {"area": f"{area_ha:.2f} ha", "tracks": f"{length_m / 1000:.2f} km"}
        counts = self.status["status"].value_counts()
        figures["status"] = (
            ", ".join(f"{counts[name]} {name}" for name in place.STATUSES if name in counts)
            or "no place is done"
        )
        return figures


class _Memory:
    """Tables made of plans."""

    def __init__(self, plans: list[Plan]) -> None:
        self._plans = plans
        self.chunks = range((len(plans) + CHUNK_FIELDS - 1) // CHUNK_FIELDS)
        self._made: dict[int, Tables] = {}

    def table(self, layer: str, chunk: int, columns: Sequence[str] | None = None) -> Any:
        """A layer of a chunk, or some columns of it; None where there is none."""
        if chunk not in self._made:
            plans = self._plans[chunk * CHUNK_FIELDS : (chunk + 1) * CHUNK_FIELDS]
            self._made[chunk] = {
                **tables_of(plans),
                place.STATUS: status_table([_outcome(plan) for plan in plans]),
            }
        table = self._made[chunk].get(layer)
        return table if table is None or columns is None else table.select(columns)


def _outcome(plan: Plan) -> Outcome:
    lat, lon = plan.point
    field = plan.field
    return Outcome(field.field_id, field.name, lat=lat, lon=lon, **outcome_words(plan))


def _runs(table: pa.Table) -> dict[str, tuple[int, int]]:
    """Where each field's rows begin, and how many there are: they lie beside each other."""
    runs: dict[str, tuple[int, int]] = {}
    for row, one in enumerate(table[FIELD_ID].to_pylist()):
        begin, count = runs.get(one, (row, 0))
        runs[one] = (begin, count + 1)
    return runs


def clear(store: Store) -> None:
    """Take away a farm's chunks, the marks that they count first; what a person made stays."""
    for name in (place.STATUS, *KEPT):
        store.remove(name)


def _clear_all(store: Store) -> None:
    """Take away what was made of a farm as well; an overview, perhaps edited, stays as ``.bak``."""
    overview = Path(store.place, place.OVERVIEW)
    if store.folder is not None and overview.is_file():
        refuse_locked(overview)
        overview.replace(earlier_of(overview))
    clear(store)
    for name in (COLLECTION, ITEMS, FAILED):
        store.remove(name)


def is_farm(folder: str | Path) -> bool:
    """Whether a folder, or an address of an object store, holds a farm."""
    if "://" not in str(folder):
        return (Path(folder) / place.RECORD).is_file()
    return Store.of(folder).get(place.RECORD) is not None


def read_farm(folder: str | Path) -> Farm:
    """Read a farm that ``geofield batch`` or :meth:`Farm.write` wrote, finished or not.

    >>> farm = gf.read_farm("FARM/")  # doctest: +SKIP

    Parameters
    ----------
    folder : path
        A folder, or an address of an object store.

    Raises
    ------
    FormatError
        When there is no farm.
    """
    store = Store.of(folder)
    if place.Record.read(store) is None:
        # At an address there is nothing but the farm.
        missing = FormatError if Path(folder).exists() else MissingFileError
        raise missing(
            f"{folder} is no farm of geofield: there is no {place.RECORD}.",
            hint="Make one with `geofield batch PLACES --out FARM/`.",
        )
    return Farm._in(store)
