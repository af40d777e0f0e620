"""The pipeline: picture and point in, plan out; the four stages in their order.

Each ``run_*`` function takes a plan as far as it has come and adds one stage, honouring
what a person has edited since: a moved outline, a confirmed, rejected or added obstacle.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, MutableMapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from geofield import schema
from geofield.earlier import (
    bars_points,
    drew_outline,
    field_changes,
    keeps_outline,
    kept_outline,
    known_outline,
    of_the_same_field,
    points_said,
    read_track_edits,
    refuse_lost_obstacles,
    renamed,
    still_said,
    tracks_come_back,
    warn_of_unsearched,
    with_points,
    with_said_tracks,
)
from geofield.errors import FieldError, FieldWarning, GeofieldError, ImageryWarning, TrackError
from geofield.model.evidence import Evidence, outline_record
from geofield.model.field import Field
from geofield.model.merge import merge
from geofield.model.obstacles import on_grid
from geofield.model.review import reconcile
from geofield.model.scene import Scene
from geofield.model.searched import searched_in
from geofield.model.track_edits import TrackEdits
from geofield.model.tracks import Tracks
from geofield.model.written import Written
from geofield.notes import listening, warn
from geofield.plan import Plan
from geofield.settings import Settings, with_values
from geofield.windows import (
    first_side_m,
    open_scene,
    refuse_elsewhere,
    shows_all,
    shows_points,
    tell_guesses,
    wider,
)

if TYPE_CHECKING:
    import geopandas as gpd

#: Called with (done, total, what).
Progress = Callable[[int, int, str], None]
#: Gives the path of what shows a square of a side in ground metres; None where nothing does.
FetchWider = Callable[[float], str | None]

STAGES = ("picture", "field", "obstacles", "tracks")


def plan_field(
    scene: Scene | str | Path,
    *,
    lat: float,
    lon: float,
    settings: Settings | None = None,
    previous: Plan | None = None,
    boundary: Field | None = None,
    known: gpd.GeoDataFrame | None = None,
    progress: Progress | None = None,
    timings_s: MutableMapping[str, float] | None = None,
    name: str | None = None,
    fetch_wider: FetchWider | None = None,
    **by_name: Any,
) -> Plan:
    """Run all four stages.

    >>> picture = "sample_data/field_1.tif"
    >>> plan = gf.plan_field(picture, lat=35.075373, lon=33.531142, spacing_m=6, name="North")
    >>> plan.field.name, plan.tracks.spacing_m
    ('North', 6.0)

    Parameters
    ----------
    scene : Scene or path
        The picture, in memory or as a file.
    lat, lon : float
        A point in the field, degrees, WGS 84.
    settings : Settings, optional
    previous : Plan, optional
        An earlier plan of the same field: its outline, where a person drew it, and its
        reviewed obstacles are kept, and what they set on the review page where nothing is said.
    boundary : Field, optional
        The user's own outline, below one that a person drew in `previous`; none is extracted then.
    known : GeoDataFrame, optional
        What is known to stand there, in any CRS: polygons, points with a ``radius_m``, lines.
    progress : callable, optional
        Called with (done, total, what) at each stage.
    timings_s : mutable mapping, optional
        Filled with the seconds of each stage.
    name : str, optional
        Of the field; its earlier plan's, or its place, when not given.
    fetch_wider : callable, optional
        Of a fetched picture beyond which the field goes on: called with a side, ground metres;
        returns the path of a picture so wide, or None.
    **by_name
        Any setting by its own name, over those of `settings`: ``spacing_m=6``; ``machine`` may
        be one of the settings, a `Machine` or a mapping such as ``{"width_m": 12}``.

    Returns
    -------
    Plan
    """
    settings = with_values(settings, **by_name)
    tell, timings = progress or (lambda *_: None), {} if timings_s is None else timings_s
    with _timed("picture", timings, tell):
        outline = known_outline(boundary, previous, lat, lon)
        previous = of_the_same_field(previous, lat, lon)
        picture = _seen(scene, lat, lon, with_points(settings, previous), outline)
    with _timed("field", timings, tell):
        plan = run_field(
            scene, lat=lat, lon=lon, settings=settings, previous=previous, boundary=boundary,
            window=picture, name=name, fetch_wider=fetch_wider,
        )  # fmt: skip
    with _timed("obstacles", timings, tell):
        if known is not None:
            from geofield.known import known_rows, with_further

            plan = with_further(plan, known_rows(known, "known"))
        plan = run_obstacles(plan, plan.scene or picture, settings=settings)
        plan = replace(plan, changes=() if previous is None else plan.changes)
    with _timed("tracks", timings, tell):
        return run_tracks(plan, settings=plan.settings or settings)


def run_field(
    picture: Scene | str | Path,
    *,
    lat: float,
    lon: float,
    settings: Settings,
    previous: Plan | None = None,
    regions: Sequence[int] = (),
    boundary: Field | None = None,
    window: Scene | None = None,
    choose: int | None = None,
    name: str | None = None,
    fetch_wider: FetchWider | None = None,
) -> Plan:
    """Stage 2: find the outline, unless a person drew it.

    What is not told here is as for :func:`plan_field`. Of a path, a wider window is read when the
    outline touches the window's edge; `window` is the picture around the point, where it was read
    already. By a person's word come `regions`, numbered by the study's method, and `choose`, one
    of the field's alternatives.
    """
    previous = of_the_same_field(previous, lat, lon)
    # Regions have the numbers that a list of them gave, before there was an outline.
    known = None if regions else known_outline(boundary, previous, lat, lon)
    told = points_said(None if previous is None else previous.settings)
    said = bool(points_said(settings) - told or regions)
    settings, told_tracks = with_said_tracks(with_points(settings, previous), previous)
    scene = _seen(picture, lat, lon, settings, known) if window is None else window
    choosing = bool(previous is not None and choose and previous.field.alternatives)
    kept = previous is not None and not choosing and _keeps(previous, boundary, said=said)
    if previous is not None and choose and choosing:
        field = previous.field.choose(choose)
    elif previous is not None and kept:
        if said:
            raise FieldError(
                f"The outline there {bars_points(previous)}: it is kept, and no "
                f"{'region' if regions else 'point'} changes it.",
                hint="Move the outline itself, or --fresh to have it found again.",
            )
        if boundary is not None:
            warn(
                "The outline there was drawn by hand: it is kept, and the boundary is not used. "
                "To have the boundary, forget the earlier plan (--fresh; in Python previous=None).",
                FieldWarning,
            )
        field = kept_outline(previous)
    else:
        if boundary is None:
            field, scene = _find(picture, scene, lat, lon, settings, regions, fetch_wider)
            field = field.choose(choose) if choose else field
        else:
            field = boundary
            refuse_elsewhere(boundary, scene.grid)
        field = replace(
            field,
            imagery=scene.source.name,
            imagery_date=scene.source.day,
            licence=scene.source.licence,
        )
        field = field if previous is None else renamed(field, previous)
    if name:
        field = replace(field, name=name)
    obstacles = written = None
    edits = TrackEdits()
    if previous is not None:
        edits = read_track_edits(previous).reprojected(previous.field.crs, field.crs)
    if previous is not None and previous.obstacles is not None:
        obstacles, written = reconcile(previous.obstacles, previous.evidence.written, scene.grid)
        obstacles = on_grid(obstacles, scene.grid).to_crs(field.crs)
        written = written.reprojected(previous.field.crs, field.crs)
    return Plan(
        field=field,
        obstacles=obstacles,
        settings=settings,
        source=scene.source,
        grid=scene.grid,
        evidence=Evidence(
            (lat, lon),
            outline_record(field.polygon),
            written=written,
            track_edits=edits,
            said_tracks=() if previous is None else still_said(previous, settings),
            searched=None if previous is None else previous.evidence.searched,
            shown_px=scene.shown_px,
        ),
        scene=scene,
        changes=()
        if previous is None
        else (*field_changes(previous, field, kept=kept), *told_tracks),
    )


def _keeps(previous: Plan, boundary: Field | None, *, said: bool) -> bool:
    """Whether an earlier plan's outline stays: what was drawn stands above what was given."""
    if boundary is not None:
        return drew_outline(previous)
    return bars_points(previous) is not None if said else keeps_outline(previous)


def _seen(
    picture: Scene | str | Path, lat: float, lon: float, settings: Settings, known: Field | None
) -> Scene:
    """The picture around a point, with all of the outline that is known."""
    if isinstance(picture, Scene):
        return picture
    return open_scene(picture, lat, lon, settings, outline=known)


def _find(
    picture: Scene | str | Path,
    scene: Scene,
    lat: float,
    lon: float,
    settings: Settings,
    regions: Sequence[int],
    fetch_wider: FetchWider | None,
) -> tuple[Field, Scene]:
    """The field, in a window as wide as it needs."""
    from geofield.field import extract_field, grow_field

    options = settings.field.model_dump()
    if regions:
        options |= {"method": "study", "include": (), "exclude": ()}
    if isinstance(picture, Scene) or regions:
        # Numbers of regions, and a picture that is given as a value, do not change.
        return extract_field(scene, lat=lat, lon=lon, regions=regions, **options), scene
    first_m = first_side_m(scene, lat, lon, settings)
    shown, latest = shows_points(scene, settings), scene

    def read(size_m: float) -> Scene:
        nonlocal latest
        if shown and size_m == first_m:
            return scene
        path = fetch_wider(size_m) if fetch_wider is not None else picture
        if path is None:
            return latest
        with listening(ImageryWarning):  # told with the first window
            unasked = path == picture and settings.imagery.size_m is None
            if unasked and shows_all(picture, lat, lon, scene, settings):
                return scene
            latest = open_scene(path, lat, lon, wider(settings, size_m))
        return latest

    field, wide = grow_field(
        read, lat=lat, lon=lon, size_m=first_m, largest_m=max(6400.0, first_m), **options
    )
    tell_guesses(wide, after=scene)
    return field, wide


def run_obstacles(plan: Plan, scene: Scene, *, settings: Settings) -> Plan:
    """Stage 3: find obstacles; rows that a person reviewed or drew stay as they are."""
    from geofield.obstacles import detect_obstacles

    refuse_lost_obstacles(plan)
    detected = detect_obstacles(scene, plan.field, **settings.obstacles.model_dump())
    found = dict(detected.attrs.get("detection", {}))
    detected.attrs.clear()
    changes = (*plan.changes, *tracks_come_back(plan))
    if plan.obstacles is None:
        written = Written.of(detected, np.zeros(len(detected), bool))
    else:
        earlier, written = reconcile(plan.obstacles, plan.evidence.written, scene.grid)
        detected, written, told = merge(
            detected, earlier, written, plan.field.polygon, scene.grid, scene.shown_px
        )
        changes += (told.in_words(),)
    return replace(
        plan,
        obstacles=detected,
        tracks=None,
        settings=_with_section(plan.settings, settings, "obstacles"),
        source=scene.source,
        grid=scene.grid,
        evidence=replace(
            plan.evidence,
            detection=found,
            written=written,
            track_edits=read_track_edits(plan),
            searched=searched_in(plan.field),
            shown_px=scene.shown_px,
        ),
        scene=scene,
        changes=changes,
    )


def run_tracks(plan: Plan, *, settings: Settings, with_route: bool = True) -> Plan:
    """Stage 4: plan the tracks in the free area of whatever field and obstacles there are."""
    field = replace(plan.field, method="drawn", quality=None) if plan.outline_edited else plan.field
    refuse_lost_obstacles(plan, searched=False)
    obstacles, said = None, still_said(plan, settings)
    told = [*field_changes(plan, field, kept=True)] if field is not plan.field else []
    evidence = replace(plan.evidence, track_edits=read_track_edits(plan), said_tracks=said)
    if plan.obstacles is not None:
        obstacles, written = reconcile(plan.obstacles, evidence.written, plan.grid)
        told += [written.since(evidence.written)] if evidence.written is not None else []
        evidence = replace(evidence, written=written)
    read = replace(plan, field=field, obstacles=obstacles, tracks=None, evidence=evidence)
    tracks = tracks_of_plan(read, settings, with_route=with_route)
    evidence = replace(evidence, track_edits=tracks.edits).with_unsearched(field)
    warn_of_unsearched(evidence)
    told += [*tracks_come_back(plan), tracks.edits.in_words()]
    if field is not plan.field:
        evidence = replace(evidence, outline=outline_record(field.polygon))
    return replace(
        plan,
        field=field,
        obstacles=obstacles,
        tracks=tracks,
        settings=_with_section(plan.settings, settings, "tracks"),
        evidence=evidence,
        changes=tuple(dict.fromkeys(each for each in (*plan.changes, *told) if each)),
    )


def tracks_of_plan(plan: Plan, settings: Settings, *, with_route: bool = False) -> Tracks:
    """The tracks alone, for field and obstacles as they stand in the plan."""
    from geofield.tracks import plan_with_settings, route_with_settings

    field = plan.field
    tracks = plan_with_settings(
        field.polygon,
        plan.obstacles,
        settings.tracks,
        crs=field.crs,
        grid=plan.grid,
        outside=plan.frame_lines,
        edits=plan.track_edits,
    )
    if not (len(tracks.rows()[schema.TRACKS.name]) or tracks.blocked_count or tracks.edits.edits):
        raise TrackError(
            f"The field of {field.area_ha:.4f} ha is smaller than one track.",
            hint="Choose a smaller spacing or headland, or check the outline.",
        )
    return route_with_settings(tracks, settings.tracks, field.polygon) if with_route else tracks


def _with_section(old: Settings | None, new: Settings, section: str) -> Settings:
    """The settings that led to the plan: each stage's own, from the run that did it."""
    return new if old is None else old.model_copy(update={section: getattr(new, section)})


@contextmanager
def _timed(stage: str, timings: MutableMapping[str, float], tell: Progress) -> Iterator[None]:
    tell(STAGES.index(stage), len(STAGES), stage)
    start = time.perf_counter()
    try:
        yield
    except GeofieldError as error:
        error.add_note(f"while working on: {stage}")
        raise
    timings[stage] = time.perf_counter() - start
    tell(STAGES.index(stage) + 1, len(STAGES), stage)
