"""Stage 4 as one call: from a field and its obstacles to tracks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import shapely
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from geofield.crs import ground_scale
from geofield.errors import CRSMismatchError, TrackError, TrackWarning, refuse_other
from geofield.grid import Grid
from geofield.model.field import Field
from geofield.model.frame import along_frame
from geofield.model.obstacles import ObstacleShapes
from geofield.model.track_edits import TrackEdits
from geofield.model.tracks import Tracks
from geofield.notes import warn
from geofield.tracks.blocks import obstacle_shapes
from geofield.tracks.by_hand import on_layout, with_drawn, with_own
from geofield.tracks.clip import Crossings, Pieces, clip_tracks
from geofield.tracks.direction import Baseline, find_baseline
from geofield.tracks.enclosed import tell_enclosed
from geofield.tracks.fewest import fewest_tracks
from geofield.tracks.frame import FloatArray, TrackFrame
from geofield.tracks.headland import (
    headland_table,
    headland_track_table,
    main_area,
    unworked_note,
)
from geofield.tracks.layout import LastStrip, Strips
from geofield.tracks.losses import by_number, obstacle_losses
from geofield.tracks.outline import (
    clean_outline,
    metric,
    place_near,
    refuse_no_length,
    refuse_no_shape,
)
from geofield.tracks.places import places_across
from geofield.tracks.shapes import FIELD, Discs, Edges, join_edges, polygon_edges
from geofield.tracks.tables import (
    BY_HAND,
    gap_table,
    line_table,
    number_segments,
    segment_ends,
    segment_table,
)
from geofield.wording import counted

#: Ten times what a large farm's field has; they take half a minute and a gigabyte.
MOST_PIECES = 1_000_000
MOST_POINTS = 10_000_000


def plan_tracks(
    polygon: Polygon | Field,
    obstacles: Any = None,
    *,
    crs: Any = None,
    spacing_m: float,
    width_m: float | None = None,
    direction: Any = "dominant",
    offset_m: float | None = None,
    through: Any = None,
    last_strip: LastStrip = "overrun",
    headland_m: float = 0.0,
    headland_holes: bool = False,
    min_segment_m: float = 0.0,
    clearance_m: float = 0.0,
    step_m: float = 1.0,
    straight_tolerance_m: float = 1.0,
    grid: Grid | None = None,
    outside: Sequence[LineString] | None = None,
    edits: TrackEdits | None = None,
) -> Tracks:
    """Plan parallel tracks through a field, around what stands in it.

    >>> import shapely
    >>> box = shapely.box(500000, 3900000, 500200, 3900100)
    >>> tracks = gf.plan_tracks(box, crs="EPSG:32636", spacing_m=10, direction=90)
    >>> len(tracks.lines)
    10

    Parameters
    ----------
    polygon : shapely.Polygon or Field
        The field, with or without holes; a polygon is in `crs`.
    obstacles : GeoDataFrame, GeoSeries, shapely geometries or None
        What no vehicle may enter, avoided exactly as drawn: circles of geofield's own tables as
        true circles, a person's polygons as polygons. Rows with status ``rejected`` do not count.
        A table in another CRS is reprojected.
    crs : CRS, str or int
        Of the polygon; projected, in metres (usually the UTM zone). A Field has its own.
    spacing_m : float
        Between neighbouring tracks. This and all other lengths are metres on the ground.
    width_m : float, optional
        Working width of the machine, half of which is kept from the border; a spacing by default.
    direction : str, float, LineString or pair of points
        ``dominant`` (the way most of the border runs), ``longest_edge`` (of the outer ring),
        ``hough`` (the study's way to it), ``fewest`` (tracks) or ``fewest_turns`` (pieces), a
        heading in degrees clockwise from true north, or an A-B line in `crs`.
    offset_m : float, optional
        Of the first track from the edge it is counted from; half the width when not given.
    through : (x, y) or shapely.Point, optional
        A place in `crs` that one track passes through, instead of an offset. An A-B line passes
        through its A by itself.
    last_strip : {"overrun", "leave", "shift", "spread"}
        What becomes of the rest at the far side; see `track_positions`.
    headland_m : float
        Width of the strip along the border that straight tracks keep out of. It gets a polygon and
        tracks of its own, parallel to the border.
    headland_holes : bool
        Whether that strip runs around the field's holes too.
    min_segment_m : float
        Shorter segments are not driven; they count as part of the gap.
    clearance_m : float
        Grows every obstacle; up to 1000.
    step_m : float
        Between track points.
    straight_tolerance_m : float
        How far the vertices of a straight edge may stray, for ``dominant`` and
        ``longest_edge``.
    grid : Grid, optional
        Of the picture: gives the track points their pixels.
    outside : sequence of LineString, optional
        Where the outline is the picture's edge, and the field goes on (`Plan.frame_lines`): no
        edge to follow. Along the frame of `grid` when not given.
    edits : TrackEdits, optional
        Tracks that a person took away, shortened or drew (`Plan.track_edits`): they stay so where
        the layout has the same lines, and what was drawn is cut at obstacles and border.

    Returns
    -------
    Tracks

    Raises
    ------
    CRSError
        When the CRS or the coordinates are not metres.
    TrackError
        When the field or a setting is unfit.
    """
    if isinstance(polygon, Field):
        if crs is not None and metric(crs) != polygon.crs:
            raise CRSMismatchError(
                f"The field is in {polygon.crs.name}, not in the CRS given.",
                hint="Leave crs out: a Field has its own.",
            )
        crs, polygon = polygon.crs, polygon.polygon
    refuse_no_shape(polygon)
    _refuse_other_kinds(grid, outside, edits)
    metric_crs = metric(crs)
    wide_m = spacing_m if width_m is None else width_m
    refuse_no_length(spacing_m=spacing_m, step_m=step_m, width_m=wide_m)
    limits = {"min_segment_m": min_segment_m, "straight_tolerance_m": straight_tolerance_m}
    limits |= {"offset_m": 0.0 if offset_m is None else offset_m}
    refuse_no_length(**limits, headland_m=headland_m, clearance_m=clearance_m, none_too=True)
    strips = Strips(float(spacing_m), offset_m, last_strip, width_m)
    outline, notes = clean_outline(polygon)
    for note in notes:
        warn(note, TrackWarning)
    shapes = obstacle_shapes(obstacles, metric_crs, clearance_m=clearance_m, outline=outline)
    centre = outline.centroid
    scale = ground_scale(metric_crs, centre.x, centre.y)
    _refuse_too_many(outline, shapes, spacing_m * scale, step_m * scale)
    inner: BaseGeometry = outline
    if headland_m != 0.0:
        inner = main_area(outline, headland_m, scale=scale, holes=headland_holes)
    place = None if through is None else place_near(outline, through, "place to pass through")
    baseline = find_baseline(
        outline,
        direction,
        metric_crs,
        strips=strips,
        tolerance_m=straight_tolerance_m,
        outside=along_frame(outline, metric_crs, grid) if outside is None else outside,
        area=inner,
        through=place,
    )
    if place is not None:
        baseline = replace(baseline, through=place)
    frame = TrackFrame.of((centre.x, centre.y), baseline.along, left=baseline.left, scale=scale)
    edges = polygon_edges(inner, frame, FIELD)
    positions, spacing_m, more = places_across(edges, frame, baseline, strips, inset_m=headland_m)
    said = on_layout(
        edits or TrackEdits(),
        positions,
        frame,
        heading_deg=baseline.heading_deg,
        spacing_m=spacing_m,
        owner=len(shapes.circles) + len(shapes.polygons),
    )
    barred = join_edges(edges, said.barred)
    pieces, crossings = clip_shapes(positions, barred, shapes, frame, min_segment_m)
    told: tuple[str, ...] = (
        () if len(pieces.track) or said.drawn else (_nothing_left(min_segment_m),)
    )
    if len(positions) > 1:
        told += strips.gap_note(spacing_m)
    if said.edits.apart:
        told += (_other_layout(len(said.edits.apart)),)
    optional: dict[str, Any] = {}
    if headland_m > 0.0:
        told = (*unworked_note(headland_m, strips.spacing_m, strips.overlap_m), *told)
        optional["headland"] = headland_table(
            outline, inner, headland_m, crs=metric_crs, scale=scale
        )
        optional["headland_tracks"] = headland_track_table(
            outline,
            shapes,
            width_m=headland_m,
            spacing_m=strips.spacing_m,
            first_m=strips.half_m,
            crs=metric_crs,
            scale=scale,
            holes=headland_holes,
        )
    for note in told:
        warn(note, TrackWarning)
    tracks = _tracks(
        pieces,
        crossings,
        positions,
        frame,
        shapes,
        barred_count=said.barred_whole,
        crs=metric_crs,
        heading_deg=baseline.heading_deg,
        spacing_m=spacing_m,
        step_m=step_m,
        grid=grid,
        outline=outline,
        notes=(*notes, *more, *told),
        direction_why=_why(baseline, fewest_tracks(inner, strips, scale), len(positions)),
        edits=said.edits,
        width_m=width_m,
        **optional,
    )
    tracks = with_drawn(tracks, said.drawn, min_segment_m) if said.drawn else tracks
    return tell_enclosed(with_own(tracks, said.edits))


def clip_shapes(
    positions: FloatArray,
    edges: Edges,
    shapes: ObstacleShapes,
    frame: TrackFrame,
    min_segment_m: float = 0.0,
) -> tuple[Pieces, Crossings]:
    """Clip tracks against a field's edges and obstacles of the CRS.

    Obstacle indices are those of the circles, followed by those of the polygons.
    """
    circles = len(shapes.circles)
    x, y, radius = shapes.circles.T
    discs = Discs(*frame.to_frame(x, y), radius / frame.scale, np.arange(circles))
    if len(shapes.polygons):
        owner = np.arange(circles, circles + len(shapes.polygons))
        edges = join_edges(edges, polygon_edges(shapes.polygons, frame, owner))
    return clip_tracks(positions, edges, discs, min_length_m=min_segment_m)


def _refuse_other_kinds(grid: object, outside: object, edits: object) -> None:
    """Refuse what is no part of a scene or plan."""
    refuse_other(grid, Grid | None, "grid", "Of a scene give scene.grid.", TrackError)
    refuse_other(edits, TrackEdits | None, "edits", "Of a plan give plan.track_edits.", TrackError)
    for line in () if outside is None else np.atleast_1d(np.asarray(outside, dtype=object)):
        refuse_other(line, LineString, "outside", "Of a plan give plan.frame_lines.", TrackError)


def _nothing_left(min_segment_m: float) -> str:
    """That no track has a piece."""
    but = f", or leaves no piece of {min_segment_m:g} m" if min_segment_m else ""
    return f"Nothing is left to drive: what stands there covers the field{but}."


def _other_layout(count: int) -> str:
    """That what a person changed is of another layout."""
    tracks = "1 track that you edited is" if count == 1 else f"{count} tracks that you edited are"
    return f"{tracks} of another layout (spacing, direction, outline): kept for it, not used here."


def _why(baseline: Baseline, least: int, count: int) -> str:
    """Why this direction was chosen, and what another would save."""
    if not baseline.why:
        return ""
    if least >= count:
        return f"{baseline.why}; no heading needs fewer tracks"
    tracks = counted(least, "track")
    return f"{baseline.why}; direction fewest would need {tracks} instead of {count}"


def _refuse_too_many(outline: Polygon, shapes: ObstacleShapes, spacing: float, step: float) -> None:
    """Refuse a spacing or a step that would fill memory or disk, before anything is made.

    Lines a spacing apart meet a curve 2 L / (pi spacing) times on average over all directions
    (Crofton); a piece of the field has two ends, and an obstacle cuts one piece into two.
    """
    # What is larger than the field cuts no more of it than all.
    length = outline.length + np.minimum(2.0 * np.pi * shapes.circles[:, 2], outline.length).sum()
    length += shapely.length(shapes.polygons).sum()
    count = float(length / (np.pi * spacing))
    if count > MOST_PIECES:
        raise TrackError(
            f"So narrow a spacing would give about {count:.1g} pieces of track; "
            f"{MOST_PIECES:,} are the most.",
            hint="Give the spacing in metres, for instance 3, or plan parts of the field.",
        )
    points = outline.area / (spacing * step)
    if points > MOST_POINTS:
        raise TrackError(
            f"A spacing of {spacing:.3g} m with a track point every {step:.3g} m would give about "
            f"{points:.1g} track points; {MOST_POINTS:,} are the most.",
            hint="Widen the spacing, or set the points' distance (step) to at least "
            f"{1.1 * outline.area / (spacing * MOST_POINTS):.2g} m.",
        )


def _tracks(
    pieces: Pieces,
    crossings: Crossings,
    positions: FloatArray,
    frame: TrackFrame,
    shapes: ObstacleShapes,
    *,
    crs: Any,
    heading_deg: float,
    step_m: float,
    outline: Polygon,
    barred_count: int,
    **rest: Any,
) -> Tracks:
    obstacle_no = np.concatenate((shapes.circle_no, shapes.polygon_no))
    track_no, segment_no = number_segments(pieces)
    length_m = pieces.end - pieces.start
    ends = segment_ends(pieces, positions, frame)
    segments = segment_table(ends, track_no, segment_no, length_m, crs)
    lost = obstacle_losses(crossings, len(obstacle_no))
    blocked = len(positions) - barred_count - len(np.unique(pieces.track))
    return Tracks(
        lines=line_table(ends, track_no, length_m, heading_deg=heading_deg, step_m=step_m, crs=crs),
        segments=segments,
        gaps=gap_table(
            pieces,
            crossings,
            positions,
            frame,
            obstacle_no=np.append(obstacle_no, BY_HAND),
            crs=crs,
        ),
        heading_deg=heading_deg,
        step_m=step_m,
        outline=outline,
        shapes=shapes,
        blocked_count=blocked,
        losses=by_number(obstacle_no, lost, float(length_m.sum())),
        **rest,
    )
