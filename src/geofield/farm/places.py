"""Places: the rows of a file that each become a field, as points or as parcels that may overlap.

Kept as Arrow columns and well-known binary, so that a million places fit into memory; one
becomes a :class:`Place` when it is its turn.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import geopandas as gpd
import numpy as np
import pyarrow as pa
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield.crs import areas_anywhere_m2
from geofield.farm.place_settings import missing

#: Shared borders of parcels are never quite the same: smaller overlaps are none.
_LEAST_M2 = 10.0
#: Parcels that are compared at a time, neighbours along the space-filling curve.
_AT_A_TIME = 100_000


@dataclass(frozen=True, slots=True)
class Place:
    """One field to be planned."""

    #: In the file, from 1.
    row: int
    field_id: str
    name: str
    #: lat, lon: degrees, WGS 84; not a number where the row has no position.
    lat: float
    lon: float
    #: The parcel, well-known binary in `crs`.
    outline: bytes | None = None
    #: WKT or code; empty for points.
    crs: str = ""
    #: The user's own columns.
    own: tuple[tuple[str, Any], ...] = ()
    #: Those that hold for this field alone, by name.
    settings: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Places:
    """The places of a file, in its order."""

    path: str
    ids: pa.Array
    names: pa.Array
    lat: NDArray[np.float64]
    lon: NDArray[np.float64]
    #: In the file, from 1: a parcel of several parts is several places.
    rows: NDArray[np.int64]
    outlines: pa.Array | None
    #: Of the outlines.
    crs: CRS
    #: The user's own columns.
    own: pa.Table
    #: The columns that are settings.
    settings: pa.Table
    #: What the person should know of the file.
    notes: tuple[str, ...] = ()
    #: What is to be told of single places, by position.
    remarks: Mapping[int, str] = field(default_factory=dict)
    #: Whether the file has a column of ids.
    ids_given: bool = False

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Of each row whether it says where it is."""
        return np.asarray(np.isfinite(self.lat) & np.isfinite(self.lon))

    @property
    def parcels(self) -> bool:
        """Whether every place is a parcel, but for rows that say nothing of where they are."""
        if self.outlines is None:
            return False
        return not (self.known & self.outlines.is_null().to_numpy(zero_copy_only=False)).any()

    def only(self, chosen: NDArray[np.bool_]) -> Places:
        """Some of the places, as if the others were not in the file."""
        positions = np.flatnonzero(chosen)
        return replace(
            self,
            ids=self.ids.take(positions),
            names=self.names.take(positions),
            lat=self.lat[positions],
            lon=self.lon[positions],
            rows=self.rows[positions],
            outlines=None if self.outlines is None else self.outlines.take(positions),
            own=self.own.take(positions),
            settings=self.settings.take(positions),
            remarks={
                now: self.remarks[before]
                for now, before in enumerate(positions.tolist())
                if before in self.remarks
            },
        )

    def take(self, positions: Sequence[int] | NDArray[np.int64]) -> Iterator[Place]:
        """Some of the places."""
        at = np.asarray(positions, dtype=np.int64)
        own = self.own.take(at).to_pylist() if self.own.num_columns else [{}] * len(at)
        said = self.settings.take(at).to_pylist() if self.settings.num_columns else [{}] * len(at)
        for one, mine, its in zip(at.tolist(), own, said, strict=True):
            outline = None if self.outlines is None else self.outlines[one].as_py()
            yield Place(
                int(self.rows[one]),
                self.ids[one].as_py(),
                self.names[one].as_py(),
                float(self.lat[one]),
                float(self.lon[one]),
                outline,
                self.crs.srs if outline is not None else "",
                tuple((k, v) for k, v in mine.items() if not missing(v)),
                {k: v for k, v in its.items() if not missing(v)},
                (self.remarks[one],) if one in self.remarks else (),
            )

    def __iter__(self) -> Iterator[Place]:
        return self.take(np.arange(len(self)))

    def order(self) -> NDArray[np.int64]:
        """Positions along a space-filling curve (Hilbert's): neighbours beside each other."""
        known = self.known
        far = np.full(len(self), np.iinfo(np.int64).max)
        if known.any():
            points = gpd.GeoSeries(gpd.points_from_xy(self.lon[known], self.lat[known]))
            west, south, east, north = points.total_bounds
            # A square that is never a point.
            side = max(east - west, north - south, 1e-6)
            frame = (west, south, west + side, south + side)
            far[known] = points.hilbert_distance(frame, level=16).to_numpy(dtype=np.int64)
        return np.argsort(far, kind="stable")


def overlaps(places: Places) -> dict[int, str]:
    """What is to be told of parcels that overlap others, by position.

    More than a hundred thousand are compared in parts.
    """
    if places.outlines is None:
        return {}
    told: dict[int, list[str]] = {}
    order = places.order()
    for begin in range(0, len(order), _AT_A_TIME):
        at = order[begin : begin + _AT_A_TIME]
        shapes = shapely.from_wkb(places.outlines.take(at).to_numpy(zero_copy_only=False))
        valid = np.where(shapely.is_valid(shapes), shapes, None)
        one, other = shapely.STRtree(valid).query(valid, predicate="intersects")
        pairs = one < other
        one, other = one[pairs], other[pairs]
        # Neighbours share borders; only what shares ground costs an intersection.
        ground = ~shapely.touches(valid[one], valid[other])
        one, other = one[ground], other[ground]
        shared = shapely.intersection(valid[one], valid[other])
        for a, b, area in zip(one, other, areas_anywhere_m2(shared, places.crs), strict=True):
            if area > _LEAST_M2:
                for mine, its in ((at[a], at[b]), (at[b], at[a])):
                    words = f"overlaps {places.names[its].as_py()} by {area / 10_000.0:.2f} ha"
                    told.setdefault(int(mine), []).append(words)
    return {at: "; ".join(sorted(words)) for at, words in sorted(told.items())}
