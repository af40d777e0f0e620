"""Tracks that a person took away, shortened or drew, in a layout of parallel ones.

What is not driven of the layout's own lines stands in their way, like an obstacle of no width; what
was drawn is cut where an obstacle or the border is, and takes its place among the tracks.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from pyproj import CRS
from shapely import Polygon

from geofield import schema
from geofield.angles import apart_deg
from geofield.crs import grid_north_deg
from geofield.model.obstacles import ObstacleShapes, polygons_around
from geofield.model.own_values import with_own_values
from geofield.model.segment_values import values_in, with_values
from geofield.model.track_edits import TrackEdit, TrackEdits, parts_of
from geofield.model.track_statistics import ObstacleLoss
from geofield.model.tracks import Tracks
from geofield.model.tracks_written import among, as_text
from geofield.tracks.frame import FloatArray, TrackFrame, true_heading_deg
from geofield.tracks.losses import by_number, losses_along
from geofield.tracks.shapes import Edges
from geofield.tracks.tables import BORDER, BY_HAND, cause_in_words, line_columns

if TYPE_CHECKING:
    import geopandas as gpd

#: A line is the one that was edited while it is so near and the spacing so much the same, both as
#: shares of the spacing, and its heading, degrees.
_NEAR, _ALIKE, _TURNED_DEG = 0.25, 0.02, 2.0
#: Half the width of what stands in a line's way, and how much longer than the piece it is, metres.
_THIN_M, _LONGER_M = 0.01, 0.01
#: Quarter circles of an obstacle have so many sides, laid around it: under a millimetre at 8 m.
_SIDES = 64
#: A line touches what it runs along for no longer, metres.
_TOUCH_M = 1e-6


@dataclass(frozen=True, slots=True)
class OnLayout:
    """The edits as a layout has their lines.

    Attributes
    ----------
    edits : TrackEdits
        Those in use with the numbers of this layout, the others apart.
    barred : Edges
        What stands in the way of lines or pieces of them; the owner is that given.
    drawn : list of TrackEdit
        Tracks to draw.
    barred_whole : int
        So many lines of the layout are not driven at all.
    """

    edits: TrackEdits
    barred: Edges
    drawn: list[TrackEdit]
    barred_whole: int


def on_layout(
    edits: TrackEdits,
    positions: FloatArray,
    frame: TrackFrame,
    *,
    heading_deg: float,
    spacing_m: float,
    owner: int,
) -> OnLayout:
    """Find the layout's lines that were edited; numbers of added tracks come after them.

    Parameters
    ----------
    edits : TrackEdits
    positions : float array (tracks,)
        Of the layout's lines across the frame, metres.
    frame : TrackFrame
    heading_deg, spacing_m : float
    owner : int
        Of the edges of what stands in the way.
    """
    kept: list[TrackEdit] = []
    bars: list[tuple[float, float, float]] = []
    apart, added, whole = [], [], 0
    for one in (*edits.edits, *edits.apart):
        if one.place is None:
            added.append(one)
            continue
        at = _line_of(one, positions, frame, heading_deg, spacing_m)
        if at is None or any(each.track_no == at + 1 for each in kept):
            apart.append(one)
            continue
        kept.append(one._replace(track_no=at + 1))
        if one.cut is None and one.drawn is None and not one.away:
            continue
        if one.cut is None:
            bars.append((float(positions[at]), -np.inf, np.inf))
            whole += 1
        else:
            bars += [(float(positions[at]), *span) for span in _spans(one.cut, frame)]
    taken = {one.track_no for one in kept}
    free = len(positions) + 1
    for one in added:
        number = one.track_no if one.track_no >= free else free
        while number in taken:
            number += 1
        taken.add(number)
        kept.append(one._replace(track_no=number))
    kept.sort(key=lambda one: one.track_no)
    drawn = [one for one in kept if one.drawn is not None]
    in_use = TrackEdits(tuple(kept), tuple(apart), edits.beside)
    return OnLayout(in_use, _bars(bars, owner), drawn, whole)


def _line_of(
    one: TrackEdit,
    positions: FloatArray,
    frame: TrackFrame,
    heading_deg: float,
    spacing_m: float,
) -> int | None:
    """Which line of a layout was edited."""
    assert one.place is not None  # noqa: S101 - added tracks have no line
    turned = apart_deg(one.place.heading_deg, heading_deg)
    across = float(frame.to_frame(one.place.x, one.place.y)[1])
    away = np.abs(positions - across)
    if abs(one.place.spacing_m - spacing_m) > _ALIKE * spacing_m or turned > _TURNED_DEG:
        return None
    if not len(away) or away.min() > _NEAR * spacing_m:
        return None
    return int(np.argmin(away))


def _spans(cut: str, frame: TrackFrame) -> list[tuple[float, float]]:
    """Where pieces begin and end along the frame."""
    found = []
    for piece in parts_of(cut):
        along = frame.to_frame(*shapely.get_coordinates(piece).T)[0]
        found.append((float(along.min()) - _LONGER_M, float(along.max()) + _LONGER_M))
    return found


def _bars(bars: Sequence[tuple[float, float, float]], owner: int) -> Edges:
    """Rectangles along lines (place across, begin, end), as edges of the frame."""
    across, begin, end = np.array(bars, dtype=np.float64).reshape(-1, 3).T
    begin, end = np.clip(begin, -1e7, None), np.clip(end, None, 1e7)
    u = np.column_stack((begin, end, end, begin))
    v = across[:, None] + np.array([-_THIN_M, -_THIN_M, _THIN_M, _THIN_M])
    number = u.size
    return Edges(
        u.ravel(),
        v.ravel(),
        np.roll(u, -1, axis=1).ravel(),
        np.roll(v, -1, axis=1).ravel(),
        np.ones(number, np.int8),
        np.full(number, owner, np.int64),
    )


def as_edited(tracks: Tracks, known: TrackEdits) -> Tracks:
    """Tracks as a person left them, all tables alike, without planning.

    Parameters
    ----------
    tracks : Tracks
        As read from a file, edited or not; with an emptied layer they stay as they are.
    known : TrackEdits
        Edits that its tracks were planned with.
    """
    edits = tracks.edits_since(known)
    before, now = known.by_number, edits.by_number
    changed = {no for no in {*before, *now} if _shape(before.get(no)) != _shape(now.get(no))}
    partial = tracks.partial - changed
    changed |= partial
    if not changed or tracks.written is None or tracks.emptied:
        return tracks
    written = tracks.written.segments
    told = []
    for no in sorted(changed & {*now, *partial}):
        one = now.get(no, TrackEdit(no))
        if no in partial:
            one = one._replace(drawn=as_text(shapely.MultiLineString(written[no])), cut=None)
        if one.cut is not None:
            cut = [shapely.get_coordinates(part) for part in parts_of(one.cut)]
            left = [line for line in written.get(no, ()) if not among(line, cut)]
            one = one._replace(drawn=as_text(shapely.MultiLineString(left)), cut=None)
        told += [one] if one.drawn is not None else []

    def others(table: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        return table[~table["track_no"].isin(changed) & table["track_no"].notna()]

    rest = replace(
        tracks,
        lines=others(tracks.lines),
        segments=others(tracks.segments),
        gaps=others(tracks.gaps),
    )
    return with_own(with_drawn(rest, told, clip=False), edits)


def _shape(one: TrackEdit | None) -> TrackEdit | None:
    """An edit without what was written beside it; None where nothing else was."""
    if one is None or one.own is None:
        return one
    return one._replace(own=None) if one.drawn or one.cut else None


def with_drawn(
    tracks: Tracks,
    drawn: Iterable[TrackEdit],
    min_segment_m: float = 0.0,
    *,
    clip: bool = True,
) -> Tracks:
    """Tracks with those that a person drew, cut at the border and at what they avoid.

    Parameters
    ----------
    tracks : Tracks
        Planned without them; they know their outline and what they avoid.
    drawn : iterable of TrackEdit
    min_segment_m : float
        Shorter pieces are not driven.
    clip : bool
        Whether to cut them.
    """
    free = _free(tracks.outline, tracks.shapes) if clip else None
    shapes = _shapes(tracks.shapes)
    numbers = () if tracks.shapes is None else (*tracks.shapes.circle_no, *tracks.shapes.polygon_no)
    least = max(min_segment_m, 1e-3) * tracks.ground_scale
    rows, gaps, whole = [], [], []
    for one in drawn:
        lines = parts_of(one.drawn)
        whole += lines
        corners, at = shapely.get_coordinates(lines), 0
        pieces = []
        for line in lines:
            cut = _cut(line, free)
            pieces += [(piece, at + a, at + b) for piece, a, b in cut if piece.length >= least]
            at += len(line.coords)
        rows += [(one.track_no, no, piece) for no, (piece, *_) in enumerate(pieces, 1)]
        for no, ((before, _, last), (after, first, _)) in enumerate(pairwise(pieces), 1):
            begin, end = before.coords[-1], after.coords[0]
            left_out = shapely.LineString([begin, *corners[last + 1 : first + 1], end])
            met = [int(numbers[which]) for which in np.flatnonzero(_along(left_out, shapes))]
            if tracks.outline is not None and left_out.difference(tracks.outline).length > _TOUCH_M:
                met.append(BORDER)
            way = shapely.LineString([begin, end])
            gaps.append((one.track_no, no, way, *cause_in_words(met or [BY_HAND])))
    joined = _joined(tracks, rows, gaps)
    if free is None or not numbers:
        return joined
    return replace(joined, losses=_with_losses(joined, whole, shapes, numbers))


def _with_losses(
    tracks: Tracks, drawn: Sequence[Any], shapes: Any, numbers: Sequence[int]
) -> tuple[ObstacleLoss, ...]:
    """What obstacles cost of the layout and of what was drawn."""
    assert tracks.outline is not None  # noqa: S101 - what was drawn was cut at it
    legs = [leg for line in drawn for leg in pairwise(line.coords)]
    lost = losses_along(np.asarray(shapely.linestrings(legs)), tracks.outline, shapes)
    return by_number(
        [*(one.obstacle_no for one in tracks.losses), *numbers],
        np.array([*(one.length_m for one in tracks.losses), *(lost / tracks.ground_scale)]),
        float(tracks.segments["length_m"].sum()),
    )


def with_own(tracks: Tracks, edits: TrackEdits) -> Tracks:
    """Tracks with what a person wrote into columns of their own, in both layers."""
    said = {one.track_no: one.own for one in edits.edits if one.own}
    beside = edits.beside
    if not said and not beside:
        return tracks
    numbers = tracks.lines["track_no"].tolist() if said else []
    segments = with_values(tracks.segments, beside, tracks.spacing_m)
    return replace(
        tracks,
        lines=with_own_values(schema.TRACKS, tracks.lines, [said.get(no) for no in numbers]),
        segments=segments,
        # Of the pieces as they are now, as they will be read again.
        edits=replace(tracks.edits, beside=values_in(segments, beside, tracks.spacing_m)),
    )


def _free(outline: Polygon | None, shapes: ObstacleShapes | None) -> Any:
    """Where may be driven; None for everywhere."""
    if outline is None:
        return None
    stands = shapely.union_all(_shapes(shapes))
    free = outline.difference(stands)
    shapely.prepare(free)
    return free


def _shapes(shapes: ObstacleShapes | None) -> Any:
    """What stands there, circles as polygons around them."""
    if shapes is None:
        return np.empty(0, dtype=object)
    return np.concatenate([polygons_around(shapes.circles, _SIDES), shapes.polygons])


def _along(line: Any, shapes: Any) -> Any:
    """Which shapes a line runs through, and does not only touch."""
    return shapely.length(shapely.intersection(shapes, line)) > _TOUCH_M


def _cut(line: Any, free: Any) -> list[tuple[Any, int, int]]:
    """The pieces of a line in the free area, along it, wherever it crosses or follows itself.

    With the legs of the line, from 0, that each begins and ends on.
    """
    if free is None or free.covers(line):
        return [(line, 0, len(line.coords) - 2)]
    corners = shapely.get_coordinates(line)
    legs = np.asarray(shapely.linestrings(np.stack((corners[:-1], corners[1:]), axis=1)))
    cut = ~shapely.covers(free, legs)
    legs[cut] = shapely.intersection(legs[cut], free)
    parts, leg = shapely.get_parts(legs, return_index=True)
    long = shapely.length(parts) > 0.0
    parts, leg = parts[long], leg[long]
    ends = np.stack([shapely.get_coordinates(shapely.get_point(parts, at)) for at in (0, -1)], 1)
    along = np.einsum("pei,pi->pe", ends, np.diff(corners, axis=0)[leg])
    ends = np.where((along[:, 0] > along[:, 1])[:, None, None], ends[:, ::-1], ends)
    order = np.lexsort((along.min(axis=1), leg))
    ends, leg = ends[order], leg[order]
    breaks = np.flatnonzero((ends[1:, 0] != ends[:-1, 1]).any(axis=1)) + 1
    runs = zip(np.split(ends, breaks), np.split(leg, breaks), strict=True) if len(ends) else ()
    return [(shapely.LineString([run[0, 0], *run[:, 1]]), on[0], on[-1]) for run, on in runs]


def _joined(tracks: Tracks, rows: Sequence[Any], gaps: Sequence[Any]) -> Tracks:
    """The tables with further segments, gaps, and the tracks that these are of."""
    import pandas as pd

    crs, scale = tracks.crs, tracks.ground_scale

    def table(layer: schema.Layer, columns: dict[str, Any], shapes: Sequence[Any]) -> Any:
        return schema.table(layer, columns, np.array([*shapes, None], dtype=object)[:-1], crs)

    def together(old: gpd.GeoDataFrame, new: gpd.GeoDataFrame, by: list[str]) -> Any:
        parts = [one for one in (old, new) if len(one)]
        joined = pd.concat(parts) if parts else old
        return joined.sort_values(by, kind="stable").reset_index(drop=True)

    numbers, parts, lines = zip(*rows, strict=True) if rows else ((), (), ())
    length_m = shapely.length(np.array(lines, dtype=object)) / scale
    columns = {"track_no": numbers, "segment_no": parts, "length_m": length_m}
    segments = table(schema.SEGMENTS, columns, lines)
    of, number, ways, causes, lowest = zip(*gaps, strict=True) if gaps else ((),) * 5
    gap_columns = {
        "track_no": of,
        "gap_no": number,
        "length_m": shapely.length(np.array(ways, dtype=object)) / scale,
        "cause": causes,
        "obstacle_no": lowest,
    }
    of_lines, first = line_columns(np.array(numbers, dtype=np.int64), length_m, tracks.step_m)
    each = [lines[at:to] for at, to in pairwise([*first, len(lines)])]
    of_lines["heading_deg"] = [_heading(some[0], some[-1], crs) for some in each]
    whole = [shapely.MultiLineString(some) for some in each]
    return replace(
        tracks,
        lines=together(tracks.lines, table(schema.TRACKS, of_lines, whole), ["track_no"]),
        segments=together(tracks.segments, segments, ["track_no", "segment_no"]),
        gaps=together(tracks.gaps, table(schema.GAPS, gap_columns, ways), ["track_no", "gap_no"]),
    )


def _heading(first: Any, last: Any, crs: CRS) -> float:
    """The true heading from the begin of a track to its end."""
    (x, y), (to_x, to_y) = first.coords[0][:2], last.coords[-1][:2]
    return true_heading_deg((to_x - x, to_y - y), grid_north_deg(crs, x, y))
