"""Detected obstacles against a truth: :func:`evaluate`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from pyproj import CRS

from geofield.crs import ground_areas_m2, ground_scale, is_metric, refuse_outside
from geofield.errors import (
    CRSError,
    ObstacleError,
    ObstacleWarning,
    refuse_no_number,
    refuse_other,
)
from geofield.evaluation.driving import Driving, driving
from geofield.evaluation.matching import FloatArray, Matches, match_points
from geofield.evaluation.scores import Counts, Score, score
from geofield.model.obstacles import active, floats
from geofield.notes import warn

if TYPE_CHECKING:
    import geopandas as gpd

DEFAULT_DISTANCE_M = 6.0
#: No picture and its truth lie so far apart.
_ELSEWHERE_KM = 2.0


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Figures per picture and pooled.

    Attributes
    ----------
    pooled : Score
    images : dict of name to Score
    matches : dict of name to Matches
    distance_m : float
        Within which a detection counts.
    driving : Driving or None
        What a driver loses, where tracks were given.
    false_kinds : dict of kind to int
        Of the false detections, where they have a column ``kind``: a truth of trees alone has
        none of kind ``other``.
    """

    pooled: Score
    images: dict[str, Score]
    matches: dict[str, Matches]
    distance_m: float
    driving: Driving | None = None
    false_kinds: Mapping[str, int] = field(default_factory=dict)


def evaluate(
    detected: gpd.GeoDataFrame | Mapping[str, gpd.GeoDataFrame],
    truth: gpd.GeoDataFrame | Mapping[str, gpd.GeoDataFrame],
    *,
    distance_m: float = DEFAULT_DISTANCE_M,
    area: Any = None,
    segments: gpd.GeoDataFrame | Mapping[str, gpd.GeoDataFrame] | None = None,
    bootstrap: int = 1000,
    seed: int = 0,
) -> Evaluation:
    """Compare detected obstacles with a truth.

    >>> truth = gf.read_plan("sample_data/field_1.gpkg").obstacles
    >>> gf.evaluate(truth, truth).pooled.f1
    1.0

    Parameters
    ----------
    detected : GeoDataFrame, or mapping of picture name to GeoDataFrame
        Obstacles as :func:`geofield.detect_obstacles` returns them; those that are rejected or
        merely possible are left out.
    truth : GeoDataFrame, or mapping of picture name to GeoDataFrame
        Points, boxes or polygons; a column ``radius_m``, where there is one, or the radius of
        the circle of a polygon's area is the true radius. Of a reviewed plan's obstacles those
        that are rejected or merely possible are no truths.
    distance_m : float
        Between centres, on the ground.
    area : shapely geometry, or mapping of picture name to one, optional
        Only obstacles and truths with their centre inside count; in the CRS of ``detected``.
    segments : GeoDataFrame, or mapping of picture name to one, optional
        The lines that are driven, in metres; with an area, the fields, they give the
        figures of `Evaluation.driving`.
    bootstrap : int
        Resamplings for the intervals: of pictures where there are at least five, of single
        obstacles otherwise; 0 for none.
    seed : int

    Raises
    ------
    ObstacleError
        When the distance is not above zero, a picture has no truth, or none of the areas or
        segments that are given by picture, or a radius is no number.
    CRSError
        When a table has no CRS, or the detected obstacles are not in metres.
    """
    refuse_no_number(ObstacleError, "0 or more", whole=True, bootstrap=bootstrap, seed=seed)
    found = detected if isinstance(detected, Mapping) else {"": detected}
    true = truth if isinstance(truth, Mapping) else {"": truth}
    missing = sorted(set(found) ^ set(true))
    if missing:
        raise ObstacleError(f"Picture {missing[0]!r} has detections or a truth, but not both.")
    matches: dict[str, Matches] = {}
    rows: dict[str, Counts] = {}
    false_kinds: Counter[str] = Counter()
    for name in found:
        a, b = compared(found[name], true[name], _of(name, "area", area))
        centre_a, radius_a = _circles(a)
        centre_b, radius_b = _circles(b)
        scale = _scale(np.vstack([centre_a, centre_b]), a.crs)
        _tell_elsewhere(centre_a / scale, centre_b / scale)
        match = match_points(centre_a / scale, centre_b / scale, distance_m)
        matches[name] = match
        if "kind" in a.columns:
            false_kinds.update(a["kind"].iloc[match.false_index].dropna())
        difference = radius_a[match.detected_index] - radius_b[match.truth_index]
        rows[name] = Counts(match, difference)
    images = {name: score([counts]) for name, counts in rows.items()}
    pooled = score(list(rows.values()), bootstrap=bootstrap, seed=seed)
    lost = None
    if segments is not None:
        if area is None:
            raise ObstacleError("What a driver loses needs the field as area.")
        lost = Driving()
        for name in found:
            lines = _of(name, "segments", segments).to_crs(found[name].crs)
            ground = _of(name, "area", area)
            lost += driving(lines, found[name], active(true[name]), ground)
    return Evaluation(pooled, images, matches, distance_m, lost, dict(false_kinds))


def _of(name: str, what: str, given: Any) -> Any:
    """What is given for a picture: its own of a mapping, else the one of all."""
    if not isinstance(given, Mapping):
        return given
    if name not in given:
        raise ObstacleError(
            f"There is no {what} of picture {name!r}." if name else f"{what} names pictures.",
            hint=f"Give {what} as a mapping with all pictures that are compared, or one for all.",
        )
    return given[name]


def compared(
    detected: gpd.GeoDataFrame, truth: gpd.GeoDataFrame, area: Any = None
) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """The rows of one picture that count, in the order of its matches, both in one CRS."""
    import geopandas as gpd

    for what, table in (("detected", detected), ("truth", truth)):
        hint = "Of a plan give plan.obstacles, of its file gf.read_plan(path).obstacles."
        refuse_other(table, gpd.GeoDataFrame, what, hint, ObstacleError)
    if detected.crs is None or truth.crs is None:
        raise CRSError("Detections and truth need a CRS.", hint="Set it with set_crs.")
    if not is_metric(detected.crs):
        raise CRSError(
            "Detections are not in a metric CRS.", hint="Reproject them to their UTM zone."
        )
    true = active(truth).to_crs(detected.crs)
    refuse_outside(CRS(truth.crs), shapely.get_coordinates(true.geometry.to_numpy()))
    return _counting(active(detected), area), _counting(true, area)


def _tell_elsewhere(found_m: FloatArray, true_m: FloatArray) -> None:
    """Warn of a truth that is of other ground: its figures say nothing of the detections."""
    if not (len(found_m) and len(true_m)):
        return
    boxes = [shapely.box(*each.min(axis=0), *each.max(axis=0)) for each in (found_m, true_m)]
    apart_km = float(shapely.distance(*boxes)) / 1000
    if apart_km > _ELSEWHERE_KM:
        warn(
            f"The truth lies {apart_km:,.0f} km from the obstacles: it is of another place, or its "
            "CRS is not the right one (are latitude and longitude exchanged?).",
            ObstacleWarning,
        )


def _scale(centres: FloatArray, crs: Any) -> float:
    """Units of a CRS in a metre on the ground, in the middle of some centres."""
    if not len(centres):
        return 1.0
    return float(ground_scale(CRS(crs), *centres.mean(axis=0)))


def _counting(frame: gpd.GeoDataFrame, area: Any) -> gpd.GeoDataFrame:
    """The rows with a shape, and with its centre inside where there is an area."""
    geometry = np.asarray(frame.geometry.to_numpy(), dtype=object)
    keep = ~(shapely.is_missing(geometry) | shapely.is_empty(geometry))
    if area is not None:
        keep &= shapely.covers(area, shapely.centroid(geometry))
    return frame[keep]


def _circles(frame: gpd.GeoDataFrame) -> tuple[FloatArray, FloatArray]:
    """Centres (n, 2) and radii (n,), NaN where there are none."""
    geometry = np.asarray(frame.geometry.to_numpy(), dtype=object)
    xy = shapely.get_coordinates(shapely.centroid(geometry))
    radius = np.full(len(geometry), np.nan)
    if "radius_m" in frame.columns:
        radius = floats(frame, "radius_m")
    else:
        area = ground_areas_m2(geometry, CRS(frame.crs))
        radius = np.where(area > 0, np.sqrt(area / np.pi), np.nan)
    return xy, radius
