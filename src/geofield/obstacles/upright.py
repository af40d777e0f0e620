"""A picture that is read in parts, as it lies with north above."""

from __future__ import annotations

from dataclasses import dataclass

from geofield.grid import Grid
from geofield.model.scene import Scene
from geofield.model.upright import Turn
from geofield.obstacles.picture import Picture, PictureReader


def turned(picture: Picture, turn: Turn) -> Picture:
    """Return a picture turned, a reader as one whose windows are."""
    if not turn:
        return picture
    return turn.scene(picture) if isinstance(picture, Scene) else _Turned(picture, turn)


@dataclass(frozen=True, slots=True)
class _Turned:
    """A reader whose windows are read turned."""

    reader: PictureReader
    turn: Turn

    @property
    def grid(self) -> Grid:
        """Of the whole picture, turned."""
        return self.turn.grid(self.reader.grid)

    def read(
        self,
        window: tuple[int, int, int, int] | None = None,
        *,
        shape_px: tuple[int, int] | None = None,
        scaling: tuple[float, float] | None = None,
        nir_scaling: tuple[float, float] | None = None,
    ) -> Scene:
        """Read a window (column, row, width, height) of the turned picture."""
        if window is not None:
            window = self.turn.window_back(window)
        if shape_px is not None and self.turn.exchanged:
            shape_px = shape_px[1], shape_px[0]
        part = self.reader.read(window, shape_px=shape_px, scaling=scaling, nir_scaling=nir_scaling)
        return self.turn.scene(part)
