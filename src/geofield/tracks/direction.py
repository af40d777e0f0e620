"""Which way to drive: the baseline that a field's tracks are parallel to.

Headings are degrees clockwise from true north; the metric CRS has its own north, which differs
by the meridian convergence. Baselines are in the CRS; headings are converted here, at the rim.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from pyproj import CRS
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from geofield.crs import grid_north_deg, ground_scale
from geofield.errors import TrackError, is_truth
from geofield.methods import LONGEST_EDGE, method
from geofield.tracks.dominant import dominant_edge
from geofield.tracks.fewest import fewest_direction
from geofield.tracks.frame import true_heading_deg
from geofield.tracks.layout import Strips
from geofield.tracks.longest_edge import StraightRun, longest_edge
from geofield.tracks.outline import place_near

METHODS = ("dominant", "longest_edge", "hough", "fewest", "fewest_turns")


@dataclass(frozen=True, slots=True)
class Baseline:
    """What the tracks are parallel to, and where they are counted from."""

    #: Direction of the tracks in the CRS, unit vector, its true heading in [0, 180).
    along: tuple[float, float]
    #: The same as a true heading.
    heading_deg: float
    #: Whether numbers grow to the left of the direction.
    left: bool = False
    #: The edge of the outline that tracks are counted from, for `dominant`, `longest_edge` and
    #: `hough`.
    edge: StraightRun | None = None
    #: A place in the CRS that a track passes through, for an A-B line.
    through: tuple[float, float] | None = None
    #: Why this direction, where geofield chose it.
    why: str = ""


def find_baseline(
    polygon: Polygon,
    direction: Any,
    crs: CRS,
    *,
    strips: Strips,
    tolerance_m: float = 1.0,
    outside: Sequence[LineString] = (),
    area: BaseGeometry | None = None,
    through: tuple[float, float] | None = None,
) -> Baseline:
    """Turn the user's choice of a direction into a baseline.

    Parameters
    ----------
    polygon : shapely.Polygon
        The field, in a metric CRS.
    direction : str, float, LineString or pair of points
        ``dominant``, ``longest_edge``, ``hough``, ``fewest``, ``fewest_turns``, a true heading
        in degrees, or an A-B line in the CRS.
    crs : CRS
    strips : Strips
        How tracks are laid, which ``fewest`` and ``fewest_turns`` count.
    tolerance_m : float
        Half the width of the band within which an edge counts as straight.
    outside : sequence of LineString
        Where the outline is the edge of the picture that it was found in, and none of the field.
    area : polygon or multi-polygon, optional
        What is left of the field without its headland, where tracks are counted.
    through : (x, y), optional
        A place in the CRS that a track passes, where they are counted.

    Raises
    ------
    TrackError
        When the direction is not understood.
    """
    centre = polygon.centroid
    north = grid_north_deg(crs, centre.x, centre.y)
    scale = ground_scale(crs, centre.x, centre.y)
    if isinstance(direction, str):
        if direction in ("dominant", "longest_edge"):
            if direction == "longest_edge":
                edge = longest_edge(polygon, tolerance=tolerance_m * scale, outside=outside)
                return _from_edge(edge, north)
            edge, share = dominant_edge(polygon, tolerance=tolerance_m * scale, outside=outside)
            why = (
                f"along an edge of {edge.length / scale:.0f} m; {100.0 * share:.0f} % of the "
                "border run that way"
            )
            return replace(_from_edge(edge, north), why=why)
        if direction in LONGEST_EDGE:
            line = method(LONGEST_EDGE, direction)(polygon)
            return _from_edge(StraightRun(*shapely.get_coordinates(line).ravel().tolist()), north)
        if direction in ("fewest", "fewest_turns"):
            along = fewest_direction(
                polygon if area is None else area,
                strips,
                scale=scale,
                north_deg=north,
                through=through,
                turns=direction == "fewest_turns",
            )
            return _from_vector(along, north)
        try:
            direction = float(direction)
        except ValueError:
            raise _unknown(direction) from None
    if is_truth(direction):
        raise _unknown(direction)
    if isinstance(direction, int | float | np.integer | np.floating):
        return _from_heading(float(direction), north)
    return _from_ab(direction, north, polygon)


def _unknown(direction: Any) -> TrackError:
    return TrackError(
        f"Unknown direction {direction!r}.",
        hint=f"Choose one of {', '.join(METHODS)}, a heading in degrees, or an A-B line.",
    )


def _from_heading(heading_deg: float, north: float) -> Baseline:
    if not math.isfinite(heading_deg):
        raise TrackError(f"A heading of {heading_deg} degrees is not a direction.")
    # By the number itself: rounding could put a heading of 0 on either side.
    flipped = heading_deg % 360.0 >= 180.0
    heading = heading_deg % 180.0
    angle = math.radians(heading - north)
    return Baseline((math.sin(angle), math.cos(angle)), heading, left=flipped)


def _from_vector(
    along: tuple[float, float], north: float, through: tuple[float, float] | None = None
) -> Baseline:
    """Orient so that the true heading is in [0, 180); numbers grow to the right of `along`."""
    length = math.hypot(*along)
    unit = (along[0] / length, along[1] / length)
    heading = (math.degrees(math.atan2(*unit)) + north) % 360.0
    flipped = heading >= 180.0 and heading < 360.0
    if flipped:
        unit = (-unit[0], -unit[1])
    return Baseline(unit, true_heading_deg(unit, north), left=flipped, through=through)


def _from_edge(edge: StraightRun, north: float) -> Baseline:
    """Count from the edge inwards: the field lies to the left of a run of the outer ring."""
    along = (edge.x1 - edge.x0, edge.y1 - edge.y0)
    base = _from_vector(along, north)
    return Baseline(base.along, base.heading_deg, left=not base.left, edge=edge)


def _from_ab(line: Any, north: float, polygon: Polygon) -> Baseline:
    try:
        points = np.asarray(
            shapely.get_coordinates(line)
            if isinstance(line, LineString)
            else [(p.x, p.y) if hasattr(p, "x") else p for p in line],
            dtype=np.float64,
        )
    except (TypeError, ValueError) as error:
        raise _unknown(line) from error
    if points.shape != (2, 2) or not np.isfinite(points).all():
        raise TrackError(
            "An A-B line has two points of two finite coordinates in the field's CRS.",
            hint="For a curved line give its first and last point.",
        )
    along = (float(points[1, 0] - points[0, 0]), float(points[1, 1] - points[0, 1]))
    if math.hypot(*along) < 0.01:
        raise TrackError("A and B of the A-B line are the same point.")
    return _from_vector(
        along, north, through=place_near(polygon, points[0], "point A of the A-B line")
    )
