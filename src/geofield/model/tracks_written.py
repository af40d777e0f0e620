"""The tracks as the planner left them: the measure of what a person changed since."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from geofield import schema
from geofield.angles import apart_deg
from geofield.model.written import SAME_M

if TYPE_CHECKING:
    import geopandas as gpd

#: Places are told to the millimetre.
DECIMALS = 3
#: How far a line may turn away from a track that it is of, degrees.
_TURNED_DEG = 20.0

#: The vertices of a line, (n, 2), metric CRS.
Vertices = NDArray[np.float64]


class Place(NamedTuple):
    """A line of a layout: a point on it beside the field's middle, and how the layout runs."""

    x: float
    y: float
    heading_deg: float
    spacing_m: float


@dataclass(frozen=True)
class TracksWritten:
    """The segments of planned tracks.

    Attributes
    ----------
    heading_deg, spacing_m : float
        Of the layout.
    middle : (int, int)
        From where vertices count, metric CRS; beside it lies the place of a line.
    rows : list of list of int
        Of each segment its track's number and its vertices x, y, ..., millimetres.
    """

    heading_deg: float
    spacing_m: float
    middle: tuple[int, int]
    rows: list[list[int]]

    @classmethod
    def of(
        cls,
        track_no: Any,
        lines: Any,
        *,
        heading_deg: float,
        spacing_m: float,
        middle: tuple[float, float],
    ) -> TracksWritten:
        """The record of segments, by the numbers of their tracks."""
        at = round(middle[0]), round(middle[1])
        lines = np.asarray(lines, dtype=object)
        number = np.asarray(track_no, dtype=np.int64)
        flat = np.rint((shapely.get_coordinates(lines) - at) * 1000.0).astype(np.int64)
        count = shapely.get_num_coordinates(lines)
        if (count == 2).all():
            rows = np.column_stack((number, flat.reshape(-1, 4))).tolist()
        else:
            parts = np.split(flat, np.cumsum(count)[:-1])
            rows = [
                [no, *part.ravel().tolist()]
                for no, part in zip(number.tolist(), parts, strict=True)
            ]
        return cls(heading_deg, spacing_m, at, rows)

    @cached_property
    def segments(self) -> dict[int, list[Vertices]]:
        """The segments' vertices by track number, metric CRS."""
        found: dict[int, list[Vertices]] = {}
        for no, *flat in self.rows:
            found.setdefault(no, []).append(np.array(flat).reshape(-1, 2) / 1000.0 + self.middle)
        return found

    def are(self, lines: gpd.GeoDataFrame, segments: gpd.GeoDataFrame) -> bool:
        """Whether both layers are as they were written, their rows in the same order.

        Columns of a person's own are looked at anew.
        """
        if schema.own_columns(schema.TRACKS, lines):
            return False
        numbers = [row[0] for row in self.rows]
        if numbers != track_numbers(segments):
            return False
        if list(dict.fromkeys(numbers)) != track_numbers(lines):
            return False
        flat = np.array([value for row in self.rows for value in row[1:]], dtype=np.float64)
        written = flat.reshape(-1, 2) / 1000.0 + self.middle
        for table in (lines, segments):
            now = shapely.get_coordinates(table.geometry.to_numpy())
            if now.shape != written.shape or (np.abs(now - written) > SAME_M).any():
                return False
        return True

    def place(self, track_no: int) -> Place | None:
        """Where the line of a track runs; None where it has no length."""
        both = np.concatenate(self.segments[track_no])
        start, way = both[0], both[-1] - both[0]
        length = float(np.hypot(*way))
        if length == 0.0:
            return None
        along = way / length
        x, y = start + ((np.array(self.middle) - start) @ along) * along
        at = round(float(x), DECIMALS), round(float(y), DECIMALS)
        return Place(*at, self.heading_deg, self.spacing_m)

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values; see :meth:`from_json`."""
        return {
            "heading_deg": self.heading_deg,
            "spacing_m": self.spacing_m,
            "middle": list(self.middle),
            "segments_mm": self.rows,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> TracksWritten:
        """The record that was written with :meth:`to_json`."""
        x, y = value["middle"]
        layout = float(value["heading_deg"]), float(value["spacing_m"])
        return cls(*layout, (int(x), int(y)), value["segments_mm"])


def track_numbers(rows: gpd.GeoDataFrame) -> list[int]:
    """The track numbers of rows, 0 where there is none."""
    numbers = rows["track_no"].to_numpy("float64", na_value=np.nan)
    return [int(no) for no in np.nan_to_num(numbers)]


def among(one: Vertices, others: Sequence[Vertices]) -> bool:
    """Whether a line is one of some others, its direction the same."""
    return any(
        one.shape == other.shape and bool(np.abs(one - other).max() <= SAME_M) for other in others
    )


def as_text(lines: Any) -> str:
    """Lines as WKT, to the millimetre."""
    return str(shapely.to_wkt(lines, rounding_precision=DECIMALS))


def run_alike(lines: NDArray[np.object_], others: NDArray[np.object_]) -> NDArray[np.bool_]:
    """Whether lines run, one way or back, as others do, from their begin to their end."""
    turned = apart_deg(_heading_deg(lines), _heading_deg(others))
    return np.asarray(turned <= _TURNED_DEG)


def _heading_deg(lines: NDArray[np.object_]) -> NDArray[np.float64]:
    # An editor may have made a line of several parts of one.
    first, last = shapely.get_geometry(lines, 0), shapely.get_geometry(lines, -1)
    begin = shapely.get_coordinates(shapely.get_point(first, 0))
    end = shapely.get_coordinates(shapely.get_point(last, -1))
    x, y = (end - begin).T
    return np.asarray(np.degrees(np.arctan2(y, x)), np.float64)
