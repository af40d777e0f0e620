"""A picture as it lies with north above and east to the right, whichever way its file runs.

No search is quite even-handed: turned upside down, the same picture gives outlines and centres some
tenths of a metre away, more where a network has learned where shadows fall. One place has one
answer when it is always seen the same way round. Rows and columns are exchanged and turned round,
nothing is resampled; a picture that lies askew is brought to within an eighth of a turn of north.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import shapely
from affine import Affine
from numpy.typing import NDArray

from geofield.grid import Grid
from geofield.model.circles import Circles
from geofield.model.scene import Scene

Value = TypeVar("Value", np.uint8, np.bool_)


@dataclass(frozen=True, slots=True)
class Turn:
    """What is done to a picture's array: its axes exchanged, then columns and rows turned round.

    Attributes
    ----------
    exchanged, columns, rows : bool
    shape : (int, int)
        Rows and columns of the picture as it lies.
    """

    exchanged: bool
    columns: bool
    rows: bool
    shape: tuple[int, int]

    @classmethod
    def upright(cls, grid: Grid) -> Turn:
        """Return the turn after which x runs to the east and y to the south, on the ground."""
        x, y = grid.width_px / 2, grid.height_px / 2
        cross = np.array([[x - 0.5, y], [x + 0.5, y], [x, y - 0.5], [x, y + 0.5]])
        (west, east, above, below) = grid.to_metric_array(cross)
        (a, d), (b, e) = east - west, below - above
        exchanged = bool(abs(b) + abs(d) > abs(a) + abs(e))
        to_east, to_south = (b, -d) if exchanged else (a, -e)
        return cls(exchanged, bool(to_east < 0), bool(to_south < 0), grid.shape)

    def __bool__(self) -> bool:
        return self.exchanged or self.columns or self.rows

    @property
    def _sides(self) -> tuple[int, int]:
        """Columns and rows of the turned picture."""
        return self.shape if self.exchanged else self.shape[::-1]

    def grid(self, grid: Grid) -> Grid:
        """Return the grid of a turned picture, or of a turned part of it."""
        rows, cols = grid.shape
        transform = grid.transform
        if self.exchanged:
            rows, cols = cols, rows
            transform @= Affine(0, 1, 0, 1, 0, 0)
        if self.columns:
            transform @= Affine(-1, 0, cols, 0, 1, 0)
        if self.rows:
            transform @= Affine(1, 0, 0, 0, -1, rows)
        return Grid(cols, rows, transform, grid.crs)

    def array(self, array: NDArray[Value]) -> NDArray[Value]:
        """Return an array (..., rows, columns) turned."""
        if self.exchanged:
            array = np.swapaxes(array, -1, -2)
        if self.columns:
            array = array[..., ::-1]
        if self.rows:
            array = array[..., ::-1, :]
        return np.ascontiguousarray(array)

    def scene(self, scene: Scene) -> Scene:
        """Return a picture, or a part of one, turned."""
        if not self:
            return scene
        return replace(
            scene,
            grid=self.grid(scene.grid),
            bands=self.array(scene.bands),
            valid=self.array(scene.valid),
        )

    def window_back(self, window: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
        """Return where a window (column, row, width, height) of the turned picture lies."""
        column, row, width, height = window
        across, down = self._sides
        if self.columns:
            column = across - column - width
        if self.rows:
            row = down - row - height
        return (row, column, height, width) if self.exchanged else (column, row, width, height)

    def points_back(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return where pixel positions (n, 2) of the turned picture lie."""
        across, down = self._sides
        x, y = points[:, 0], points[:, 1]
        x, y = across - x if self.columns else x, down - y if self.rows else y
        return np.column_stack([y, x] if self.exchanged else [x, y])

    def circles_back(self, circles: Circles) -> Circles:
        """Return where circles of the turned picture lie."""
        if not self:
            return circles
        x, y = self.points_back(np.column_stack([circles.x_px, circles.y_px])).T
        return Circles(x, y, circles.radius_px, circles.strength)

    def shapes_back(self, shapes: list[shapely.Polygon]) -> list[shapely.Polygon]:
        """Return where shapes of the turned picture lie."""
        return [shapely.transform(each, self.points_back) for each in shapes] if self else shapes


def upright(scene: Scene) -> Scene:
    """Return a picture with north above; one that lies so already as it is."""
    return Turn.upright(scene.grid).scene(scene)
