"""Where a picture ends, at its frame or where its data do: along it a field goes on outside."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry import shape
from shapely.geometry.base import BaseGeometry

from geofield.crs import ground_scale_of
from geofield.grid import Grid

Shown = Polygon | MultiPolygon

#: An outline this near to the picture's edge goes on outside, pixels.
NEAR_PX = 1.5
#: Missing data, or data among missing ones, on less ground than this are specks: no edge of the
#: picture, square metres and pixels.
_SPECK_M2 = 20.0
_SPECK_PX = 25


def shown_ground(valid: NDArray[np.bool_], pixel_m: float) -> Shown | None:
    """Where a picture has data, pixel coordinates; None where that is all of it.

    `valid` are its rows and columns, `pixel_m` is the side of a pixel on the ground, metres.
    """
    if valid.all():
        return None
    from rasterio.features import shapes, sieve

    speck_px = max(_SPECK_PX, round(_SPECK_M2 / pixel_m**2))
    # A sieve cannot be larger than what it sieves.
    data = sieve(valid.astype(np.uint8), min(speck_px, valid.size))
    if data.all():
        return None
    parts: list[Any] = [shape(one) for one, _ in shapes(data, data == 1)]
    # A slanting edge is a straight line, not its stairs.
    smooth: Shown = shapely.simplify(MultiPolygon(parts), 1.0)
    return smooth


def edge_strip(grid: Grid, crs: CRS, shown_px: Shown | None, near: float) -> BaseGeometry:
    """What lies near to the edge of a picture, in a CRS and its units."""
    return shapely.buffer(ground(grid, crs, shown_px).boundary, near, join_style="mitre")


def along_frame(
    polygon: Polygon, crs: CRS, grid: Grid | None, shown_px: Shown | None = None
) -> list[LineString]:
    """The stretches of an outline that are the picture's edge; none without a picture.

    `shown_px` is where the picture has data, its pixel coordinates; all of it when not given.
    """
    if grid is None:
        return []
    near = NEAR_PX * grid.ground_resolution_m * float(ground_scale_of(polygon, crs))
    return along_edge(polygon, ground(grid, crs, shown_px), near)


def along_edge(polygon: Polygon, shown: Shown, near: float) -> list[LineString]:
    """The stretches of an outline within a distance of where shown ground ends."""
    strip = shapely.buffer(shown.boundary, near)
    along = shapely.line_merge(shapely.intersection(polygon.exterior, strip))
    return [
        line
        for line in shapely.get_parts(along)
        if shapely.length(line) > 2 * near and not _crosses(line, shown, near)
    ]


def ground(grid: Grid, crs: CRS, shown_px: Shown | None) -> Shown:
    """What a picture shows, in a CRS."""
    if shown_px is None:
        w, h = grid.width_px, grid.height_px
        shown_px = Polygon([(0, 0), (w, 0), (w, h), (0, h)])
    return shapely.transform(
        shown_px, lambda xy: np.column_stack(grid.to_crs(xy[:, 0], xy[:, 1], crs))
    )


def _crosses(line: LineString, picture: Shown, near: float) -> bool:
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
    """What speaks against an outline of which a share is the picture's edge."""
    text = f"{share:.0%}" if share >= 0.01 else "a part"
    return f"it goes on outside the picture: {text} of the outline is the picture's edge"
