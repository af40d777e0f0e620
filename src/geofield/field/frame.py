"""Frame: where a searched picture ends, at its sides or before them, where its data do.

There an outline ends because the picture does: no figure takes that for a border of the field.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon
from shapely.affinity import scale

from geofield.model import Scene

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

#: How far the end of data is straightened, pixels.
_SMOOTH_PX = 3.0


@dataclass(frozen=True, eq=False)
class Frame:
    """Where a picture ends.

    Attributes
    ----------
    shape : (int, int)
        Rows and columns.
    shown : Polygon or None
        Where it has data, pixel coordinates; None where that is all of it. Gaps inside count as
        data: they repeat what is around them.
    """

    shape: tuple[int, int]
    shown: Polygon | None = None

    @classmethod
    def of(cls, scene: Scene, factor: int, seed_px: tuple[float, float], times: int) -> Frame:
        """Of a scene reduced by a factor, around a seed in its pixel coordinates.

        Parameters
        ----------
        times : int
            So many pixels of the scene were made along one that it came with: stairs are as wide.
        """
        rows, columns = (-(-length // factor) for length in scene.grid.shape)
        shown = scene.shown_px
        if shown is None or shown.is_empty:
            return cls((rows, columns))
        parts = [Polygon(part.exterior) for part in shapely.get_parts(shown)]
        seed = shapely.Point(seed_px[0] * factor, seed_px[1] * factor)
        around = parts[int(np.argmin(shapely.distance(parts, seed)))]
        reduced = scale(around, 1 / factor, 1 / factor, origin=(0, 0))
        # Outwards, where pixels repeat the ground: a ragged end is no crooked border.
        smooth_px = max(_SMOOTH_PX, times)
        smooth = reduced.buffer(smooth_px).simplify(smooth_px)
        within = shapely.get_parts(smooth.intersection(shapely.box(0, 0, columns, rows)))
        return cls((rows, columns), cast(Polygon, max(within, key=lambda part: part.area)))

    @cached_property
    def inside(self) -> BoolArray | None:
        """The pixels that show ground; None where all do."""
        if self.shown is None:
            return None
        return covered(shapely.get_coordinates(self.shown), self.shape) > 0

    def near(self, points: FloatArray, near_px: float) -> BoolArray:
        """Which points lie on it."""
        if self.shown is not None:
            away = shapely.distance(self.shown.exterior, shapely.points(points))
            return np.asarray(away < near_px)
        x, y = points.T
        rows, columns = self.shape
        away = np.minimum(np.minimum(x, columns - x), np.minimum(y, rows - y))
        return np.asarray(away < near_px)

    def onto(self, vertices: FloatArray, near_px: float) -> FloatArray:
        """Vertices of a ring with sides that run beside it put onto it."""
        onto = vertices.copy()
        if self.shown is not None:
            near = self.near(vertices, near_px)
            moved = near & (np.roll(near, 1) | np.roll(near, -1))
            line, points = self.shown.exterior, shapely.points(vertices[moved])
            there = shapely.line_interpolate_point(line, shapely.line_locate_point(line, points))
            onto[moved] = shapely.get_coordinates(there)
            return onto
        for axis, far in ((0, self.shape[1]), (1, self.shape[0])):
            for side in (0.0, float(far)):
                near = np.abs(vertices[:, axis] - side) < near_px
                onto[near & (np.roll(near, 1) | np.roll(near, -1)), axis] = side
        return onto

    def within(self, outlines: NDArray[np.object_]) -> NDArray[np.object_]:
        """Outlines, valid ones without holes, cut off where the picture ends."""
        if self.shown is None:
            return outlines
        pieces = shapely.get_parts(shapely.intersection(outlines, self.shown))
        pieces = pieces[shapely.get_dimensions(pieces) == 2]
        return np.asarray(shapely.polygons(shapely.get_exterior_ring(pieces)))


def covered(vertices: FloatArray, shape: tuple[int, int]) -> NDArray[np.uint8]:
    """The pixels with their centres in a polygon, given by its vertices (n, 2), as ones."""
    import cv2

    mask = np.zeros(shape, np.uint8)
    # OpenCV counts from pixel centres, in sixteenths.
    cv2.fillPoly(mask, [np.rint((vertices - 0.5) * 16).astype(np.int32)], 1, shift=4)
    return mask
