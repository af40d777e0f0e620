"""The picture's frame: where an outline runs along it, the field goes on outside."""

from __future__ import annotations

import numpy as np
import shapely
from pyproj import CRS
from shapely import LineString, Polygon

from geofield.crs import ground_scale_of
from geofield.grid import Grid

#: An outline this near to the frame goes on outside, pixels.
NEAR_PX = 1.5


def picture_frame(grid: Grid, crs: CRS) -> Polygon:
    """The four sides of a picture, in a CRS."""
    w, h = grid.width_px, grid.height_px
    x, y = grid.to_crs([0.0, w, w, 0.0], [0.0, 0.0, h, h], crs)
    return Polygon(np.column_stack([x, y]))


def along_frame(polygon: Polygon, crs: CRS, grid: Grid | None) -> list[LineString]:
    """The stretches of an outline that are the picture's frame; none without a picture."""
    if grid is None:
        return []
    near = NEAR_PX * grid.ground_resolution_m * float(ground_scale_of(polygon, crs))
    inside = picture_frame(grid, crs)
    strip = shapely.buffer(inside.exterior, near)
    along = shapely.line_merge(shapely.intersection(polygon.exterior, strip))
    return [
        line
        for line in shapely.get_parts(along)
        if shapely.length(line) > 2 * near and not _crosses(line, inside, near)
    ]


def _crosses(line: LineString, picture: Polygon, near: float) -> bool:
    """Whether a short stretch only leads out of a picture."""
    first, last = (picture.contains(shapely.Point(line.coords[at])) for at in (0, -1))
    return first != last and line.length < 12 * near


def with_outside(
    doubts: tuple[str, ...], polygon: Polygon, along: list[LineString]
) -> tuple[str, ...]:
    """Doubts of an outline, and that it goes on outside where it is :func:`along_frame`."""
    if not along or any("outside the picture" in reason for reason in doubts):
        return doubts
    share = sum(line.length for line in along) / polygon.exterior.length
    return (*doubts, outside_in_words(share))


def outside_in_words(share: float) -> str:
    """What speaks against an outline of which a share is the picture's frame."""
    text = f"{share:.0%}" if share >= 0.01 else "a part"
    return f"it goes on outside the picture: {text} of the outline is the picture's edge"
