"""The field's outline as the planner takes it: one valid, flat polygon in a metric CRS."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import shapely
from pyproj import CRS
from shapely import MultiPolygon, Polygon
from shapely.errors import ShapelyError
from shapely.geometry.base import BaseGeometry

from geofield.crossings import in_words, largest_part, mended
from geofield.crs import authority_name, is_metric, parse_crs
from geofield.errors import CRSError, TrackError, refuse_no_number
from geofield.finite import MEND_IT

#: A place given for a field is not farther from it, metres.
NEAR_M = 20_000.0


def metric(crs: Any) -> CRS:
    """Parse a CRS and refuse one that is not in true ground metres.

    Raises
    ------
    CRSError
    """
    parsed = parse_crs(crs)
    if not is_metric(parsed):
        raise CRSError(
            f"Tracks are planned in metres; {authority_name(parsed)} is not a metric CRS.",
            hint="Reproject to the UTM zone: GeoSeries.to_crs(series.estimate_utm_crs()).",
        )
    return parsed


def refuse_no_shape(polygon: Any) -> None:
    """Refuse what is no geometry, before its CRS is asked for: a table has one, but of its own."""
    if not isinstance(polygon, BaseGeometry):
        raise TrackError(
            f"The field must be a shapely polygon, not {type(polygon).__name__}.",
            hint="Give a shapely polygon with its CRS, or a geofield Field.",
        )


def refuse_no_length(*, none_too: bool = False, **lengths_m: Any) -> None:
    """Refuse arguments, by their names, that are no lengths; `none_too` lets 0 pass.

    Raises
    ------
    TrackError
    """
    least = "0 or more metres" if none_too else "more than 0 metres"
    refuse_no_number(TrackError, least, **lengths_m)
    for name, value in lengths_m.items():
        if value < 0.0 or (value == 0.0 and not none_too):
            raise TrackError(f"{name} is {value!r}; it must be a number, {least}.")


def refuse_wide_turns(bounds_m: Iterable[float], radius_m: float, margin_m: float) -> None:
    """Refuse a turning radius that is larger than a field of these bounds, metres on the ground."""
    refuse_no_length(turning_radius_m=radius_m)
    left, bottom, right, top = bounds_m
    size = math.hypot(right - left, top - bottom) + 2.0 * margin_m
    if 2.0 * radius_m > size:
        raise TrackError(
            f"A turning radius of {radius_m:g} m is larger than the field ({size:.0f} m across): "
            "no turn fits.",
            hint="Give the radius in metres, or leave it out for a route without curves.",
        )


def clean_outline(polygon: Any) -> tuple[Polygon, tuple[str, ...]]:
    """Check a field's outline, and repair what can be repaired without a guess.

    Heights are dropped; an invalid outline is repaired where one part keeps at least 99 % of the
    area; a multi-polygon of one part is that part. The polygon returned is valid, 2D and counter-
    clockwise; the texts say what was changed, for people.

    Raises
    ------
    TrackError
        When the outline is empty, no polygon, has several parts or cannot be repaired.
    CRSError
        When the coordinates are degrees.
    """
    notes: list[str] = []
    refuse_no_shape(polygon)
    if polygon.is_empty:
        raise TrackError("The field's outline is empty.")
    if polygon.has_z:
        polygon = shapely.force_2d(polygon)
        notes.append("Heights of the field's outline were dropped.")
    if not np.isfinite(shapely.get_coordinates(polygon)).all():
        raise TrackError(
            "The field's outline has coordinates that are not finite numbers.", hint=MEND_IT
        )
    if not isinstance(polygon, Polygon | MultiPolygon):
        raise TrackError(
            f"The field's outline must be a polygon, not a {polygon.geom_type}.",
            hint="Close it where it begins (QGIS: Lines to polygons).",
        )
    _refuse_degrees(polygon)
    if not polygon.is_valid:
        reason = shapely.is_valid_reason(polygon)
        polygon, sizes = _sound(polygon, reason)
        notes.append(f"The field's outline was repaired ({reason}): {sizes}.")
    parts = [part for part in shapely.get_parts(polygon) if part.area > 0.0]
    if not parts:
        raise TrackError("The field's outline has no area.")
    if len(parts) > 1:
        raise TrackError(
            f"The field's outline has {len(parts)} parts.",
            hint="Plan each part as its own field: GeoDataFrame.explode().",
        )
    return shapely.orient_polygons(parts[0]), tuple(notes)


def _sound(polygon: BaseGeometry, reason: str) -> tuple[BaseGeometry, str]:
    """What an outline that crosses itself was meant to be, and how much is kept, in words."""
    repaired, left_m2 = largest_part(mended(polygon, "structure"))
    if not isinstance(repaired, Polygon):
        areas = sorted(shapely.area(shapely.get_parts(repaired)), reverse=True)
        sizes = ", ".join(f"{area / 10_000.0:.2f}" for area in areas[:5] if area)
        raise TrackError(
            f"The field's outline is not valid and cannot be repaired without a guess: {reason}."
            + (f" Its parts have {sizes} ha." if sizes else ""),
            hint="Repair it by hand, or with Fix geometries in QGIS.",
        )
    return repaired, in_words(repaired.area, left_m2)


def near(outline: BaseGeometry, x: float, y: float) -> bool:
    """Whether a place may be meant for a field; what is not finite is not."""
    return bool(np.isfinite([x, y]).all() and outline.distance(shapely.Point(x, y)) < NEAR_M)


def place_near(outline: BaseGeometry, place: Any, what: str) -> tuple[float, float]:
    """A place in the field's CRS, given as two numbers or a shapely point.

    Raises
    ------
    TrackError
        When it is none, or far from the field, as degrees are that stand for metres.
    """
    try:
        x, y = (float(c) for c in ((place.x, place.y) if hasattr(place, "x") else place))
    except (TypeError, ValueError, ShapelyError) as error:
        raise TrackError(
            f"The {what} is not two numbers: {place!r}.",
            hint="Give x and y in the field's CRS, or a shapely point.",
        ) from error
    if not near(outline, x, y):
        raise TrackError(
            f"The {what} at x {x:.10g}, y {y:.10g} is far from the field.",
            hint="Give it in the field's CRS: metres, not degrees.",
        )
    return x, y


def in_degrees(bounds: Any, outline: BaseGeometry) -> bool:
    """Whether bounds look like degrees, in any order, beside an outline that is in metres."""
    return bool((np.abs(bounds) <= 180.0).all()) and not outline.intersects(
        shapely.box(-180.0, -180.0, 180.0, 180.0)
    )


def _refuse_degrees(polygon: BaseGeometry) -> None:
    x0, y0, x1, y1 = polygon.bounds
    degrees = max(abs(x0), abs(x1)) <= 180.0 and max(abs(y0), abs(y1)) <= 90.0
    if degrees and max(x1 - x0, y1 - y0) < 1.0:
        raise CRSError(
            f"The field is {x1 - x0:.4f} by {y1 - y0:.4f} m large and near (0, 0): its "
            "coordinates look like degrees, not metres.",
            hint="Reproject to the UTM zone: GeoSeries.to_crs(series.estimate_utm_crs()).",
        )
