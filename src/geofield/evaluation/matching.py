"""Evaluation: detections against a truth, one to one.

A detection is a hit when it is matched with a true obstacle within a distance; every truth
is matched at most once (H. W. Kuhn's Hungarian method, over all pairs within the distance:
first as many hits as possible, then the smallest sum of distances).

The study calls a missed obstacle "FPE" and a wrong detection "FNE"; here the usual terms
hold: false negative is missed, false positive is wrong.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from pyproj import CRS
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from geofield.crs import ground_areas_m2, is_metric
from geofield.errors import CRSError, GeofieldError, ObstacleError
from geofield.evaluation.driving import Driving, driving
from geofield.model.obstacles import active

if TYPE_CHECKING:
    import geopandas as gpd

FloatArray = NDArray[np.float64]
DEFAULT_DISTANCE_M = 6.0


@dataclass(frozen=True, slots=True)
class Matches:
    """Who was matched with whom, in one picture.

    Attributes
    ----------
    detected_index, truth_index : intp arrays, shape (hits,)
    distance : float64 array, shape (hits,)
    detected_count, truth_count : int
    """

    detected_index: NDArray[np.intp]
    truth_index: NDArray[np.intp]
    distance: FloatArray
    detected_count: int
    truth_count: int

    @property
    def missed_index(self) -> NDArray[np.intp]:
        """Truths that nothing was matched with."""
        return np.setdiff1d(np.arange(self.truth_count), self.truth_index)

    @property
    def false_index(self) -> NDArray[np.intp]:
        """Detections that match nothing."""
        return np.setdiff1d(np.arange(self.detected_count), self.detected_index)


@dataclass(frozen=True, slots=True)
class Score:
    """Figures of one picture, or of several pooled.

    Attributes
    ----------
    hits, detected, truth : int
    precision, recall, f1 : float
        NaN where nothing was detected, or nothing is there.
    radius_bias, radius_error : float
        Mean and mean absolute difference of the radii of hits, detected minus true; NaN
        without radii.
    distance : float
        Mean distance of hits.
    interval : dict of name to (low, high)
        95 % bootstrap intervals of precision, recall, f1 and radius bias.
    """

    hits: int
    detected: int
    truth: int
    precision: float
    recall: float
    f1: float
    radius_bias: float
    radius_error: float
    distance: float
    interval: dict[str, tuple[float, float]] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return plain values, NaN as None."""
        values: dict[str, Any] = {}
        for name in self.__slots__:
            value = getattr(self, name)
            if isinstance(value, float) and not np.isfinite(value):
                value = None
            if name == "interval":
                value = {
                    key: [None if not np.isfinite(v) else v for v in pair]
                    for key, pair in value.items()
                }
            values[name] = value
        return values


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
    """

    pooled: Score
    images: dict[str, Score]
    matches: dict[str, Matches]
    distance_m: float
    driving: Driving | None = None


def match_points(detected: ArrayLike, truth: ArrayLike, distance: float) -> Matches:
    """Match points one to one within a distance.

    Parameters
    ----------
    detected, truth : array (n, 2), (m, 2)
        In one unit, that of ``distance``.
    distance : float

    Returns
    -------
    Matches
        As many hits as possible, with the smallest sum of distances.

    Raises
    ------
    ObstacleError
        When the distance is not above zero.
    """
    if not (np.isfinite(distance) and distance > 0):
        raise ObstacleError(f"The matching distance {distance:g} is not above zero.")
    found = np.asarray(detected, dtype=float).reshape(-1, 2)
    true = np.asarray(truth, dtype=float).reshape(-1, 2)
    first: list[int] = []
    second: list[int] = []
    apart: list[float] = []
    if len(found) and len(true):
        # Only points within the distance can meet: groups of them are matched on their own,
        # so that whole cities fit into memory.
        pairs = cKDTree(found).sparse_distance_matrix(
            cKDTree(true), distance, output_type="coo_matrix"
        )
        rows, cols, gaps = pairs.row, pairs.col, pairs.data
        size = len(found) + len(true)
        graph = coo_matrix((np.ones(len(rows)), (rows, cols + len(found))), shape=(size, size))
        _, group = connected_components(graph, directed=False)
        order = np.argsort(group[rows], kind="stable")
        starts = np.flatnonzero(np.r_[True, np.diff(group[rows][order]) != 0])
        for part in np.split(order, starts[1:]):
            if not part.size:
                continue
            r, i = np.unique(rows[part], return_inverse=True)
            c, j = np.unique(cols[part], return_inverse=True)
            # A pair out of reach costs more than any number of pairs within it.
            cost = np.full((r.size, c.size), 1e3 * distance * (1 + min(r.size, c.size)))
            cost[i, j] = gaps[part]
            a, b = linear_sum_assignment(cost)
            hit = cost[a, b] <= distance
            first.extend(r[a[hit]].tolist())
            second.extend(c[b[hit]].tolist())
            apart.extend(cost[a, b][hit].tolist())
    return Matches(
        np.asarray(first, dtype=np.intp),
        np.asarray(second, dtype=np.intp),
        np.asarray(apart, dtype=float),
        len(found),
        len(true),
    )


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
        Obstacles as :func:`geofield.detect_obstacles` returns them; rejected ones are left out.
    truth : GeoDataFrame, or mapping of picture name to GeoDataFrame
        Points, boxes or polygons; a column ``radius_m``, where there is one, or the radius of
        the circle of a polygon's area is the true radius.
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
        When the distance is not above zero or a picture has no truth.
    CRSError
        When a table has no CRS, or the detected obstacles are not in metres.
    """
    found = detected if isinstance(detected, Mapping) else {"": detected}
    true = truth if isinstance(truth, Mapping) else {"": truth}
    missing = sorted(set(found) ^ set(true))
    if missing:
        raise ObstacleError(f"Picture {missing[0]!r} has detections or a truth, but not both.")
    matches: dict[str, Matches] = {}
    rows: dict[str, _Counts] = {}
    for name in found:
        within = area.get(name) if isinstance(area, Mapping) else area
        a, b = _comparable(found[name], true[name])
        centre_a, radius_a, _ = _circles(a, within)
        centre_b, radius_b, has_radius = _circles(b, within)
        match = match_points(centre_a, centre_b, distance_m)
        matches[name] = match
        difference = radius_a[match.detected_index] - radius_b[match.truth_index]
        if not has_radius:
            difference = np.full(difference.shape, np.nan)
        rows[name] = _Counts(match, difference)
    images = {name: _score([counts]) for name, counts in rows.items()}
    pooled = _score(list(rows.values()), bootstrap=bootstrap, seed=seed)
    lost = None
    if segments is not None:
        if area is None:
            raise ObstacleError("What a driver loses needs the field as area.")
        lost = Driving()
        for name in found:
            lines = segments[name] if isinstance(segments, Mapping) else segments
            field = area[name] if isinstance(area, Mapping) else area
            lost += driving(lines, found[name], true[name], field)
    return Evaluation(pooled, images, matches, distance_m, lost)


@dataclass(frozen=True, slots=True)
class _Counts:
    match: Matches
    radius_difference: FloatArray


def _comparable(
    detected: gpd.GeoDataFrame, truth: gpd.GeoDataFrame
) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    if detected.crs is None or truth.crs is None:
        raise CRSError("Detections and truth need a CRS.", hint="Set it with set_crs.")
    if not is_metric(detected.crs):
        raise CRSError(
            "Detections are not in a metric CRS.", hint="Reproject them to their UTM zone."
        )
    detected = active(detected)
    return detected, truth.to_crs(detected.crs)


def _circles(frame: gpd.GeoDataFrame, within: Any) -> tuple[FloatArray, FloatArray, bool]:
    """Centres (n, 2) and radii (n,), and whether there are radii at all."""
    geometry = np.asarray(frame.geometry.to_numpy(), dtype=object)
    present = ~(shapely.is_missing(geometry) | shapely.is_empty(geometry))
    frame, geometry = frame[present], geometry[present]
    centre = shapely.centroid(geometry)
    xy = np.column_stack([shapely.get_x(centre), shapely.get_y(centre)]).reshape(-1, 2)
    radius = np.full(len(geometry), np.nan)
    if "radius_m" in frame.columns:
        radius = frame["radius_m"].to_numpy(dtype="float64", na_value=np.nan)
    else:
        area = ground_areas_m2(geometry, CRS(frame.crs))
        radius = np.where(area > 0, np.sqrt(area / np.pi), np.nan)
    if within is not None:
        keep = shapely.covers(within, centre)
        xy, radius = xy[keep], radius[keep]
    return xy, radius, bool(np.isfinite(radius).any())


def _score(rows: Sequence[_Counts], *, bootstrap: int = 0, seed: int = 0) -> Score:
    hits = np.array([len(row.match.truth_index) for row in rows])
    detected = np.array([row.match.detected_count for row in rows])
    truth = np.array([row.match.truth_count for row in rows])
    parts = [row.radius_difference[np.isfinite(row.radius_difference)] for row in rows]
    difference = np.concatenate(parts) if parts else np.empty(0)
    distance = np.concatenate([row.match.distance for row in rows]) if rows else np.empty(0)
    figures = _figures(hits.sum(), detected.sum(), truth.sum())
    interval: dict[str, tuple[float, float]] = {}
    if bootstrap > 0:
        interval = _intervals(hits, detected, truth, parts, bootstrap, seed)
    return Score(
        int(hits.sum()),
        int(detected.sum()),
        int(truth.sum()),
        *figures,
        float(difference.mean()) if difference.size else float("nan"),
        float(np.abs(difference).mean()) if difference.size else float("nan"),
        float(distance.mean()) if distance.size else float("nan"),
        interval,
    )


def _figures(hits: float, detected: float, truth: float) -> tuple[float, float, float]:
    precision = hits / detected if detected else float("nan")
    recall = hits / truth if truth else float("nan")
    f1 = 2 * hits / (detected + truth) if detected + truth else float("nan")
    return float(precision), float(recall), float(f1)


def _intervals(
    hits: NDArray[np.int64],
    detected: NDArray[np.int64],
    truth: NDArray[np.int64],
    radii: list[FloatArray],
    bootstrap: int,
    seed: int,
) -> dict[str, tuple[float, float]]:
    rng = np.random.default_rng(seed)
    figures = np.full((bootstrap, 4), np.nan)
    by_picture = hits.size >= 5
    pool = np.concatenate(radii) if radii else np.empty(0)
    # Each obstacle is a hit, a miss or a false detection: these are drawn where pictures are few.
    kinds = np.repeat([0, 1, 2], [hits.sum(), (truth - hits).sum(), (detected - hits).sum()])
    for k in range(bootstrap):
        if by_picture:
            pick = rng.integers(hits.size, size=hits.size)
            figures[k, :3] = _figures(hits[pick].sum(), detected[pick].sum(), truth[pick].sum())
            drawn = np.concatenate([radii[i] for i in pick])
        else:
            count = (
                np.bincount(rng.choice(kinds, kinds.size), minlength=3) if kinds.size else [0] * 3
            )
            figures[k, :3] = _figures(count[0], count[0] + count[2], count[0] + count[1])
            drawn = rng.choice(pool, pool.size) if pool.size else pool
        if drawn.size:
            figures[k, 3] = drawn.mean()
    out: dict[str, tuple[float, float]] = {}
    for name, column in zip(("precision", "recall", "f1", "radius_bias"), figures.T, strict=True):
        known = column[np.isfinite(column)]
        if known.size:
            low, high = np.percentile(known, [2.5, 97.5])
            out[name] = (float(low), float(high))
    return out


def reliability(
    confidence: ArrayLike, hit: ArrayLike, bins: int = 10
) -> tuple[FloatArray, FloatArray, NDArray[np.int64], float]:
    """How far confidences keep their word.

    Parameters
    ----------
    confidence : array (n,)
        0 to 1.
    hit : bool array (n,)
    bins : int
        Of equal width.

    Returns
    -------
    mean_confidence, share_of_hits : float64 arrays, shape (bins,)
        NaN for empty bins.
    count : int array, shape (bins,)
    error : float
        Expected calibration error: the mean gap, weighted by counts; NaN for no detection.
    """
    p, y = np.asarray(confidence, dtype=float), np.asarray(hit, dtype=float)
    if p.shape != y.shape:
        raise GeofieldError(f"{p.size} confidences do not fit {y.size} hits.")
    which = np.clip((p * bins).astype(int), 0, bins - 1)
    count = np.bincount(which, minlength=bins)
    with np.errstate(invalid="ignore"):
        mean = np.bincount(which, weights=p, minlength=bins) / count
        share = np.bincount(which, weights=y, minlength=bins) / count
    error = float(np.nansum(np.abs(mean - share) * count) / p.size) if p.size else float("nan")
    return mean, share, count.astype(np.int64), error
