"""The working frame of a field's tracks: u along the tracks, v across them, near the origin.

Coordinates of a metric CRS are large (a northing needs 23 bits before the metre), and rotating
them as they are costs about 1e-9 m; and its unit is not quite a metre on the ground. All computing
is therefore done in a frame whose origin lies in the field and whose unit is the metre there; only
finished ends are carried back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TrackFrame:
    """Origin and axes of a field's tracks."""

    #: origin_x_m, origin_y_m: origin in the metric CRS.
    origin_x_m: float
    origin_y_m: float
    #: along_x, along_y: unit vector of the tracks (the axis u), in the CRS.
    along_x: float
    along_y: float
    #: across_x, across_y: unit vector from one track to the next (the axis v): perpendicular to u,
    #: on either side.
    across_x: float
    across_y: float
    #: Units of the CRS per metre on the ground (`geofield.crs.ground_scale`).
    scale: float = 1.0

    @classmethod
    def of(
        cls,
        origin: tuple[float, float],
        along: tuple[float, float],
        *,
        left: bool = False,
        scale: float = 1.0,
    ) -> TrackFrame:
        """Make a frame from an origin in the metric CRS and a direction of any length but zero.

        The origin is rounded to whole metres, so that subtracting it is exact. `left` says that v
        points to the left of the direction instead of to the right; `scale` is that of the frame.
        """
        length = float(np.hypot(*along))
        ux, uy = along[0] / length, along[1] / length
        side = -1.0 if left else 1.0
        x, y = (float(np.rint(value)) for value in origin)
        return cls(x, y, ux, uy, side * uy, -side * ux, scale)

    def to_frame(self, x: Any, y: Any) -> tuple[FloatArray, FloatArray]:
        """Carry CRS coordinates into the frame: (u, v) in ground metres."""
        dx = (np.asarray(x, dtype=np.float64) - self.origin_x_m) / self.scale
        dy = (np.asarray(y, dtype=np.float64) - self.origin_y_m) / self.scale
        return (
            dx * self.along_x + dy * self.along_y,
            dx * self.across_x + dy * self.across_y,
        )

    def to_crs(self, u: Any, v: Any) -> tuple[FloatArray, FloatArray]:
        """Carry frame coordinates back to the CRS: (x, y) in its units."""
        u = np.asarray(u, dtype=np.float64) * self.scale
        v = np.asarray(v, dtype=np.float64) * self.scale
        return (
            self.origin_x_m + (u * self.along_x + v * self.across_x),
            self.origin_y_m + (u * self.along_y + v * self.across_y),
        )


def true_heading_deg(along: tuple[float, float], grid_north: float) -> float:
    """The true heading of a direction in the CRS, 0 <= heading < 180."""
    heading = (math.degrees(math.atan2(along[0], along[1])) + grid_north) % 180.0
    return 0.0 if heading >= 180.0 else heading
