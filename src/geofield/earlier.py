"""What an earlier plan of the same field means for a new one: a person's word stands."""

from __future__ import annotations

import shapely

from geofield.crs import LONLAT, transformer
from geofield.errors import FieldError
from geofield.model.field import Field
from geofield.model.review import reconcile
from geofield.plan import Plan
from geofield.settings import Settings


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


def points_said(settings: Settings | None) -> set[tuple[bool, tuple[float, float]]]:
    """What was said of further places: whether each belongs, and where it is."""
    if settings is None:
        return set()
    belong = {(True, place) for place in settings.field.include}
    return belong | {(False, place) for place in settings.field.exclude}


def keeps_outline(previous: Plan) -> bool:
    """Whether an earlier plan's outline is a person's word."""
    return previous.outline_edited or previous.field.method in ("drawn", "boundary", "chosen")


def outline_changed(previous: Plan, field: Field) -> str:
    """What became of an earlier plan's outline, in words."""
    if keeps_outline(previous) and field.method in ("drawn", previous.field.method):
        return "your outline kept"
    if previous.field.crs != field.crs:
        return "outline found anew"
    before, after = previous.field.polygon, field.polygon
    other = before.symmetric_difference(after).area / before.union(after).area
    return "outline as before" if other < 1e-9 else f"outline other by {other:.1%} of its area"


def holds(previous: Plan, *, lat: float, lon: float) -> bool:
    """Whether an earlier plan is of the field at a point."""
    x, y = transformer(LONLAT, previous.field.crs).transform(lon, lat)
    return bool(shapely.Polygon(previous.field.polygon.exterior).covers(shapely.Point(x, y)))


def refuse_to_forget(previous: Plan, lat: float, lon: float) -> None:
    """Another field's plan may be replaced, but not a person's work on it."""
    reviewed = 0
    if previous.obstacles is not None:
        _, written = reconcile(previous.obstacles, previous.evidence.written)
        reviewed = sum(row.kept for row in written.rows) + len(written.removed)
    if reviewed or keeps_outline(previous):
        work = [f"{reviewed} reviewed obstacles"] if reviewed else []
        work += ["an outline drawn by hand"] if keeps_outline(previous) else []
        raise FieldError(
            f"The earlier plan there is of another field ({previous.field.name}; lat {lat}, lon "
            f"{lon} lies outside it) and holds {' and '.join(work)}.",
            hint="Choose another folder, or --fresh to forget that work.",
        )
