"""The panel below the map picture: legend, figures, doubts, whose picture it is; scale and north.

Words are wrapped, and figures that do not fit beside the legend stand below it: nothing is cut,
and nothing lies on something else.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from geofield import theme
from geofield.grid import Grid
from geofield.mapping.fonts import length_px, write
from geofield.model.dataset import Dataset
from geofield.model.map_words import (
    credit_in_words,
    doubts_in_words,
    figures_in_words,
    frame_lines,
    length_in_words,
    round_length_m,
)

#: Red, green and blue; a fourth number is the opacity.
Colour = tuple[int, ...]
#: Line and space, pixels.
Dash = tuple[float, float]

#: Where an outline is the picture's frame.
FRAME_DASH = (9.0, 7.0)
INK: Colour = (255, 255, 255, 255)
GROUND: Colour = (70, 74, 70)
_PANEL: Colour = (20, 24, 28, 215)
#: From the middle of a line down to where its letters stand.
_DOWN_PX = 5
#: A map of a narrower field has plain ground on both sides: its panel needs room for words.
_NARROWEST_PX = 560


def with_panel(picture: Image.Image, dataset: Dataset, grid: Grid, scale: float) -> Image.Image:
    """The picture with a panel below it, wide enough for the panel's words."""
    width = max(picture.width, _NARROWEST_PX)
    entries = _legend_entries(dataset)
    step, rows = _legend_size(entries, width)
    legend_right = 16 + step * math.ceil(len(entries) / rows)
    # The first one holds the field's name.
    sizes = itertools.chain([16], itertools.repeat(14))
    figures = list(zip(figures_in_words(dataset), sizes, strict=False))
    beside = legend_right + max(length_px(text, size) for text, size in figures) + 16 <= width
    below = (
        [] if beside else [(t, size) for text, size in figures for t in _wrapped(text, size, width)]
    )
    doubts = [line for told in doubts_in_words(dataset) for line in _wrapped(told, 14, width)]
    owners = _wrapped(credit_in_words(dataset), 12, width)
    legend_height = 26 + 22 * rows
    panel_height = (
        legend_height + 22 * len(below) + 18 * len(doubts) + 16 * max(len(owners) - 1, 0) + 14
    )
    image = Image.new("RGB", (width, picture.height + panel_height), _PANEL[:3])
    draw = ImageDraw.Draw(image)
    top, left = picture.height, (width - picture.width) // 2
    draw.rectangle([0, 0, width, top - 1], fill=GROUND)
    image.paste(picture, (left, 0))
    _scale_bar(draw, grid, scale, left + picture.width - 30, top - 22)
    _north_arrow(draw, grid, left + picture.width - 42, 46)
    _legend(draw, entries, 16, top + 14, step, rows)
    if beside:
        for index, (text, size) in enumerate(figures):
            place = (width - 16 - length_px(text, size), top + 14 + 22 * index + _DOWN_PX)
            write(draw, place, text, size, INK[:3])
    top += legend_height - 12
    for text, size in below:
        write(draw, (16, top + _DOWN_PX), text, size, INK[:3])
        top += 22
    for number, line in enumerate(doubts):
        write(draw, (16, top + 12 + 18 * number), line, 14, theme.rgb(theme.DOUBT))
    for number, line in enumerate(reversed(owners)):
        write(draw, (16, image.height - 12 - 16 * number), line, 12, (190, 195, 200))
    return image


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
        for piece in dashes(np.array([[x, y], [x + 26.0, y]]), *(dash or (26.0, 0.0))):
            draw.line(piece, fill=theme.rgb(color), width=3)
        draw.text((x + 34, y), text, font=font, fill=INK[:3], anchor="lm")


def _legend_entries(dataset: Dataset) -> list[tuple[str, str, Dash | None]]:
    """Colour, words and dashes of what the map shows."""
    statuses = set(dataset.table("obstacles")["status"])
    turns = dataset.table("turns")
    unfit = int((turns["fits"] == "no").sum())
    entries: list[tuple[object, str, str, Dash | None]] = [
        (True, theme.OUTLINE, "field", None),
        (frame_lines(dataset), theme.DOUBT, "goes on outside", FRAME_DASH),
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


def _wrapped(text: str, size_px: int, width: int) -> list[str]:
    """A text in lines that fit a picture's width, pixels; the further ones are indented."""
    lines: list[str] = []
    line = ""
    for word in re.findall(r"\S+\s*", text):
        if line.strip() and length_px((line + word).rstrip(), size_px) > width - 32:
            lines.append(line.rstrip())
            line = "    "
        for letter in word:
            # A word that is longer than a line, or a script without spaces.
            if length_px((line + letter).rstrip(), size_px) > width - 32:
                lines.append(line)
                line = "    "
            line += letter
    return [*lines, line.rstrip()] if line.strip() else lines


def _scale_bar(
    draw: ImageDraw.ImageDraw, grid: Grid, scale: float, right: float, bottom: float
) -> None:
    # Across the picture: its pixels may be a tenth longer one way than the other.
    metres_per_px = float(grid.pixel_sides(grid.width_px / 2, grid.height_px / 2)[0]) / scale
    length = round_length_m(180 * metres_per_px)
    left = right - length / metres_per_px
    for width, colour in ((7, (0, 0, 0)), (3, INK[:3])):
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
    draw.polygon([tip, left, notch, right], fill=INK[:3], outline=(0, 0, 0))
    _outlined(draw, (x + 31 * ux, y + 31 * uy), "N", 15, "mm")


def _outlined(
    draw: ImageDraw.ImageDraw, at: tuple[float, float], text: str, size_px: int, anchor: str
) -> None:
    """Write light letters with a dark rim, to be read on any ground."""
    font, rim = ImageFont.load_default(size_px), (0, 0, 0)
    draw.text(at, text, INK[:3], font, anchor, stroke_width=2, stroke_fill=rim)


def dashes(points: NDArray[np.float64], on: float, off: float) -> list[list[float]]:
    """The drawn pieces of a dashed line through points, each x, y, x, y: they go round corners."""
    along = np.concatenate([[0.0], np.hypot(*np.diff(points, axis=0).T).cumsum()])
    starts = np.arange(0.0, along[-1], on + off)
    ends = np.minimum(starts + on, along[-1])
    tips = [
        np.column_stack([np.interp(at, along, axis) for axis in points.T]) for at in (starts, ends)
    ]
    first, last = np.searchsorted(along, starts, side="right"), np.searchsorted(along, ends)
    return [
        np.vstack([a, points[i:j], b]).ravel().tolist()
        for a, b, i, j in zip(*tips, first, last, strict=True)
    ]
