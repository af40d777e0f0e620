"""Views: in which part of the picture an outline is searched.

What network and figures know are grounds that fill a good part of the picture they see, and they
were learned from pictures of 150 m. So the search begins in a part of that size around the point.
Where the outline runs out of it, a part twice as wide is looked at, at last the whole picture: a
field in a wide picture is found as well as in a narrow one.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from shapely import Polygon, affinity

from geofield.errors import FieldError, PointOutsideError
from geofield.field.learned import Learned, shipped
from geofield.field.looks import Seen, seen
from geofield.field.morphology import part_at
from geofield.field.network import SIDE_PX
from geofield.field.part import Part
from geofield.field.points import Points, without_last
from geofield.field.search import WindowSearch, search_field
from geofield.grid import Grid
from geofield.model import Scene

#: Longitude and latitude, degrees.
Places = tuple[tuple[float, float], ...]

#: Side of the first view, metres, and the fewest pixels of one.
FIRST_M, FEWEST_PX = 150.0, 48
#: A view of this share of the picture's longer side is the whole picture.
_WHOLE = 0.75
#: How near to a side of its view an outline runs along it, pixels of the search; share of its
#: border there from which the network's ground is taken to go on beyond.
_NEAR_PX, _GOES_ON = 1.5, 0.25
#: Every so many pixels tell one picture from another.
_SAMPLE_PX = 4


@dataclass(frozen=True, eq=False)
class View:
    """A part of a picture, and the search in it."""

    part: Part
    search: WindowSearch

    def cuts(self, outline_px: Polygon) -> bool:
        """Whether an outline, pixels of the search, runs along sides within the picture."""
        factor = self.search.factor
        whole = affinity.scale(outline_px, factor, factor, origin=(0, 0))
        return self.part.cuts(whole, _NEAR_PX * factor)


@dataclass(eq=False)
class FieldSearch:
    """What was searched around a point in a picture, kept for further points.

    It can be pickled, and asked again with the same picture.

    Attributes
    ----------
    lonlat : (float, float)
        The point, degrees.
    learned : Learned
        The network and the ranking that are asked.
    views : dict
        By their level: 0 is the narrowest.
    levels : dict
        Which one was taken, by the points that belong and those that do not.
    picture : (Grid, int) or None
        That was searched: where it lies, and a checksum of some of its pixels.
    """

    lonlat: tuple[float, float]
    learned: Learned = field(default_factory=shipped)
    views: dict[int, View] = field(default_factory=dict)
    levels: dict[tuple[Places, Places], int] = field(default_factory=dict)
    picture: tuple[Grid, int] | None = None

    def refuse_another(self, scene: Scene, lonlat: tuple[float, float]) -> None:
        """Refuse a picture or a point that is not the one of the search.

        Raises
        ------
        FieldError
        """
        picture = scene.grid, zlib.crc32(scene.bands[:, ::_SAMPLE_PX, ::_SAMPLE_PX].tobytes())
        if self.picture not in (None, picture) or self.lonlat != lonlat:
            raise FieldError(
                "The search that is given was prepared for another picture or point, or "
                "smoothed otherwise.",
                hint="Prepare one for each: gf.prepare_field(scene, lat=lat, lon=lon).",
            )
        self.picture = picture

    def view(self, scene: Scene, include: Places = (), exclude: Places = ()) -> View:
        """The narrowest view that holds the points and the outline.

        It is never narrower than the one with fewer points: what they corrected is kept there.

        Raises
        ------
        FieldError
            When the picture is too small.
        """
        return self._at(scene, self._level(scene, include, exclude))

    def _level(self, scene: Scene, include: Places, exclude: Places) -> int:
        points = include, exclude
        if points in self.levels:
            return self.levels[points]
        shorter = without_last(include, exclude)
        known = [one for one in shorter if one in self.levels]
        level = self._level(scene, *(known or shorter)[0]) if shorter else 0
        last = len(self._parts(scene)) - 1
        while level < last and not self._holds(scene, level, *points):
            level += 1
        self.levels[points] = level
        return level

    def _holds(self, scene: Scene, level: int, include: Places, exclude: Places) -> bool:
        """Whether the points and the outline that they give lie within a view."""
        part = self._parts(scene)[level]
        seen_part = part.of(scene)
        try:
            seed, *belong = (seen_part.pixel_of(lat=y, lon=x) for x, y in (self.lonlat, *include))
            apart = tuple(seen_part.pixel_of(lat=y, lon=x) for x, y in exclude)
            points = (seed, *belong), apart
            looks = None
            if level not in self.views:
                looks = seen(seen_part, self.learned.network, part.times)
                if _ground_goes_on(looks, part, *points):
                    return False
            view = self._at(scene, level, looks)
        except (FieldError, PointOutsideError):
            return False
        search = view.search
        _, taken = search.answer(
            *(tuple(search.place(*at) for at in places) for places in (belong, apart))
        )
        return taken is not None and not view.cuts(taken.candidate.polygon)

    def _at(self, scene: Scene, level: int, looks: Seen | None = None) -> View:
        """The view of a level, by what the network has seen there where that is known."""
        if level not in self.views:
            part = self._parts(scene)[level]
            seen_part = part.of(scene)
            lon, lat = self.lonlat
            seed = seen_part.pixel_of(lat=lat, lon=lon)
            looks = looks or seen(seen_part, self.learned.network, part.times)
            search = search_field(seen_part, *seed, learned=self.learned, looks=looks)
            self.views[level] = View(part, search)
        return self.views[level]

    def _parts(self, scene: Scene) -> Sequence[Part]:
        """The narrowest first: each twice as wide, the last one is the whole picture."""
        lon, lat = self.lonlat
        place = scene.pixel_of(lat=lat, lon=lon)
        size = scene.grid.width_px, scene.grid.height_px
        side = max(FIRST_M / scene.grid.ground_resolution_m, FEWEST_PX)
        parts = []
        while side < _WHOLE * max(size):
            width, height = (min(round(side), most) for most in size)
            left, top = (
                min(max(round(at - length / 2), 0), most - length)
                for at, length, most in zip(place, (width, height), size, strict=True)
            )
            parts.append(Part((left, top, width, height), size))
            side *= 2
        return [part.magnified() for part in (*parts, Part.whole(scene))]


def _ground_goes_on(looks: Seen, part: Part, include: Points, exclude: Points) -> bool:
    """Whether the network's ground goes on beyond sides of a part that lie within the picture.

    It is asked long before an outline is found.
    """
    width, height = (part.times * length for length in part.box[2:])
    factor = math.ceil(max(width, height) / SIDE_PX)
    belong, apart = (
        tuple((x / factor, y / factor) for x, y in points) for points in (include, exclude)
    )
    shape = math.ceil(height / factor), math.ceil(width / factor)
    likely = looks.probability(belong, apart, shape, factor)
    ground = np.pad(part_at(likely > 0.5, *belong[0]), 1)
    if not ground.any():
        return False
    around = sum(int(np.count_nonzero(np.diff(ground, axis=axis))) for axis in (0, 1))
    sides = (ground[:, 1], ground[1], ground[:, -2], ground[-2])
    inside = zip(sides, part.sides_inside, strict=True)
    return sum(int(side.sum()) for side, counts in inside if counts) > _GOES_ON * around
