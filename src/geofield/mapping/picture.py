"""The map picture: outline, obstacles and tracks drawn on the scene.

This is the study's graphical annotation (METHOD.md, section 5): obstacles as circles,
tracks as dotted lines. It is a picture for people; the geodata are in the other products.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from geofield import schema, theme
from geofield.grid import Grid
from geofield.mapping.fonts import written
from geofield.mapping.labels import OBSTACLE_LOOK, TRACK_LOOK, Label, Look, draw_labels
from geofield.model.dataset import Dataset
from geofield.model.map_words import (
    credit_in_words,
    doubts_in_words,
    figures_in_words,
    frame_lines,
    length_in_words,
    round_length_m,
)
from geofield.model.scene import Scene

if TYPE_CHECKING:
    import geopandas as gpd

#: Red, green and blue; a fourth number is the opacity.
Colour = tuple[int, ...]
_Font = ImageFont.FreeTypeFont | ImageFont.ImageFont
#: Line and space, pixels.
Dash = tuple[float, float]
#: Left, top, right and bottom of a picture, its pixels.
Margins = tuple[int, int, int, int]

_CASING: Colour = (0, 0, 0, 150)
#: Where an outline is the picture's frame.
_FRAME_DASH = (9.0, 7.0)
_INK: Colour = (255, 255, 255, 255)
_PANEL: Colour = (20, 24, 28, 215)
_GROUND: Colour = (70, 74, 70)

#: The long side of the picture's map part, pixels.
LONG_SIDE_PX = 1400
#: Drawn this much larger, then reduced: smooth lines.
_OVERSAMPLING = 2
_DOUBT_SIZE = 14
#: A map of a narrower field has plain ground on both sides: its panel needs room for words.
_NARROWEST_PX = 560
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
    return _with_panel(picture, dataset, grid, scale)


def _plain_grid(dataset: Dataset) -> Grid:
    """A grid around the field with a margin, where there is no picture."""
    from affine import Affine

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
    from affine import Affine

    left, top, right, bottom = margins
    width, height = grid.width_px + left + right, grid.height_px + top + bottom
    corner = Affine.translation(-left, -top)
    return Grid(width, height, grid.transform @ corner, grid.crs)


class _Canvas:
    """An oversampled picture with the transform from the metric CRS to it."""

    def __init__(self, grid: Grid, size: tuple[int, int], dataset: Dataset) -> None:
        self.grid, self.size, self.dataset = grid, size, dataset
        self.large = (size[0] * _OVERSAMPLING, size[1] * _OVERSAMPLING)
        self.factor = self.large[0] / grid.width_px
        self.image = Image.new("RGB", self.large, _GROUND)
        self.draw = ImageDraw.Draw(self.image, "RGBA")
        self.labels: list[Label] = []

    def picture(self, scene: Scene, margins: Margins) -> None:
        rgb = scene.rgb.copy()
        rgb[~scene.valid] = 70
        width, height = round(rgb.shape[1] * self.factor), round(rgb.shape[0] * self.factor)
        picture = Image.fromarray(rgb).resize((width, height), Image.Resampling.BICUBIC)
        left, top = (round(margin * self.factor) for margin in margins[:2])
        self.image.paste(picture, (left, top))

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
        self.lines(turns[turns["fits"] == "no"].geometry, theme.UNFIT, 2 * line)
        obstacles = self.dataset.table("obstacles")
        for status, look in theme.STATUS.items():
            part = obstacles[obstacles["status"] == status]
            self.outlines(part.geometry, look.color, 1.6 * _OVERSAMPLING, dash=look.dash)
        outline = self.dataset.table("field").geometry
        self.outlines(outline, theme.OUTLINE, 2.4 * _OVERSAMPLING)
        frame = frame_lines(self.dataset)
        self.lines(frame, "#000000", 3.2 * _OVERSAMPLING)
        self.lines(frame, theme.DOUBT, 2.8 * _OVERSAMPLING, dash=_FRAME_DASH)
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
        return _dashes(points, dash[0] * _OVERSAMPLING, dash[1] * _OVERSAMPLING)

    def numbers(self, obstacles: gpd.GeoDataFrame, segments: gpd.GeoDataFrame) -> None:
        if len(obstacles) and len(obstacles) <= 150:
            for number, shape in zip(obstacles["obstacle_no"], obstacles.geometry, strict=True):
                x0, _, x1, y1 = shape.bounds
                corner = self.pixels(np.array([[(x0 + x1) / 2 + 0.38 * (x1 - x0), y1]]))[0]
                self.label(corner, number, OBSTACLE_LOOK)
        first = segments.drop_duplicates("track_no")
        step = max(1, math.ceil(len(first) / _MAX_LABELS))
        for number, shape in zip(first["track_no"][::step], first.geometry[::step], strict=True):
            start = self.pixels(shapely.get_coordinates(shape)[:1])[0]
            self.label(start, number, TRACK_LOOK)

    def label(self, at: NDArray[np.float64], number: int, look: Look) -> None:
        x, y = (at / _OVERSAMPLING).tolist()
        self.labels.append(Label(x, y, str(number), look))

    def finish(self) -> Image.Image:
        image = self.image.reduce(_OVERSAMPLING)
        draw_labels(image, self.labels)
        return image


def _dashes(points: NDArray[np.float64], on: float, off: float) -> list[list[float]]:
    """The drawn pieces of a dashed line through points, each x, y, x, y."""
    pieces: list[list[float]] = []
    for a, b in itertools.pairwise(points):
        length = float(np.hypot(*(b - a)))
        if length == 0:
            continue
        starts = np.arange(0.0, length, on + off)
        ends = np.minimum(starts + on, length)
        direction = (b - a) / length
        pieces += np.hstack([a + at[:, None] * direction for at in (starts, ends)]).tolist()
    return pieces


def _with_panel(picture: Image.Image, dataset: Dataset, grid: Grid, scale: float) -> Image.Image:
    """The picture with a panel below it, wide enough for the panel's words."""
    width = max(picture.width, _NARROWEST_PX)
    entries = _legend_entries(dataset)
    step, rows = _legend_size(entries, width)
    legend_right = 16 + step * math.ceil(len(entries) / rows)
    figures = [written(text, _figure_size(n)) for n, text in enumerate(figures_in_words(dataset))]
    beside = legend_right + max(font.getlength(text) for text, font in figures) + 16 <= width
    below = (
        [] if beside else [(t, font) for text, font in figures for t in _wrapped(text, font, width)]
    )
    doubt_font = ImageFont.load_default(_DOUBT_SIZE)
    doubts = [
        line for told in doubts_in_words(dataset) for line in _wrapped(told, doubt_font, width)
    ]
    credit, credit_font = written(credit_in_words(dataset), 12)
    owners = _wrapped(credit, credit_font, width)
    legend_height = 26 + 22 * rows
    panel_height = (
        legend_height + 22 * len(below) + 18 * len(doubts) + 16 * max(len(owners) - 1, 0) + 14
    )
    image = Image.new("RGB", (width, picture.height + panel_height), _PANEL[:3])
    draw = ImageDraw.Draw(image)
    top, left = picture.height, (width - picture.width) // 2
    draw.rectangle([0, 0, width, top - 1], fill=_GROUND)
    image.paste(picture, (left, 0))
    _scale_bar(draw, grid, scale, left + picture.width - 30, top - 22)
    _north_arrow(draw, grid, left + picture.width - 42, 46)
    _legend(draw, entries, 16, top + 14, step, rows)
    if beside:
        for index, (text, font) in enumerate(figures):
            place = (width - 16, top + 14 + 22 * index)
            draw.text(place, text, font=font, fill=_INK[:3], anchor="rm")
    top += legend_height - 12
    for text, font in below:
        draw.text((16, top), text, font=font, fill=_INK[:3], anchor="lm")
        top += 22
    for number, line in enumerate(doubts):
        place = (16, top + 12 + 18 * number)
        draw.text(place, line, font=doubt_font, fill=theme.rgb(theme.DOUBT), anchor="ls")
    for number, line in enumerate(reversed(owners)):
        place = (16, image.height - 12 - 16 * number)
        draw.text(place, line, font=credit_font, fill=(190, 195, 200), anchor="ls")
    return image


def _figure_size(number: int) -> int:
    """The size of the letters of a line of figures: the first one holds the field's name."""
    return 16 if number == 0 else 14


def _legend_size(entries: Sequence[tuple[str, str, Dash | None]], width: int) -> tuple[int, int]:
    """Width of a column, pixels, and rows of a legend that fits a width."""
    font = ImageFont.load_default(14)
    step = max(190, *(math.ceil(34 + font.getlength(text) + 16) for _, text, _ in entries))
    columns = max(1, (width - 32) // step)
    return step, max(3, math.ceil(len(entries) / columns))


def _legend(
    draw: ImageDraw.ImageDraw,
    entries: Iterable[tuple[str, str, Dash | None]],
    left: int,
    top: int,
    step: int,
    rows: int,
) -> None:
    font = ImageFont.load_default(14)
    for index, (color, text, dash) in enumerate(entries):
        x, y = left + step * (index // rows), top + 22 * (index % rows)
        for piece in _dashes(np.array([[x, y], [x + 26.0, y]]), *(dash or (26.0, 0.0))):
            draw.line(piece, fill=theme.rgb(color), width=3)
        draw.text((x + 34, y), text, font=font, fill=_INK[:3], anchor="lm")


def _legend_entries(dataset: Dataset) -> list[tuple[str, str, Dash | None]]:
    """Colour, words and dashes of what the map shows."""
    statuses = set(dataset.table("obstacles")["status"])
    turns = dataset.table("turns")
    unfit = int((turns["fits"] == "no").sum())
    entries: list[tuple[object, str, str, Dash | None]] = [
        (True, theme.OUTLINE, "field", None),
        (frame_lines(dataset), theme.DOUBT, "goes on outside", _FRAME_DASH),
        *(
            (status in statuses, look.color, f"obstacle, {status}", look.dash)
            for status, look in theme.STATUS.items()
        ),
        (dataset.has("segments"), theme.TRACK, "track", (9.0, 4.0)),
        (dataset.has("gaps"), theme.GAP, "gap", (5.0, 5.0)),
        (dataset.has("headland_tracks"), theme.HEADLAND, "headland", None),
        (len(turns) > unfit, theme.TURN, "turn", None),
        (unfit, theme.UNFIT, f"turn that does not fit ({unfit})", None),
    ]
    return [(color, text, dash) for shown, color, text, dash in entries if shown]


def _wrapped(text: str, font: _Font, width: int) -> list[str]:
    """A text in lines that fit a picture's width, pixels; the further ones are indented."""
    lines: list[str] = []
    line = ""
    for word in re.findall(r"\S+\s*", text):
        if line.strip() and font.getlength((line + word).rstrip()) > width - 32:
            lines.append(line.rstrip())
            line = "    "
        for letter in word:
            # A word that is longer than a line, or a script without spaces.
            if font.getlength((line + letter).rstrip()) > width - 32:
                lines.append(line)
                line = "    "
            line += letter
    return [*lines, line.rstrip()] if line.strip() else lines


def _scale_bar(
    draw: ImageDraw.ImageDraw, grid: Grid, scale: float, right: float, bottom: float
) -> None:
    metres_per_px = grid.ground_resolution_m / scale
    length = round_length_m(180 * metres_per_px)
    left = right - length / metres_per_px
    for width, colour in ((7, (0, 0, 0)), (3, _INK[:3])):
        draw.line([left, bottom, right, bottom], fill=colour, width=width)
    _outlined(draw, ((left + right) / 2, bottom - 7), length_in_words(length), 14, "ms")


def _north_arrow(draw: ImageDraw.ImageDraw, grid: Grid, x: float, y: float) -> None:
    lon, lat = grid.centre_lonlat
    px, py = grid.from_lonlat(lon, min(lat + 1e-4, 90.0))
    dx, dy = px - grid.width_px / 2, py - grid.height_px / 2
    length = math.hypot(dx, dy) or 1.0
    ux, uy = dx / length, dy / length
    tip = (x + 20 * ux, y + 20 * uy)
    left, right = ((x - 20 * ux + s * 9 * uy, y - 20 * uy - s * 9 * ux) for s in (1, -1))
    notch = (x - 11 * ux, y - 11 * uy)
    draw.polygon([tip, left, notch, right], fill=_INK[:3], outline=(0, 0, 0))
    _outlined(draw, (x + 31 * ux, y + 31 * uy), "N", 15, "mm")


def _outlined(
    draw: ImageDraw.ImageDraw, at: tuple[float, float], text: str, size_px: int, anchor: str
) -> None:
    """Write light letters with a dark rim, to be read on any ground."""
    font, rim = ImageFont.load_default(size_px), (0, 0, 0)
    draw.text(at, text, _INK[:3], font, anchor, stroke_width=2, stroke_fill=rim)
