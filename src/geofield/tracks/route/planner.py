"""A route through all segments, with the turns between them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, get_args

import geopandas as gpd
import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS
from shapely import Polygon
from shapely.ops import substring

from geofield import schema
from geofield.errors import (
    TrackError,
    TrackWarning,
    refuse_no_number,
    refuse_other,
    refuse_unknown,
)
from geofield.model.obstacles import ObstacleShapes
from geofield.model.tracks import Tracks
from geofield.notes import warn
from geofield.tracks.frame import FloatArray
from geofield.tracks.outline import place_near, refuse_no_length, refuse_wide_turns
from geofield.tracks.route.curves import to_unit
from geofield.tracks.route.order import PATTERNS, Pattern, nearest_start
from geofield.tracks.route.passage import Passage
from geofield.tracks.route.shortest import shortest_order
from geofield.tracks.route.turns import Curve, Turn, as_line
from geofield.tracks.route.ways import Ways, places_of
from geofield.tracks.shapes import IntArray
from geofield.wording import counted


def plan_route(
    tracks: Tracks,
    *,
    pattern: Pattern = "boustrophedon",
    skip: int = 1,
    turning_radius_m: float | None = None,
    curve: Curve = "dubins",
    margin_m: float = 0.0,
    start: Any = None,
) -> Tracks:
    """Put the segments of planned tracks into an order, and find the ways between them.

    >>> field = gf.read_plan("sample_data/field_1.gpkg").field
    >>> tracks = gf.plan_tracks(field, spacing_m=20, headland_m=10)
    >>> routed = gf.plan_route(tracks, pattern="boustrophedon", turning_radius_m=5)
    >>> len(routed.turns) == len(tracks.segments) - 1
    True

    Parameters
    ----------
    tracks : Tracks
        From `plan_tracks`.
    pattern : {"boustrophedon", "skip", "shortest"}
        Up one track and down the next; the same leaving out `skip` tracks at every turn; or the
        order with the shortest drive between segments, where a turn that cannot be driven counts
        as twelve turning radii more.
    skip : int
        For ``skip``: tracks left out at a turn (1: from track 1 to 3).
    turning_radius_m : float, optional
        Of the machine. Without it the ways are the shortest ones, with sharp corners.
    curve : {"dubins", "reeds_shepp"}
        Turns forwards only, or with reversing.
    margin_m : float
        How far beyond the outer border a turn may reach.
    start : (x, y) or shapely.Point, optional
        A place in the CRS to begin near.

    Returns
    -------
    Tracks
        The same tracks with the tables `route` and `turns`. A turn that cannot be driven within the
        allowed area is there all the same, with ``fits`` = ``no``; no way runs through an obstacle.
        Where there is no way at all it is left out, and its sequence number with it.

    Raises
    ------
    TrackError
        When a setting is unfit, or the tracks do not know their field.
    """
    refuse_other(tracks, Tracks, "tracks", "Of a plan give plan.tracks.", TrackError)
    outline, shapes = tracks.outline, tracks.shapes
    if outline is None or shapes is None:
        raise TrackError(
            "These tracks do not know their field and obstacles.", hint="Plan them anew first."
        )
    _check(pattern, curve, skip, margin_m)
    # Ways are planned in metres on the ground, and carried back to the CRS when they are done.
    scale = tracks.ground_scale
    place = None if start is None else np.array(place_near(outline, start, "start")) / scale
    outline, shapes = _on_the_ground(outline, shapes, scale)
    if turning_radius_m is not None:
        refuse_wide_turns(outline.bounds, turning_radius_m, margin_m)
    lines = np.asarray(tracks.segments.geometry.to_numpy(), dtype=object)
    ends = places_of(lines) / scale
    track_no = tracks.segments["track_no"].to_numpy(dtype=np.int64)
    passage = Passage(outline, shapes, margin_m=margin_m)
    ways = Ways(lines, track_no, scale, passage, turning_radius_m, curve)
    rows, backward = nearest_start(ends, track_no, int(skip) if pattern == "skip" else 0, place)
    if pattern == "shortest":
        rows, backward = shortest_order(ends, rows, backward, ways, start=place)
    turns = ways.along(rows, backward)
    exits, entries = ways.poses(rows, backward)
    route, table = _tables(
        tracks, rows, backward, turns, exits=exits, entries=entries, radius_m=turning_radius_m
    )
    told, count = [], len(np.unique(track_no))
    if pattern == "skip" and 1 < count <= skip + 1:
        told.append(
            f"Of {count} tracks {skip} cannot be left out at a turn: each is followed by the next."
        )
    cut_off = sum(turn.kind == "none" for turn in turns)
    if cut_off:
        told.append(
            f"Obstacles or the border cut the field into parts: {counted(cut_off, 'way')} between "
            f"segments {'does' if cut_off == 1 else 'do'} not exist, and the route leaves "
            f"{'it' if cut_off == 1 else 'them'} out."
        )
    for note in told:
        warn(note, TrackWarning)
    return replace(tracks, route=route, turns=table, notes=(*tracks.notes, *told))


def _on_the_ground(
    outline: Polygon, shapes: ObstacleShapes, scale: float
) -> tuple[Polygon, ObstacleShapes]:
    """Field and obstacles with one unit to a metre on the ground."""

    def shrunk(coordinates: FloatArray) -> FloatArray:
        return coordinates / scale

    return shapely.transform(outline, shrunk), ObstacleShapes(
        shapes.circles / scale,
        shapes.circle_no,
        shapely.transform(shapes.polygons, shrunk),
        shapes.polygon_no,
    )


def _check(pattern: str, curve: str, skip: int, margin_m: float) -> None:
    refuse_unknown(TrackError, "pattern", pattern, PATTERNS)
    refuse_unknown(TrackError, "curve", curve, get_args(Curve))
    refuse_no_number(TrackError, "0 or more tracks", whole=True, skip=skip)
    if skip < 0:
        raise TrackError(f"skip is {skip}; it must be 0 or more tracks.")
    refuse_no_length(none_too=True, margin_m=margin_m)


def _tables(
    tracks: Tracks,
    rows: IntArray,
    backward: NDArray[np.bool_],
    turns: list[Turn],
    *,
    exits: FloatArray,
    entries: FloatArray,
    radius_m: float | None,
) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Layers `route` and `turns`; work gets the odd sequence numbers, ways the even ones."""
    scale = tracks.ground_scale
    driven = np.asarray(tracks.segments.geometry.to_numpy(), dtype=object)[rows]
    driven[backward] = shapely.reverse(driven[backward])
    early = np.array([turn.early_m for turn in turns] + [0.0] * (len(rows) > len(turns)))
    late = np.array([0.0] * (len(rows) > len(turns)) + [turn.late_m for turn in turns])
    whole = shapely.length(driven) / scale
    work_m = whole - early - late
    count = len(rows) + len(turns)
    lines = [as_line(turn.places * scale) for turn in turns]
    length = _in_turn(work_m, [turn.length_m for turn in turns]).astype(np.float64)
    kinds = ["drive" if turn.kind == "drive" else "turn" for turn in turns]
    none = [None] * len(turns)
    track_no = tracks.segments["track_no"].to_numpy(dtype=np.int64)[rows]
    segment_no = tracks.segments["segment_no"].to_numpy(dtype=np.int64)[rows]
    crs = CRS(tracks.segments.crs)
    route = schema.table(
        schema.ROUTE,
        {
            "sequence": np.arange(1, count + 1),
            "kind": _in_turn(["work"] * len(rows), kinds),
            "direction": _in_turn(
                np.where(backward, "backward", "forward"), ["forward"] * len(turns)
            ),
            "track_no": _in_turn(track_no, none),
            "segment_no": _in_turn(segment_no, none),
            "length_m": length,
            "start_m": np.cumsum(length) - length,
        },
        _in_turn(_shortened(driven, late * scale, (whole - early) * scale), lines),
        crs,
    )
    there = np.ones(count, dtype=bool)
    there[1::2] = [turn.kind != "none" for turn in turns]
    table = schema.table(
        schema.TURNS,
        {
            "turn_no": np.arange(1, len(turns) + 1),
            "sequence": np.arange(2, count + 1, 2),
            "from_track": track_no[:-1],
            "to_track": track_no[1:],
            "kind": [turn.kind for turn in turns],
            "direction": _sides(exits, entries),
            "radius_m": [
                np.nan if radius_m is None or turn.kind == "drive" else radius_m for turn in turns
            ],
            "length_m": [turn.length_m for turn in turns],
            "reverse_m": [turn.reverse_m for turn in turns],
            "outside_m": [turn.outside_m for turn in turns],
            "skipped_m": [turn.early_m + turn.late_m for turn in turns],
            "fits": ["yes" if turn.fits else "no" for turn in turns],
        },
        lines,
        crs,
    )
    return route[there].reset_index(drop=True), table[there[1::2]].reset_index(drop=True)


def _shortened(
    lines: NDArray[np.object_], begin: FloatArray, end: FloatArray
) -> NDArray[np.object_]:
    """The parts of lines from one length along them to another."""
    straight = shapely.get_num_coordinates(lines) == 2
    ends = places_of(lines)
    along = (ends[:, 1] - ends[:, 0]) / shapely.length(lines)[:, None]
    ends[:, 1] = ends[:, 0] + along * end[:, None]
    ends[:, 0] += along * begin[:, None]
    parts = np.empty(len(lines), dtype=object)
    parts[straight] = shapely.linestrings(ends[straight])
    for at in np.flatnonzero(~straight):
        parts[at] = substring(lines[at], begin[at], end[at])
    return parts


def _in_turn(work: Any, ways: list[Any]) -> NDArray[np.object_]:
    """Values of the work, each but the last followed by that of the way to the next."""
    out = np.empty(len(work) + len(ways), dtype=object)
    out[0::2], out[1::2] = work, ways
    return out


def _sides(exits: FloatArray, entries: FloatArray) -> list[str]:
    """To which side of the way out the next segment begins."""
    _, across, _ = to_unit(exits, entries, 1.0)
    return [
        "left" if value > 1e-6 else "right" if value < -1e-6 else "straight"
        for value in across.tolist()
    ]
