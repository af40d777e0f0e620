"""Edits: each a pure function from a plan and plain JSON values to the plan after it.

A command is a mapping with ``do``, the name of one of :data:`COMMANDS`, and its values. Places
are x, y in the plan's metric CRS. Tracks are not planned here: a session does that once per
edit, whatever the edit was.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from shapely import Polygon

from geofield import schema
from geofield.crs import GEOD, LONLAT, transformer
from geofield.errors import GeofieldError
from geofield.model.evidence import outline_record
from geofield.model.obstacles import circle_polygons, from_polygons
from geofield.model.written import free_number
from geofield.settings import Settings, TrackSettings
from geofield.settings.explain import in_words
from geofield.settings.tracks import said_over

if TYPE_CHECKING:
    import geopandas as gpd

    from geofield.plan import Plan

Command = Mapping[str, Any]


#: No place of a metric CRS, and no length, is beyond it, metres.
_FAR = 1e9


class EditError(GeofieldError):
    """An edit that cannot be made; the plan stays as it is."""


def apply_command(plan: Plan, command: Command) -> Plan:
    """The plan after an edit; its tracks are those of before, to be planned again.

    Planning brings the other columns of an obstacle that was moved or reshaped up to date.

    Raises
    ------
    EditError
        For an unknown edit, an obstacle that is not there, a value that is no number, or a shape
        that crosses itself or lies outside the picture.
    """
    name = command.get("do")
    if not isinstance(name, str) or name not in COMMANDS:
        raise EditError(f"There is no edit {name!r}.", hint=f"Edits: {', '.join(COMMANDS)}.")
    try:
        return COMMANDS[name](plan, command)
    except KeyError as error:
        raise EditError(f"The edit {name!r} needs a value {error}.") from None


def set_status(plan: Plan, command: Command) -> Plan:
    """Confirm or reject an obstacle, or take that back: ``no``, ``status``."""
    status = command["status"]
    if status not in schema.STATUSES:
        raise EditError(
            f"There is no status {status!r}.", hint=f"Statuses: {', '.join(schema.STATUSES)}."
        )
    return _with_row(plan, command, {"status": status})


def add_circle(plan: Plan, command: Command) -> Plan:
    """A round obstacle that nobody had found: ``x``, ``y``, ``radius_m``."""
    x, y, radius_m = _number(command, "x"), _number(command, "y"), _radius(command)
    return _added(plan, shapely.Point(x, y).buffer(radius_m), x, y, radius_m=radius_m)


def add_polygon(plan: Plan, command: Command) -> Plan:
    """An obstacle of any shape, avoided as drawn: ``ring``, a list of x, y."""
    shape = _polygon([command["ring"]], "obstacle")
    centre = shape.centroid
    return _added(plan, shape, centre.x, centre.y, radius_m=None)


def move(plan: Plan, command: Command) -> Plan:
    """Shift an obstacle: ``no``, ``dx_m``, ``dy_m``."""
    row = _row(plan, command)
    dx, dy = _number(command, "dx_m"), _number(command, "dy_m")
    shape = shapely.transform(row.geometry, lambda xy: xy + np.array([dx, dy]))
    return _reshaped(plan, command, shape, {})


def set_radius(plan: Plan, command: Command) -> Plan:
    """Another radius of a round obstacle: ``no``, ``radius_m``."""
    row = _row(plan, command)
    if not math.isfinite(row["radius_m"]):
        raise EditError(
            f"Obstacle {command['no']} is not round.", hint="Draw its shape anew instead."
        )
    radius_m, centre = _radius(command), row.geometry.centroid
    buffer_m = float(np.nan_to_num(row["buffer_m"]))
    shape = circle_polygons(centre.x, centre.y, radius_m + buffer_m, plan.field.crs)[0]
    radius_px = row["radius_px"] * radius_m / row["radius_m"]
    return _reshaped(plan, command, shape, {"radius_m": radius_m, "radius_px": radius_px})


def reshape(plan: Plan, command: Command) -> Plan:
    """The shape of an obstacle as a person drew it: ``no``, ``ring``."""
    # Another buffer_m would be a margin typed for it, by which planning grows what was drawn.
    drawn = {"kind": "other", "radius_m": np.nan, "radius_px": np.nan}
    return _reshaped(plan, command, _polygon([command["ring"]], "obstacle"), drawn)


def delete(plan: Plan, command: Command) -> Plan:
    """Take an obstacle away: what a person drew is gone, what was found becomes rejected."""
    row = _row(plan, command)
    if row["status"] != "added":
        # A row that was only dropped would be found again by the next run.
        return _with_row(plan, command, {"status": "rejected"})
    obstacles = plan.obstacles
    assert obstacles is not None  # noqa: S101 - a row was found in it
    left = obstacles[obstacles["obstacle_no"] != command["no"]].reset_index(drop=True)
    return replace(plan, obstacles=left)


def set_outline(plan: Plan, command: Command) -> Plan:
    """The outline as a person drew it: ``rings``, the outer one first, or the outer ``ring`` alone.

    Where the outer one alone was drawn, what was cut out of the field stays cut out.
    """
    if "ring" in command:
        drawn = _without_holes_of(plan.field.polygon, _polygon([command["ring"]], "outline"))
    else:
        drawn = _polygon(command["rings"], "outline")
    field = replace(plan.field, polygon=drawn)
    if plan.grid is not None:
        frame = Polygon(plan.grid.corners_lonlat())
        if not frame.intersects(field.polygon_lonlat):  # a part may be beyond its edge
            raise EditError("The outline lies outside the picture.", hint="Draw on the picture.")
    return replace(plan, field=field)


def choose(plan: Plan, command: Command) -> Plan:
    """One of the outlines that the search found: ``no``, 1 is the most likely."""
    field = plan.field.choose(_whole(command, "no"))
    # Chosen, not drawn: a further point is a later word on it.
    return replace(
        plan, field=field, evidence=replace(plan.evidence, outline=outline_record(field.polygon))
    )


def set_tracks(plan: Plan, command: Command) -> Plan:
    """Settings of the tracks by their names: ``settings``."""
    given = command["settings"]
    if not isinstance(given, Mapping):
        raise EditError("settings are values by their names.")
    unknown = sorted(set(given) - set(TrackSettings.model_fields))
    if unknown:
        raise EditError(f"Tracks have no setting {unknown[0]!r}.")
    settings = plan.settings or Settings()
    with in_words():
        tracks = TrackSettings(**said_over(settings.tracks.model_dump(), given))
    # Known as a person's word in every later run.
    before, names = settings.tracks, set(plan.evidence.said_tracks)
    names |= {name for name, value in tracks if value != getattr(before, name)}
    return replace(
        plan,
        settings=settings.model_copy(update={"tracks": tracks}),
        evidence=replace(plan.evidence, said_tracks=tuple(sorted(names))),
    )


def set_direction(plan: Plan, command: Command) -> Plan:
    """Tracks along a line that was dragged: ``a``, ``b``, its ends."""
    (ax, ay), (bx, by) = places_of([command["a"], command["b"]])
    if math.hypot(bx - ax, by - ay) < 1.0:
        raise EditError("The line is shorter than a metre: it has no clear direction.")
    lon, lat = transformer(plan.field.crs, LONLAT).transform([ax, bx], [ay, by])
    heading, _, _ = GEOD.inv(lon[0], lat[0], lon[1], lat[1])
    direction = f"{heading % 180.0:.4f}"
    return set_tracks(plan, {"settings": {"direction": direction, "ab_lonlat": None}})


#: Edits by the name that a command gives in ``do``.
COMMANDS: dict[str, Callable[[Plan, Command], Plan]] = {
    "status": set_status,
    "circle": add_circle,
    "polygon": add_polygon,
    "move": move,
    "radius": set_radius,
    "reshape": reshape,
    "delete": delete,
    "outline": set_outline,
    "choose": choose,
    "tracks": set_tracks,
    "direction": set_direction,
}


def _row(plan: Plan, command: Command) -> Any:
    number = _whole(command, "no")
    if plan.obstacles is not None:
        rows = plan.obstacles[plan.obstacles["obstacle_no"] == number]
        if len(rows):
            return rows.iloc[0]
    raise EditError(f"There is no obstacle {number}.")


def _with_row(plan: Plan, command: Command, values: Mapping[str, Any]) -> Plan:
    _row(plan, command)
    obstacles: gpd.GeoDataFrame = plan.obstacles.copy()  # type: ignore[union-attr]
    at = obstacles.index[obstacles["obstacle_no"] == command["no"]][0]
    for name, value in values.items():
        obstacles.at[at, name] = value
    return replace(plan, obstacles=obstacles)


def _reshaped(plan: Plan, command: Command, shape: Any, values: Mapping[str, Any]) -> Plan:
    """A shape or place that a person gave says that the thing is there."""
    on_the_picture(plan, shape)
    status = "added" if _row(plan, command)["status"] == "added" else "confirmed"
    return _with_row(plan, command, {**values, "status": status, "geometry": shape})


def _added(plan: Plan, footprint: Polygon, x: float, y: float, *, radius_m: float | None) -> Plan:
    import pandas as pd

    on_the_picture(plan, footprint)
    # A shape is avoided as it was drawn, in every program; a crown gets the usual margin.
    settings = plan.settings or Settings()
    buffer_m = 0.0 if radius_m is None else settings.obstacles.buffer_m
    crs, before = plan.field.crs, plan.obstacles
    row = from_polygons(
        np.array([footprint], dtype=object),
        crs,
        buffer_m=buffer_m,
        grid=plan.grid,
        status="added",
        first_no=free_number(before, plan.evidence.written),
    )
    if radius_m is not None:
        row["kind"], row["radius_m"] = "tree", radius_m
        row.geometry = circle_polygons([x], [y], [radius_m + buffer_m], crs)
        if plan.grid is not None:
            row["radius_px"] = radius_m / float(
                plan.grid.resolution_at(row["x_px"], row["y_px"])[0]
            )
    parts = [part for part in (before, row) if part is not None and len(part)]
    joined = schema.conform(schema.OBSTACLES, pd.concat(parts), extras=True)
    return replace(plan, obstacles=joined)


def on_the_picture(plan: Plan, shape: Any) -> None:
    """Refuse what lies off the picture: nobody can have seen it there."""
    if plan.grid is None:
        return
    centre = shape.centroid
    x, y = plan.grid.from_crs(centre.x, centre.y, plan.field.crs)
    if not plan.grid.contains_px(float(x), float(y)):
        raise EditError("That place lies outside the picture.", hint="Draw on the picture.")


def _whole(command: Command, name: str) -> int:
    value = command[name]
    if isinstance(value, bool) or not isinstance(value, int):
        raise EditError(f"{name} is not a whole number: {value!r}.")
    return value


def _number(command: Command, name: str) -> float:
    value = command[name]
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < _FAR:
        raise EditError(f"{name} is not a number: {value!r}.")
    return float(value)


def _radius(command: Command) -> float:
    radius_m = _number(command, "radius_m")
    if not 0.1 <= radius_m <= 200.0:
        raise EditError(f"A radius of {radius_m:g} m is outside 0.1 to 200 m.")
    return radius_m


def places_of(values: Any) -> list[tuple[float, float]]:
    """Places, each two numbers, x and y in the metric CRS; an `EditError` for anything else."""
    try:
        places = [(float(x), float(y)) for x, y in values]
    except (TypeError, ValueError, OverflowError):
        raise EditError("A place is two numbers, x and y.") from None
    if not (np.abs(places) < _FAR).all():
        raise EditError("A place is two numbers, x and y.")
    return places


def _without_holes_of(before: Polygon, drawn: Polygon) -> Polygon:
    cut = drawn.difference(shapely.union_all([Polygon(hole) for hole in before.interiors]))
    if not isinstance(cut, Polygon) or cut.is_empty:
        raise EditError(
            "The holes in the outline leave no single piece of what was drawn.",
            hint="Draw wider around them.",
        )
    return shapely.orient_polygons(cut)


def _polygon(rings: Any, what: str) -> Polygon:
    if not isinstance(rings, list) or not rings:
        raise EditError(f"The {what} has no ring.")
    places = [places_of(ring) for ring in rings]
    if any(len(set(ring)) < 3 for ring in places):
        raise EditError(f"The {what} needs at least three corners.")
    polygon = Polygon(places[0], places[1:])
    if not polygon.is_valid:
        raise EditError(
            f"The {what} crosses itself ({shapely.is_valid_reason(polygon)}).",
            hint="Move the corner back, or draw the shape anew.",
        )
    return shapely.orient_polygons(polygon)
