"""The outline found again from what a person says of the ground: this belongs, that does not.

What was searched once is kept, so that every further click costs only what it changes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import shapely

from geofield.crs import GEOD, LONLAT, transformer
from geofield.earlier import bars_points
from geofield.model.evidence import outline_record
from geofield.model.scene import Scene
from geofield.plan import Plan
from geofield.review.commands import Command, EditError, on_the_picture, places_of
from geofield.settings import Settings

#: Clicks nearer than this are on the same place, metres.
_SAME_M = 2.0
#: What the field is called, and the picture behind it.
_KEPT = ("name", "field_id", "own", "imagery", "imagery_date", "licence")


class Ground:
    """The picture of a plan, searched for outlines; it is read at the first click."""

    def __init__(self, read: Callable[[Plan], Scene]) -> None:
        self._read = read
        self._scene: Scene | None = None
        self._search: Any = None

    def find(self, plan: Plan, command: Command) -> Plan:
        """The plan with the outline that follows from a further point.

        The command has ``place``, x and y in the plan's metric CRS, and ``belongs``, true or false.

        Raises
        ------
        EditError
            Without a place, and where the outline is a person's own: a point would lose it.
        GeofieldError
            When the place lies outside the picture or contradicts an earlier one.
        """
        ((x, y),) = places_of([command.get("place")])
        on_the_picture(plan, shapely.Point(x, y))
        barred = bars_points(plan)
        if barred is not None:
            raise EditError(
                f"The outline {barred}: no point changes it.",
                hint="Correct it with Edit outline, or draw it anew.",
            )
        # Searching needs the most libraries of all, and most sessions never do it.
        from geofield.field import extract_field, prepare_field

        lon, lat = transformer(plan.field.crs, LONLAT).transform(x, y)
        settings = plan.settings or Settings()
        said = settings.field
        sides = ("include", "exclude") if command.get("belongs") else ("exclude", "include")
        place = (round(lon, 8), round(lat, 8))
        # The last word on a place counts.
        other = [one for one in getattr(said, sides[1]) if _metres_apart(one, place) > _SAME_M]
        points = {sides[0]: (*getattr(said, sides[0]), place), sides[1]: tuple(other)}
        said = said.model_copy(update={**points, "method": "auto"})
        lat0, lon0 = plan.point
        if self._scene is None:
            self._scene = self._read(plan)
            self._search = prepare_field(self._scene, lat=lat0, lon=lon0)
        found = extract_field(
            self._scene, lat=lat0, lon=lon0, search=self._search, **said.model_dump()
        )
        found = replace(found, **{name: getattr(plan.field, name) for name in _KEPT})
        return replace(
            plan,
            field=found,
            settings=settings.model_copy(update={"field": said}),
            evidence=replace(
                plan.evidence, outline=outline_record(found.polygon), point=(lat0, lon0)
            ),
        )


def _metres_apart(one: tuple[float, float], other: tuple[float, float]) -> float:
    """Between two places, longitude and latitude."""
    return float(GEOD.line_length([one[0], other[0]], [one[1], other[1]]))
