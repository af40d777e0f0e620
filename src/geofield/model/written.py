"""What the software last wrote of the obstacles: the measure of what a person changed since.

Every stage leaves such a record in its plan, and a file carries it beside the table. A row
that differs from its record was changed by a person; a row that is missing was deleted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from pyproj import CRS

from geofield.crs import LONLAT, reproject, transformer
from geofield.model.obstacles import (
    circle_polygons,
    floats,
    last_number,
    next_number,
    plain_circles,
    still_round,
)

if TYPE_CHECKING:
    import geopandas as gpd

#: A shape farther than this from the one that was written was changed by a person, metres: of 1143
#: CRS of EPSG there and back loses more than 1 mm in 81, up to 12 mm where datums are turned.
SAME_M = 0.02
#: What is farther than this from a circle is recorded as drawn, and what is smaller, metres.
_ROUND_M = 0.0005
#: Of coordinates in a record.
DECIMALS = 4
_WORDS = ("kind", "status")

#: A shape in plain values: centre x, y and radius of a circle, or WKT; in units of the CRS.
PlainShape = tuple[float, float, float] | str


class WrittenRow(NamedTuple):
    """One obstacle as it was written."""

    obstacle_no: int
    kind: str | None
    status: str | None
    radius_m: float | None
    buffer_m: float | None
    #: Whether it is a person's word, which no detection changes.
    kept: bool
    #: Its buffer, in the plan's metric CRS.
    shape: PlainShape


#: What was written, by number.
Record = Mapping[int, WrittenRow]


@dataclass(frozen=True, slots=True)
class Written:
    """The obstacles as they were written, and what a person took away."""

    rows: tuple[WrittenRow, ...] = ()
    #: Where a person deleted an obstacle, or moved it away from: nothing is found there again.
    removed: tuple[PlainShape, ...] = ()
    #: The highest number that an obstacle ever had: none is given a second time.
    last_no: int = 0

    @classmethod
    def of(
        cls,
        obstacles: gpd.GeoDataFrame,
        kept: ArrayLike,
        removed: Sequence[PlainShape] = (),
        last_no: int = 0,
    ) -> Written:
        """The record of a table in which every row has a number; a person's word is `kept`."""
        radius, margin = floats(obstacles, "radius_m"), floats(obstacles, "buffer_m")
        shapes = plain(obstacles.geometry.array)
        words = ([_word(each) for each in obstacles[column]] for column in _WORDS)
        numbers, kept = obstacles["obstacle_no"].tolist(), np.asarray(kept, bool)
        rows = zip(numbers, *words, radius, margin, kept, shapes, strict=True)
        return cls(
            tuple(
                WrittenRow(int(no), kind, status, _number(r), _number(m), bool(k), shape)
                for no, kind, status, r, m, k, shape in rows
            ),
            tuple(dict.fromkeys(removed)),
            max(last_no, last_number(numbers)),
        )

    @property
    def by_number(self) -> dict[int, WrittenRow]:
        """The rows by their obstacles' numbers."""
        return {row.obstacle_no: row for row in self.rows}

    def since(self, before: Written) -> str:
        """What a person said of obstacles since they were as `before`, in words."""
        now, then = self.by_number, before.by_number
        changed = sum(number in then and row != then[number] for number, row in now.items())
        counts = (
            (changed, "changed"),
            (len(now.keys() - then), "drawn"),
            (len(then.keys() - now), "taken away"),
        )
        words = [f"{count} {what}" for count, what in counts if count]
        return f"obstacles: {', '.join(words)}" if words else ""

    def reprojected(self, source: CRS, target: CRS) -> Written:
        """The same in another metric CRS."""
        if source == target:
            return self
        rows = [row._replace(shape=_moved(row.shape, source, target)) for row in self.rows]
        removed = tuple(_moved(each, source, target) for each in self.removed)
        return replace(self, rows=tuple(rows), removed=removed)

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values; see :meth:`from_json`."""
        return {
            "rows": [[*row[:-1], listed(row.shape)] for row in self.rows],
            "removed": [listed(shape) for shape in self.removed],
            "last_no": self.last_no,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Written:
        """The record that was written with :meth:`to_json`."""
        rows = tuple(
            WrittenRow._make((number, _word(kind), _word(status), *rest, unlisted(shape)))
            for number, kind, status, *rest, shape in value["rows"]
        )
        # Earlier versions wrote no last number.
        last_no = value.get("last_no") or last_number([row.obstacle_no for row in rows])
        return cls(rows, tuple(unlisted(shape) for shape in value["removed"]), last_no)


def free_number(obstacles: gpd.GeoDataFrame | None, written: Written | None) -> int:
    """The number of the next obstacle, which none has or had: it would not be missed."""
    next_no = 1 if obstacles is None else next_number(obstacles)
    return next_no if written is None else max(next_no, written.last_no + 1)


def from_earlier_version(obstacles: gpd.GeoDataFrame) -> Written:
    """The record of a table that was written without one.

    Detected circles are known by their own columns; of other rows nobody can tell what was
    changed.
    """
    radius = floats(obstacles, "radius_m")
    total = radius + np.nan_to_num(floats(obstacles, "buffer_m"))
    number = obstacles["obstacle_no"]
    told = (
        (obstacles["status"] == "detected").to_numpy(bool)
        & (number.notna() & ~number.duplicated()).to_numpy(bool)
        & np.isfinite(total + floats(obstacles, "lat") + floats(obstacles, "lon"))
    )
    if not told.any():
        return Written()
    table = obstacles[told]
    x, y = transformer(LONLAT, CRS(table.crs)).transform(
        table["lon"].to_numpy(), table["lat"].to_numpy()
    )
    circles = circle_polygons(x, y, total[told], CRS(table.crs))
    drawn = np.asarray(table.geometry.to_numpy(), dtype=object)
    # The columns are rounded in some formats: what is near enough is as it was.
    near = shapely.hausdorff_distance(drawn, circles) <= 2 * SAME_M
    shapes = np.where(near, drawn, circles)
    return Written.of(table.set_geometry(shapes, crs=table.crs), np.zeros(len(table), bool))


def plain(geometry: Any) -> list[PlainShape]:
    """Shapes in plain values: circles by centre and radius, others as WKT."""
    geometry = np.asarray(geometry, dtype=object)
    fitted = fitted_circles(geometry)
    result: list[PlainShape] = [
        str(text) for text in shapely.to_wkt(geometry, rounding_precision=DECIMALS)
    ]
    # Of nothing but its centre a circle would be empty.
    rows = np.flatnonzero(still_round(geometry, fitted[:, 2]) & (fitted[:, 2] > 2 * _ROUND_M))
    # Some are round enough to be driven around as circles, but were drawn as they are.
    rows = rows[same_shapes(plain_circles(*fitted[rows].T), geometry[rows], _ROUND_M)]
    for row, (x, y, radius) in zip(rows, fitted[rows].round(DECIMALS).tolist(), strict=True):
        result[row] = (x, y, radius)
    return result


def fitted_circles(geometry: Any) -> NDArray[np.float64]:
    """Centre x, y and mean distance of the vertices from it, of each polygon (n, 3)."""
    geometry = np.asarray(geometry, dtype=object)
    centre = shapely.get_coordinates(shapely.centroid(geometry))
    xy, row = shapely.get_coordinates(geometry, return_index=True)
    away = np.hypot(*(xy - centre[row]).T)
    count = np.bincount(row, minlength=len(geometry))
    return np.column_stack([centre, np.bincount(row, away, minlength=len(geometry)) / count])


def shapes_of_plain(shapes: Sequence[PlainShape]) -> NDArray[np.object_]:
    """The polygons of plain shapes."""
    result = np.empty(len(shapes), dtype=object)
    round_ones = [i for i, shape in enumerate(shapes) if not isinstance(shape, str)]
    if round_ones:
        result[round_ones] = plain_circles(*np.array([shapes[i] for i in round_ones], float).T)
    for i, shape in enumerate(shapes):
        if isinstance(shape, str):
            result[i] = shapely.from_wkt(shape)
    return result


def same_shapes(one: Any, other: Any, tolerance_m: float = SAME_M) -> NDArray[np.bool_]:
    """Whether shapes are the same, however an editor arranged their rings and parts."""
    one, other = np.asarray(one, dtype=object), np.asarray(other, dtype=object)
    result = np.asarray(shapely.equals_exact(one, other, tolerance=tolerance_m), dtype=bool)
    rest = np.flatnonzero(~result)
    # Most are the same places in another order: to measure how far lines are apart takes 50 times
    # as long, and is needed where their number is another one.
    ordered = shapely.normalize(one[rest]), shapely.normalize(other[rest])
    result[rest] = shapely.equals_exact(*ordered, tolerance=tolerance_m)
    rest = rest[~result[rest]]
    gained = np.abs(shapely.area(one[rest]) - shapely.area(other[rest]))
    rest = rest[gained <= tolerance_m * shapely.length(one[rest])]
    result[rest] = shapely.hausdorff_distance(one[rest], other[rest]) <= tolerance_m
    return result


def matches(
    shapes: Any,
    others: Any,
    *,
    once: bool = False,
    apart: Callable[[NDArray[np.intp], NDArray[np.intp]], NDArray[np.bool_]] | None = None,
) -> NDArray[np.int64]:
    """For each shape the nearest other that is the same object, by position; -1 for none.

    Two shapes are the same object when the centre of one lies in the other; that of a bent shape
    is a point in it. With `once` the nearest pairs come first, and no other is two shapes' match;
    `apart` tells of pairs, by position, which are two objects anyway.
    """
    mine, theirs = np.asarray(shapes, dtype=object), np.asarray(others, dtype=object)
    result = np.full(len(mine), -1, dtype=np.int64)
    rows, candidates = shapely.STRtree(theirs).query(mine, predicate="intersects")
    centre, other = _middles(mine)[rows], _middles(theirs)[candidates]
    same = shapely.intersects(centre, theirs[candidates]) | shapely.intersects(other, mine[rows])
    if apart is not None:
        same &= ~apart(rows, candidates)
    distance = shapely.distance(centre, other)
    met = np.zeros(len(theirs), dtype=bool)
    for index in np.argsort(distance, kind="stable"):
        row, candidate = rows[index], candidates[index]
        if same[index] and result[row] < 0 and not (once and met[candidate]):
            result[row], met[candidate] = candidate, True
    return result


def _middles(shapes: NDArray[np.object_]) -> NDArray[np.object_]:
    centre = shapely.centroid(shapes)
    return np.where(shapely.intersects(centre, shapes), centre, shapely.point_on_surface(shapes))


def _moved(shape: PlainShape, source: CRS, target: CRS) -> PlainShape:
    if not isinstance(shape, str):
        x, y = transformer(source, target).transform(shape[0], shape[1])
        return (round(x, DECIMALS), round(y, DECIMALS), shape[2])
    moved = reproject(shapely.from_wkt(shape), source, target)
    return str(shapely.to_wkt(moved, rounding_precision=DECIMALS))


def _word(value: Any) -> str | None:
    """A word; None also for the NaN that earlier versions wrote where there was none."""
    return value if isinstance(value, str) else None


def _number(value: float) -> float | None:
    return None if np.isnan(value) else round(float(value), 6)


def listed(shape: PlainShape) -> list[float] | str:
    """A shape as JSON has it."""
    return shape if isinstance(shape, str) else list(shape)


def unlisted(shape: Any) -> PlainShape:
    """A shape of JSON."""
    return shape if isinstance(shape, str) else (shape[0], shape[1], shape[2])
