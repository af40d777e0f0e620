"""What a set of tracks amounts to: counts and lengths, area worked, missed and worked twice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

if TYPE_CHECKING:
    import geopandas as gpd

#: Of headland tracks and their strips: corners stay corners (an implement is turned there), but a
#: spike's corner is cut off.
MITRE_LIMIT = 2.0
#: Edges that two areas share differ in their last digits, metres: what lies between has no area,
#: but is as long as they are.
SHARED_EDGE_M = 1e-4
#: Rows are parallel where their ends are no farther off, share of the spacing; and metres, as
#: coordinates of millions of metres are no finer.
_STRAIGHT, _FINEST_M = 1e-6, 1e-8
#: So many rows are cut at once: more take longer for each, fewer cut a long outline more often.
_TOGETHER = 200


@dataclass(frozen=True, slots=True)
class ObstacleLoss:
    """What one obstacle costs.

    Attributes
    ----------
    obstacle_no : int
    length_m : float
        Track lost to it; stretches inside several obstacles are shared evenly among them.
    percent : float
        Of all track the field would have without obstacles.
    """

    obstacle_no: int
    length_m: float
    percent: float


@dataclass(frozen=True, slots=True)
class TrackStatistics:
    """Figures of one field's tracks.

    Attributes
    ----------
    track_count, segment_count, gap_count, point_count : int
        Tracks with at least one segment; segments; gaps between segments; track points.
    blocked_count : int
        Tracks that obstacles leave nothing of, or only pieces that are too short.
    length_m : float
        Of all segments: the path without turns.
    gap_length_m : float
    mean_segment_m, longest_segment_m, shortest_segment_m : float
        NaN without segments.
    area_ha : float
        The field without its holes; NaN where the outline is not known.
    worked_ha : float
        Of the field within half a working width (half a spacing where none was given) of a segment
        or headland track, as a strip of its length.
    coverage_percent : float
        Worked area, of the field's.
    overlap_percent : float
        Area worked more than once, counted once per repetition, of the field's.
    losses : tuple of ObstacleLoss
    """

    track_count: int
    segment_count: int
    gap_count: int
    point_count: int
    blocked_count: int
    length_m: float
    gap_length_m: float
    mean_segment_m: float
    longest_segment_m: float
    shortest_segment_m: float
    area_ha: float
    worked_ha: float
    coverage_percent: float
    overlap_percent: float
    losses: tuple[ObstacleLoss, ...]


def worked(
    segments: gpd.GeoDataFrame,
    headland_tracks: gpd.GeoDataFrame | None,
    outline: shapely.Polygon,
    width: float,
    scale: float,
) -> tuple[float, float]:
    """Area of the outline within a strip: counted once, and once for every strip.

    Parameters
    ----------
    segments, headland_tracks : GeoDataFrame
        Layers of these names, in a metric CRS.
    outline : Polygon
        The field, in the same.
    width : float
        Of a strip, units of that CRS.
    scale : float
        Units of that CRS per metre on the ground.
    """
    strips = _strips(segments, headland_tracks, width, scale)
    row = None if headland_tracks is not None else _rows_apart(segments, width)
    if row is not None:
        # Strips of every other track do not even touch: their union is the list of them.
        group = row // _TOGETHER * 2 + row % 2
        order = np.argsort(group, kind="stable")
        rows = shapely.multipolygons(strips[order], indices=group[order])
        alone = float(shapely.area(shapely.intersection(rows, outline)).sum())
        return alone, alone
    together = shapely.union_all(strips)
    once = float(shapely.intersection(together, outline).area)
    # Cutting an outline of a million vertices once for every strip takes its time.
    if shapely.area(strips).sum() <= together.area * (1.0 + 1e-9):
        return once, once
    return once, float(shapely.area(shapely.intersection(strips, outline)).sum())


def _rows_apart(segments: gpd.GeoDataFrame, width: float) -> NDArray[np.int64] | None:
    """In which of parallel rows, a width apart, each segment lies behind the others of its row.

    None where they do not lie so: a person may have drawn some.
    """
    if not len(segments) or not _is_straight(segments.geometry.to_numpy()).all():
        return None
    ends = shapely.get_coordinates(segments.geometry.to_numpy()).reshape(-1, 2, 2)
    # The way of a short one is known to some digits only.
    along = (ends[:, 1] - ends[:, 0])[np.argmax(shapely.length(segments.geometry.to_numpy()))]
    along /= np.hypot(*along)
    start, end = ((ends - ends[0, 0]) @ along).T
    across = (ends - ends[0, 0]) @ np.array([-along[1], along[0]])
    number = segments["track_no"].to_numpy(dtype=np.int64)
    _, first, track = np.unique(number, return_index=True, return_inverse=True)
    # Ends of one row differ in their last digits.
    level = across[first, 0][track]
    if np.abs(across - level[:, None]).max() > max(_STRAIGHT * width, _FINEST_M):
        return None
    order = np.lexsort((start, level))
    same = number[order][1:] == number[order][:-1]
    behind = start[order][1:] - end[order][:-1] > 0.0
    step = np.diff(level[order])
    if not np.where(same, behind, step >= width - _FINEST_M).all():
        return None
    row = np.empty(len(order), np.int64)
    row[order] = np.append(0, np.cumsum(~same))
    return row


def _strips(
    segments: gpd.GeoDataFrame, headland_tracks: gpd.GeoDataFrame | None, width: float, scale: float
) -> np.ndarray:
    """The strip that each segment works, as a rectangle; those of the headland, as they bend."""
    lines = segments.geometry.to_numpy()
    straight = _is_straight(lines)
    ends = shapely.get_coordinates(lines[straight]).reshape(-1, 2, 2)
    bent = lines[~straight & (shapely.length(lines) > 0.0)]
    along = ends[:, 1] - ends[:, 0]
    along /= np.hypot(along[:, 0], along[:, 1])[:, None]
    side = np.column_stack((-along[:, 1], along[:, 0])) * (width / 2.0)
    corners = np.stack(
        (ends[:, 0] - side, ends[:, 1] - side, ends[:, 1] + side, ends[:, 0] + side), axis=1
    )
    around = [_beside(bent, width)]
    if headland_tracks is not None:
        ring_width = max(width, _ring_width_m(headland_tracks) * scale)
        around.append(_beside(headland_tracks.geometry.to_numpy(), ring_width))
    return np.concatenate((np.asarray(shapely.polygons(corners)), *around))


def _beside(lines: Any, width: float) -> Any:
    """The strips along lines that bend."""
    around = shapely.buffer(
        lines, width / 2.0, cap_style="flat", join_style="mitre", mitre_limit=MITRE_LIMIT
    )
    # That of a line which doubles back on itself may cross itself.
    return np.where(shapely.is_valid(around), around, shapely.make_valid(around))


def _ring_width_m(headland_tracks: gpd.GeoDataFrame) -> float:
    """What a pass around the field works: twice as wide as the first is away from the border.

    It is wider than a strip of tracks that were moved together to fill the field evenly.
    """
    first = headland_tracks.loc[headland_tracks["pass_no"] == 1, "offset_m"].to_numpy(np.float64)
    return float(np.nanmax([0.0, *(2.0 * first)]))


def _is_straight(lines: Any) -> NDArray[np.bool_]:
    """Which segments are as planned; a person may have bent one, or left it without a length."""
    return np.asarray((shapely.get_num_coordinates(lines) == 2) & (shapely.length(lines) > 0.0))
