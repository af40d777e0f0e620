"""A part of a picture, as an outline is searched in it: cut out, and enlarged where it is small.

Sides, tolerances and what is compared beside a border are so many pixels wide, whatever a pixel is
on the ground. In a picture of 128 pixels of 1.2 m, or 51 of 3 m, they are too wide for a field.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import shapely
from shapely import Polygon

from geofield.model import Scene
from geofield.model.frame import Shown
from geofield.raster import resample

#: A part should have about so many pixels along its longer side.
ENOUGH_PX = 256
#: Pixels are cut into so many along a side at most: what is smaller shows too little.
MOST = 8
#: Share of an outline along the sides of its part from which the field goes on beyond them.
CUT_SHARE = 0.02


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a picture.

    Attributes
    ----------
    box : (int, int, int, int)
        First column and row, width and height, pixels of the whole picture.
    picture_px : (int, int)
        Width and height of the whole picture.
    times : int
        So many pixels are made along one.
    """

    box: tuple[int, int, int, int]
    picture_px: tuple[int, int]
    times: int = 1

    @classmethod
    def whole(cls, scene: Scene) -> Part:
        """All of a picture as it is."""
        size = scene.grid.width_px, scene.grid.height_px
        return cls((0, 0, *size), size)

    def magnified(self) -> Part:
        """In about 256 pixels, where it has but two thirds of them or fewer."""
        times = min(round(ENOUGH_PX / max(self.box[2:])), MOST)
        return replace(self, times=max(times, 1))

    def of(self, scene: Scene) -> Scene:
        """The part of the picture.

        Interpolated between pixels (bilinear); a pixel without data stays one, cut into several.
        """
        if self.box[2:] != self.picture_px:
            scene = scene.crop(*self.box)
        if self.times == 1:
            return scene
        bands = [resample(band.astype(np.float32), 1 / self.times) for band in scene.bands]
        size = self.times * scene.grid.width_px, self.times * scene.grid.height_px
        return replace(
            scene,
            grid=scene.grid.resized(*size),
            bands=np.rint(bands).astype(np.uint8),
            valid=scene.valid.repeat(self.times, axis=0).repeat(self.times, axis=1),
        )

    def to_picture(self, polygon: Polygon) -> Polygon:
        """A polygon, pixel coordinates of the part, in those of the whole picture."""
        return shapely.transform(polygon, lambda xy: xy / self.times + self.box[:2])

    def from_picture(self, shown_px: Shown | None) -> Shown | None:
        """Where the whole picture has data, if that is known, pixel coordinates of the part."""
        return shapely.transform(shown_px, lambda xy: self.times * (xy - self.box[:2]))

    @property
    def frame_px(self) -> Polygon:
        """The whole picture's frame, pixel coordinates of the part."""
        return cast(Polygon, self.from_picture(shapely.box(0, 0, *self.picture_px)))

    @property
    def sides_inside(self) -> tuple[bool, bool, bool, bool]:
        """Whether its left, top, right and lower side lie within the picture."""
        left, top, width, height = self.box
        columns, rows = self.picture_px
        return left > 0, top > 0, left + width < columns, top + height < rows

    def cuts(self, outline_px: Polygon, near_px: float) -> bool:
        """Whether an outline runs along sides that lie within the picture: it goes on beyond.

        Parameters
        ----------
        outline_px : Polygon
            Pixel coordinates of the part.
        near_px : float
            How near to a side it runs along it.
        """
        width, height = (self.times * length for length in self.box[2:])
        sides = (near_px, near_px, width - near_px, height - near_px)
        beyond = (-near_px, -near_px, width + near_px, height + near_px)
        within = shapely.box(*np.where(self.sides_inside, sides, beyond))
        along = shapely.length(outline_px.exterior.difference(within))
        return bool(along > CUT_SHARE * outline_px.exterior.length)
