"""The headland: the strip along the border where the machine turns, with its own tracks."""

from __future__ import annotations

import numpy as np
import shapely
from pyproj import CRS
from shapely import MultiLineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from geofield import schema
from geofield.errors import TrackError
from geofield.model.obstacles import QUARTER_SEGMENTS, ObstacleShapes, polygons_around
from geofield.model.rows import Rows
from geofield.model.track_statistics import MITRE_LIMIT, SHARED_EDGE_M

_MIN_PIECE_M = 1e-3
#: A border is moved without what stands out less than this: where many vertices lie closer than
#: GEOS rounds a buffer, it takes up to 15 times longer over them.
_STANDS_OUT_M = 1e-3
#: At some widths GEOS loses whole parts of a mitred border (libgeos/geos#1047), and not at others
#: as near: what is moved farther leaves less, so that the largest of these is whole.
_FARTHER_M = np.array([0.0, 1e-4, 2e-4])
#: What a headland is wider than its passes is not worth a word below this.
_REST_M = 0.05
#: No machine drives as many passes around a field; they take seconds by the thousand.
_MOST_PASSES = 1000


def inset(outline: Polygon, width: float, *, holes: bool = False) -> BaseGeometry:
    """Move the border inwards by a width in units of the outline's CRS, metres nearly.

    With `holes` the strip runs around them too; otherwise they stay as they are. Empty where the
    field is nowhere wider than twice the width.
    """
    # Corners depend a little on the vertex that GEOS begins at: it passes over others beside it.
    moved = shapely.normalize(outline if holes else Polygon(outline.exterior))
    plain = shapely.simplify(moved, _STANDS_OUT_M, preserve_topology=False)
    tried = shapely.buffer(
        plain if plain.is_valid and not plain.is_empty else moved,
        -width - _FARTHER_M,
        join_style="mitre",
        mitre_limit=MITRE_LIMIT,
    )
    inner: BaseGeometry = tried[np.argmax(shapely.area(tried))]
    return inner if holes or not outline.interiors else shapely.intersection(inner, outline)


def main_area(
    outline: Polygon, width_m: float, *, scale: float, holes: bool = False
) -> BaseGeometry:
    """The field without its headland: what straight tracks are laid in.

    The width is in metres on the ground, of which one has `scale` units of the outline's CRS.

    Raises
    ------
    TrackError
        When nothing is left.
    """
    inner = inset(outline, width_m * scale, holes=holes)
    parts = [p for p in shapely.get_parts(inner) if isinstance(p, Polygon) and p.area > 0.0]
    if not parts:
        raise TrackError(
            f"A headland of {width_m:g} m leaves nothing of the field.",
            hint="Choose a narrower headland.",
        )
    return parts[0] if len(parts) == 1 else MultiPolygon(parts)


def headland_table(
    outline: Polygon, inner: BaseGeometry, width_m: float, *, crs: CRS, scale: float
) -> Rows:
    """Layer `headland`: the field less its main area, one row.

    Raises
    ------
    TrackError
        When it has no area.
    """
    # Along a hole they share an edge: without the grid a spike would be left there.
    strip = shapely.difference(outline, inner, grid_size=SHARED_EDGE_M)
    parts = [p for p in shapely.get_parts(strip) if isinstance(p, Polygon) and p.area > 0.0]
    if not parts:
        raise TrackError(
            f"A headland of {width_m:g} m is too narrow to be one.",
            hint="Choose a wider headland, or none: --headland 0.",
        )
    return Rows(
        schema.HEADLAND,
        {
            "headland_no": np.array([1]),
            "width_m": [width_m],
            "area_ha": [sum(p.area for p in parts) / scale**2 / 10_000.0],
        },
        # As files hold it: a plan read back is then the same.
        [shapely.orient_polygons(MultiPolygon(parts))],
        crs,
    )


def headland_track_table(
    outline: Polygon,
    shapes: ObstacleShapes,
    *,
    width_m: float,
    spacing_m: float,
    first_m: float,
    crs: CRS,
    scale: float,
    holes: bool = False,
) -> Rows:
    """Layer `headland_tracks`: rings `first_m` from the border and every spacing inwards.

    As many as fit the headland (at least one), cut where obstacles stand. A ring that nothing
    cuts stays closed.
    """
    passes = _passes(width_m, spacing_m)
    if passes > _MOST_PASSES:
        raise TrackError(
            f"A headland of {width_m:g} m would take {passes:,} passes of {spacing_m:.3g} m; "
            f"{_MOST_PASSES:,} are the most.",
            hint="Give the spacing in metres, for instance 3, or a narrower headland.",
        )
    # In a headland narrower than half the machine, too, that stays within the border.
    last_m = max(first_m, width_m)
    offsets_m = [min(first_m + index * spacing_m, last_m) for index in range(passes)]
    # Not along holes, where the strip does not run around them: they cut the rings.
    border = outline if holes else Polygon(outline.exterior)
    areas = [inset(border, offset_m * scale, holes=holes) for offset_m in offsets_m]
    # Side by side: to unite a thousand of them takes half a minute.
    borders = MultiLineString(shapely.get_parts(shapely.boundary(areas)).tolist())
    blocked = _blocked(shapes, borders)
    rows: list[tuple[int, int, float]] = []
    lines: list[BaseGeometry] = []
    for index, (offset, area) in enumerate(zip(offsets_m, areas, strict=True)):
        rings: list[BaseGeometry] = []
        for part in shapely.get_parts(area):
            rings.append(shapely.LineString(part.exterior.coords))
            if holes:
                rings.extend(shapely.LineString(ring.coords) for ring in part.interiors)
        number = 0
        for ring in rings:
            free = shapely.line_merge(shapely.difference(ring, blocked))
            if not holes:
                # A hole that reaches into the strip is no place to drive either.
                free = shapely.line_merge(shapely.intersection(free, outline))
            for piece in shapely.get_parts(free):
                if piece.geom_type == "LineString" and piece.length > _MIN_PIECE_M:
                    number += 1
                    rows.append((index + 1, number, offset))
                    lines.append(piece)
    columns = np.array(rows).reshape(-1, 3)
    return Rows(
        schema.HEADLAND_TRACKS,
        {
            "pass_no": columns[:, 0].astype(np.int64),
            "segment_no": columns[:, 1].astype(np.int64),
            "offset_m": columns[:, 2],
            "length_m": shapely.length(lines) / scale if lines else np.empty(0),
        },
        lines,
        crs,
    )


def unworked_note(width_m: float, spacing_m: float, overlap_m: float) -> tuple[str, ...]:
    """That a strip between the last pass and the straight tracks stays unworked, where one does."""
    passes = _passes(width_m, spacing_m)
    rest_m = width_m - passes * spacing_m - max(0.0, overlap_m)
    if rest_m < _REST_M:
        return ()
    many = f"{passes} passes" if passes > 1 else "one pass"
    return (
        f"A headland of {width_m:g} m takes {many} of {spacing_m:g} m and leaves a strip of "
        f"{rest_m:.2f} m unworked; {passes * spacing_m:g} m or {(passes + 1) * spacing_m:g} m "
        "would leave none.",
    )


def _passes(width_m: float, spacing_m: float) -> int:
    """How many passes a headland takes."""
    return max(1, int(np.floor(width_m / spacing_m + 1e-9)))


def _blocked(shapes: ObstacleShapes, rings: BaseGeometry) -> BaseGeometry:
    """Those obstacles that stand in the way of the rings, as one geometry."""
    shapely.prepare(rings)
    places = np.asarray(shapely.points(shapes.circles[:, :2]), dtype=object)
    radius = shapes.circles[:, 2]
    met = shapely.dwithin(rings, places, radius)  # type: ignore[call-overload]
    discs = polygons_around(shapes.circles[met], 2 * QUARTER_SEGMENTS)
    other = shapes.polygons[shapely.intersects(rings, shapes.polygons)]
    return shapely.union_all(np.concatenate((discs, other)))
