"""What an earlier plan of the same field means for a new one: a person's word stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import shapely

from geofield import schema
from geofield.crs import LONLAT, transformer
from geofield.errors import (
    FieldError,
    ObstacleError,
    ObstacleWarning,
    TrackWarning,
    refuse_other,
)
from geofield.model.evidence import Evidence
from geofield.model.field import MAKE_ONE, Field
from geofield.model.own_values import empty_columns
from geofield.model.review import reconcile
from geofield.model.track_edits import TrackEdits
from geofield.model.written import same_shapes
from geofield.notes import listening, warn
from geofield.plan import Plan
from geofield.settings import Settings, TrackSettings, as_before, option_named
from geofield.wording import counted

#: Methods of outlines that a person gave as they are, or chose.
_GIVEN = ("boundary", "chosen")


def with_points(settings: Settings, previous: Plan | None) -> Settings:
    """Settings with the points that an earlier plan of the field was told, too."""
    if previous is None or previous.settings is None:
        return settings
    old, new = previous.settings.field, settings.field
    # The last word on a place counts.
    include = [one for one in old.include if one not in (*new.include, *new.exclude)]
    exclude = [one for one in old.exclude if one not in (*new.include, *new.exclude)]
    points = {"include": (*include, *new.include), "exclude": (*exclude, *new.exclude)}
    return settings.model_copy(update={"field": new.model_copy(update=points)})


def with_said_tracks(settings: Settings, previous: Plan | None) -> tuple[Settings, tuple[str, ...]]:
    """Settings with those of the tracks that a person set for an earlier plan.

    What is said now, by a caller, a file or the environment, holds. Both are told in words.
    """
    if previous is None or previous.settings is None:
        return settings, ()
    then, asked = previous.settings.tracks, settings.tracks
    names = still_said(previous, previous.settings)
    settings = as_before(settings, previous.settings, "tracks", only=names)
    now, known = settings.tracks, still_said(previous, settings)
    kept = [_said(then, name) for name in known if getattr(asked, name) != getattr(then, name)]
    told = [f"as set for this field: {', '.join(kept)}"] if kept else []
    told += [
        f"{_said(now, name)} as said now, no longer {_said(then, name)} as set for this field"
        for name in names
        if name not in known
    ]
    return settings, tuple(told)


def still_said(plan: Plan, settings: Settings) -> tuple[str, ...]:
    """The settings of the tracks that a person set for a plan, and that are so in others."""
    if plan.settings is None:
        return ()
    then, now = dict(plan.settings.tracks), dict(settings.tracks)
    names = plan.evidence.said_tracks  # of another version, perhaps
    return tuple(name for name in names if name in then and then[name] == now[name])


def no_longer_said(settings: Settings, previous: Plan | None) -> str | None:
    """Settings of an earlier plan's tracks that give way, for nothing says them now, in words."""
    if previous is None or previous.settings is None:
        return None
    then, now = previous.settings.tracks, with_said_tracks(settings, previous)[0].tracks
    # Some follow from others that are said, as the spacing from the width.
    names = [
        name
        for name, usual in TrackSettings()
        if name not in now.model_fields_set
        and getattr(now, name) == usual
        and getattr(then, name) not in (usual, None)
    ]
    if not names:
        return None
    return (
        f"No longer as in the earlier plan: {', '.join(_said(then, name) for name in names)}. The "
        "defaults hold where nothing is said; `geofield tracks` keeps a plan's settings."
    )


def _said(tracks: TrackSettings, name: str) -> str:
    """A setting as an option of the command line."""
    value = getattr(tracks, name)
    shown = f"{value:g}" if isinstance(value, float) else str(value).lower()
    return f"{option_named(name, TrackSettings.model_fields[name])} {shown}"


def points_said(settings: Settings | None) -> set[tuple[bool, tuple[float, float]]]:
    """What was said of further places: whether each belongs, and where it is."""
    if settings is None:
        return set()
    belong = {(True, place) for place in settings.field.include}
    return belong | {(False, place) for place in settings.field.exclude}


def drew_outline(previous: Plan) -> bool:
    """Whether a person drew an earlier plan's outline, or may have: nobody recorded another."""
    return _drawn(previous) or _without_record(previous)


def keeps_outline(previous: Plan) -> bool:
    """Whether an earlier plan's outline stays: it is a person's word, or may be."""
    return drew_outline(previous) or previous.field.method in _GIVEN


def bars_points(previous: Plan) -> str | None:
    """Why no further point changes an earlier plan's outline, in words; None where points may.

    What was drawn or given is a person's word as a whole. What was chosen is one of the outlines
    that were found, and a point is a later word on it.
    """
    if _drawn(previous):
        return "was drawn by hand"
    if previous.field.method == "boundary":
        return "is a parcel of your own"
    if _without_record(previous):
        return "may be drawn by hand, for the file has lost the record of what was found"
    return None


def _drawn(previous: Plan) -> bool:
    return previous.outline_edited or previous.field.method == "drawn"


def _without_record(previous: Plan) -> bool:
    """Whether nobody can tell what the outline was like when it was written."""
    return previous.evidence.outline is None and previous.field.method not in _GIVEN


def kept_outline(previous: Plan) -> Field:
    """The outline of an earlier plan that a new one keeps."""
    method = "drawn" if drew_outline(previous) else previous.field.method
    return replace(previous.field, method=method, quality=None)


def renamed(field: Field, previous: Plan) -> Field:
    """A field in the place of an earlier plan's: the names and columns that a person gave stay."""
    known = previous.field
    if field.method == "boundary" and not same_shapes([field.polygon], [known.polygon])[0]:
        # Another parcel, whose name is its own where it has one.
        given = field.name != field.field_id
        own = {**dict(known.own), **dict(field.own)}
        return replace(field, name=field.name if given else known.name, own=tuple(own.items()))
    own = {**dict(field.own), **dict(known.own)}
    return replace(field, field_id=known.field_id, name=known.name, own=tuple(own.items()))


def field_changes(previous: Plan, field: Field, *, kept: bool) -> tuple[str, ...]:
    """What became of an earlier plan's outline, and what does of its tracks, in words."""
    return (_outline_changed(previous, field, kept=kept), *tracks_come_back(previous))


def _outline_changed(previous: Plan, field: Field, *, kept: bool) -> str:
    if kept and not _drawn(previous) and _without_record(previous):
        return (
            "outline kept, for the file has lost the record of what was written (as copies made "
            "by other programs do) and it may be yours; obstacles deleted there may be found "
            "again, and tracks changed there are planned anew"
        )
    if kept:
        return "your outline kept"
    if previous.field.crs != field.crs:
        return "outline found anew"
    before, after = previous.field.polygon, field.polygon
    other = before.symmetric_difference(after).area / before.union(after).area
    return "outline as before" if other < 1e-9 else f"outline other by {other:.1%} of its area"


def of_the_same_field(previous: Plan | None, lat: float, lon: float) -> Plan | None:
    """An earlier plan where it is of the field at a point.

    Raises
    ------
    FieldError, ObstacleError
        When a person's work would be lost: on another field, or in a layer that is gone.
    """
    if previous is None or not holds(previous, lat=lat, lon=lon):
        if previous is not None:
            _refuse_to_forget(previous, lat, lon)
        return None
    refuse_lost_obstacles(previous)
    return previous


def known_outline(
    boundary: Field | None, previous: Plan | None, lat: float, lon: float
) -> Field | None:
    """The outline that is there before a picture is looked at: a person's own, or a parcel."""
    refuse_other(boundary, Field | None, "boundary", MAKE_ONE, FieldError)
    refuse_other(previous, Plan | None, "previous", "Read it: gf.read_plan(path).")
    if previous is None or not holds(previous, lat=lat, lon=lon):
        return boundary
    stands = keeps_outline(previous) if boundary is None else drew_outline(previous)
    return previous.field if stands else boundary


def holds(previous: Plan, *, lat: float, lon: float) -> bool:
    """Whether an earlier plan is of the field at a point."""
    x, y = transformer(LONLAT, previous.field.crs).transform(lon, lat)
    return bool(shapely.Polygon(previous.field.polygon.exterior).covers(shapely.Point(x, y)))


def _refuse_to_forget(previous: Plan, lat: float, lon: float) -> None:
    """Another field's plan may be replaced, but not a person's work on it."""
    work = list(_work_on(previous))
    if work:
        raise FieldError(
            f"The earlier plan there is of another field ({previous.field.name}; lat {lat}, lon "
            f"{lon} lies outside it) and holds {', '.join(work)}.",
            hint="Choose another folder, or --fresh to forget that work.",
        )


def is_planned(plan: Plan) -> bool:
    """Whether field, obstacles and tracks are those that the last stage recorded."""
    obstacles, written = plan.obstacles, plan.evidence.written
    if plan.outline_edited or plan.track_edits != plan.evidence.track_edits:
        return False
    if obstacles is None:
        return True
    if written is None:
        return bool(obstacles["obstacle_no"].notna().all() and obstacles["status"].notna().all())
    with listening():
        return reconcile(obstacles, written, plan.grid)[1] == written


def _work_on(plan: Plan) -> Iterator[str]:
    """What a person did on a plan, in words."""
    columns = {name for name, _ in plan.field.own}
    if plan.obstacles is not None:
        _, written = reconcile(plan.obstacles, plan.evidence.written)
        reviewed = sum(row.kept for row in written.rows) + len(written.removed)
        if reviewed:
            yield counted(reviewed, "reviewed obstacle")
        columns.update(schema.own_columns(schema.OBSTACLES, plan.obstacles))
    if _drawn(plan) or plan.field.method in _GIVEN:
        yield "an outline drawn by hand"
    tracks = plan.track_edits
    edited = [*tracks.edits, *tracks.apart]
    if edited:
        yield counted(len(edited), "edited track")
    said = len(points_said(plan.settings))
    if said:
        yield f"{counted(said, 'point')} said of its outline"
    if plan.field.name != plan.field.field_id:
        yield "a name"
    if columns or tracks.beside:
        yield "columns of your own"


def refuse_lost_obstacles(plan: Plan, *, searched: bool = True) -> None:
    """A layer of obstacles that is gone is a slip and no word, with a person's work in it.

    Where they are not `searched` for again it is with any: tracks would run through them.
    """
    written = plan.evidence.written
    if plan.obstacles is not None or written is None:
        return
    said = sum(row.kept for row in written.rows) + len(written.removed)
    lost = f"{said} that a person reviewed, drew or took away" if said else ""
    if not (said or searched):
        lost = f"{len(written.rows)} that were found" if written.rows else ""
    if lost:
        raise ObstacleError(
            f"The layer `obstacles` of {plan.field.name} is gone, with {lost}.",
            hint="Give it back its name, or `geofield undo`; to have none, delete its rows alone.",
        )


def tracks_come_back(plan: Plan) -> tuple[str, ...]:
    """What an emptied layer of tracks means for those that are planned next, in words."""
    if plan.tracks is None or not plan.tracks.emptied:
        return ()
    names = " and ".join(f"`{name}`" for name in plan.tracks.emptied)
    return (
        f"no planned track was left in {names}: that is no word on any one of them, and they come "
        "back (to drive only what you draw: draw it, plan, then delete the others)",
    )


def read_track_edits(plan: Plan) -> TrackEdits:
    """What a person changed of a plan's tracks; two words on one track, and what goes, are told.

    Warns
    -----
    TrackWarning
    """
    twice = () if plan.tracks is None else plan.tracks.changed_twice
    if twice:
        numbers = ", ".join(map(str, twice))
        warn(
            f"Changed in both `tracks` and `segments`, in each another way: track {numbers}. What "
            "`segments` has of it counts; change it there again where that is not what you want.",
            TrackWarning,
        )
    _warn_of_empty_columns(plan)
    return plan.track_edits


def _warn_of_empty_columns(plan: Plan) -> None:
    """Columns beside tracks are found again by what stands in them: an empty one is not."""
    if plan.tracks is None:
        return
    of_layer = ((schema.TRACKS, plan.tracks.lines), (schema.SEGMENTS, plan.tracks.segments))
    for layer, rows in of_layer:
        names = empty_columns(layer, rows)
        if names and len(rows):
            warn(
                f"Nothing stands in {', '.join(names)} of `{layer.name}`: an empty column of your "
                "own goes when tracks are planned anew. Add it again and write into one row.",
                TrackWarning,
            )


def warn_of_unsearched(evidence: Evidence) -> None:
    """Tell of ground that an outline gained after obstacles were searched."""
    for doubt in evidence.unsearched:
        warn(
            f"{doubt} `geofield obstacles PICTURE PLAN` searches it; then plan the tracks again.",
            ObstacleWarning,
        )
