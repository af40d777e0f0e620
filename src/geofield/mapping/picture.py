"""The map picture: outline, obstacles and tracks drawn on the scene.

This is the study's graphical annotation (METHOD.md, section 5): obstacles as circles,
tracks as dotted lines. It is a picture for people; the geodata are in the other products.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from affine import Affine
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from geofield import schema, theme
from geofield.grid import Grid
from geofield.mapping.labels import OBSTACLE_LOOK, TRACK_LOOK, Label, Look, draw_labels
from geofield.mapping.panel import FRAME_DASH, GROUND, Colour, Dash, dashes, with_panel
from geofield.model.dataset import Dataset
from geofield.model.map_words import frame_lines
from geofield.model.scene import Scene

if TYPE_CHECKING:
    import geopandas as gpd

#: Left, top, right and bottom of a picture, its pixels.
Margins = tuple[int, int, int, int]

_CASING: Colour = (0, 0, 0, 150)

#: The long side of the picture's map part, pixels.
LONG_SIDE_PX = 1400
#: Drawn this much larger, then reduced: smooth lines.
_OVERSAMPLING = 2
#: At most this many numbers along the tracks' starts.
_MAX_LABELS = 40


def draw_map(
    dataset: Dataset, scene: Scene | None = None, *, long_side_px: int = LONG_SIDE_PX
) -> Image.Image:
    """Draw the tables of a dataset on its picture, or on plain ground where there is none.

    The map part, its long side of so many pixels, has a panel below: legend, scale, north, figures,
    attribution.
    """
    margins = (0, 0, 0, 0) if scene is None else _margins_px(dataset, scene.grid)
    grid = _plain_grid(dataset) if scene is None else _widened(scene.grid, margins)
    scale = long_side_px / max(grid.width_px, grid.height_px)
    size = (max(1, round(grid.width_px * scale)), max(1, round(grid.height_px * scale)))
    canvas = _Canvas(grid, size, dataset)
    if scene is not None:
        canvas.picture(scene, margins)
    canvas.tables()
    picture = canvas.finish()
    return with_panel(picture, dataset, grid, scale)


def _plain_grid(dataset: Dataset) -> Grid:
    """A grid around the field with a margin, where there is no picture."""
    x0, y0, x1, y1 = dataset.table(schema.FIELD.name).total_bounds
    margin = 0.06 * max(x1 - x0, y1 - y0)
    x0, y0, x1, y1 = x0 - margin, y0 - margin, x1 + margin, y1 + margin
    resolution = max(x1 - x0, y1 - y0) / 1000
    width, height = math.ceil((x1 - x0) / resolution), math.ceil((y1 - y0) / resolution)
    return Grid(width, height, Affine(resolution, 0, x0, 0, -resolution, y1), dataset.crs)


def _margins_px(dataset: Dataset, grid: Grid) -> Margins:
    """What must be added to a picture to show what goes on outside it."""
    shapes = [dataset.table(name).geometry for name in ("field", "turns", "route")]
    xy = np.concatenate([shapely.get_coordinates(shape.to_numpy()) for shape in shapes])
    x, y = grid.from_crs(xy[:, 0], xy[:, 1], dataset.crs)
    past = (-x.min(), -y.min(), x.max() - grid.width_px, y.max() - grid.height_px)
    side = max(grid.width_px, grid.height_px)
    # A picture of another place is not drawn as a speck.
    left, top, right, bottom = (
        0 if beyond < -0.02 * side else math.ceil(min(beyond + 0.03 * side, 2.0 * side))
        for beyond in past
    )
    return left, top, right, bottom


def _widened(grid: Grid, margins: Margins) -> Grid:
    left, top, right, bottom = margins
    width, height = grid.width_px + left + right, grid.height_px + top + bottom
    corner = Affine.translation(-left, -top)
    return Grid(width, height, grid.transform @ corner, grid.crs)


class _Canvas:
    """An oversampled picture with the transform from the metric CRS to it."""

    def __init__(self, grid: Grid, size: tuple[int, int], dataset: Dataset) -> None:
        self.grid, self.size, self.dataset = grid, size, dataset
        self.large = (size[0] * _OVERSAMPLING, size[1] * _OVERSAMPLING)
        self.factor = max(self.large) / max(grid.width_px, grid.height_px)
        self.image = Image.new("RGB", self.large, GROUND)
        self.draw = ImageDraw.Draw(self.image, "RGBA")
        self.labels: list[Label] = []

    def picture(self, scene: Scene, margins: Margins) -> None:
        rows, columns = scene.valid.shape
        size = (round(columns * self.factor), round(rows * self.factor))
        # Band by band: of a wide picture, the three together take as much memory as it does.
        small = [
            Image.fromarray(np.where(scene.valid, band, np.uint8(70))).resize(
                size, Image.Resampling.BICUBIC
            )
            for band in scene.rgb_bands
        ]
        left, top = (round(margin * self.factor) for margin in margins[:2])
        self.image.paste(Image.merge("RGB", small), (left, top))

    def tables(self) -> None:
        line = 1.4 * _OVERSAMPLING
        segments = self.dataset.table("segments")
        gaps, around = self.dataset.table("gaps"), self.dataset.table("headland_tracks")
        turns, route = self.dataset.table("turns"), self.dataset.table("route")
        self.lines(gaps.geometry, theme.GAP, line, dash=(5.0, 5.0))
        self.lines(segments.geometry, theme.TRACK, line, dash=(9.0, 4.0))
        self.lines(around.geometry, theme.HEADLAND, line)
        self.lines(route[route["kind"] != "work"].geometry, theme.TURN, line)
        self.lines(turns.geometry, theme.TURN, line)
        self.lines(turns[turns["fits"] == "no"].geometry, theme.UNFIT, 4 * line)
        obstacles = self.dataset.table("obstacles")
        for status, look in theme.STATUS.items():
            part = obstacles[obstacles["status"] == status]
            self.outlines(part.geometry, look.color, 1.6 * _OVERSAMPLING, dash=look.dash)
        outline = self.dataset.table("field").geometry
        self.outlines(outline, theme.OUTLINE, 2.4 * _OVERSAMPLING)
        frame = frame_lines(self.dataset)
        self.lines(frame, "#000000", 3.2 * _OVERSAMPLING)
        self.lines(frame, theme.DOUBT, 2.8 * _OVERSAMPLING, dash=FRAME_DASH)
        self.numbers(obstacles, segments)

    def pixels(self, coordinates: NDArray[np.float64]) -> NDArray[np.float64]:
        x, y = self.grid.from_crs(coordinates[:, 0], coordinates[:, 1], self.dataset.crs)
        return np.column_stack([x, y]) * self.factor

    def lines(
        self, shapes: Iterable[Any], color: str, width: float, dash: Dash | None = None
    ) -> None:
        colour = theme.rgb(color)
        for part in shapely.get_parts(np.array(list(shapes), dtype=object)):
            strokes = self.strokes(part, dash)
            # Dark below, so that a light line shows on light ground, too.
            for stroke in strokes:
                self.draw.line(stroke, fill=_CASING, width=round(width + 1.6 * _OVERSAMPLING))
            for stroke in strokes:
                self.draw.line(stroke, fill=colour, width=round(width))

    def outlines(
        self, shapes: gpd.GeoSeries, color: str, width: float, dash: Dash | None = None
    ) -> None:
        colour, joint = theme.rgb(color), "curve" if dash is None else None
        for ring in shapely.get_rings(shapely.get_parts(shapes.to_numpy())):
            for stroke in self.strokes(ring, dash):
                if dash is None:
                    self.draw.line(stroke, fill=_CASING, width=round(width * 2), joint=joint)
                self.draw.line(stroke, fill=colour, width=round(width), joint=joint)

    def strokes(self, line: Any, dash: Dash | None) -> list[list[float]]:
        """A line, or the drawn pieces of a dashed one, each x, y, x, y."""
        points = self.pixels(shapely.get_coordinates(line))
        if dash is None:
            return [points.ravel().tolist()]
        return dashes(points, dash[0] * _OVERSAMPLING, dash[1] * _OVERSAMPLING)

    def numbers(self, obstacles: gpd.GeoDataFrame, segments: gpd.GeoDataFrame) -> None:
        if len(obstacles) and len(obstacles) <= 150:
            for number, shape in zip(obstacles["obstacle_no"], obstacles.geometry, strict=True):
                x0, y0, x1, y1 = shape.bounds
                middle, aside = (x0 + x1) / 2, 0.38 * (x1 - x0)
                # Of things that overlap each has its number at another corner.
                corners = [(middle + aside * side, y) for y in (y1, y0) for side in (1, -1)]
                self.label(self.pixels(np.array(corners)), number, OBSTACLE_LOOK)
        first = segments.drop_duplicates("track_no")
        step = max(1, math.ceil(len(first) / _MAX_LABELS))
        for number, shape in zip(first["track_no"][::step], first.geometry[::step], strict=True):
            start = self.pixels(shapely.get_coordinates(shape)[:1])
            self.label(start, number, TRACK_LOOK)

    def label(self, places: NDArray[np.float64], number: int, look: Look) -> None:
        at = tuple((float(x), float(y)) for x, y in places / _OVERSAMPLING)
        self.labels.append(Label(at, str(number), look))

    def finish(self) -> Image.Image:
        image = self.image.reduce(_OVERSAMPLING)
        draw_labels(image, self.labels)
        return image
