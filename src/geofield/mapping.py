"""The map picture: outline, obstacles and tracks drawn on the scene.

This is the study's graphical annotation (METHOD.md, section 5): obstacles as circles,
tracks as dotted lines. It is a picture for people; the geodata are in the other products.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from geofield import schema
from geofield.grid import Grid
from geofield.model.dataset import Dataset
from geofield.model.obstacles import active
from geofield.model.scene import Scene

if TYPE_CHECKING:
    import geopandas as gpd

Colour = tuple[int, int, int, int]

OUTLINE: Colour = (255, 221, 51, 255)
TRACK: Colour = (90, 225, 255, 235)
GAP: Colour = (255, 120, 60, 220)
HEADLAND: Colour = (255, 170, 230, 220)
STATUS_COLOURS: dict[str, Colour] = {
    "possible": (255, 170, 0, 255),
    "detected": (255, 60, 60, 255),
    "confirmed": (60, 255, 110, 255),
    "added": (190, 120, 255, 255),
    "rejected": (190, 190, 190, 200),
}
_CASING: Colour = (0, 0, 0, 150)
_INK: Colour = (255, 255, 255, 255)
_PANEL: Colour = (20, 24, 28, 215)

#: The long side of the picture's map part, pixels.
LONG_SIDE_PX = 1400
#: Drawn this much larger, then reduced: smooth lines.
_OVERSAMPLING = 2
#: At most this many numbers along the tracks' starts.
_MAX_LABELS = 40


def draw_map(
    dataset: Dataset, scene: Scene | None = None, *, long_side_px: int = LONG_SIDE_PX
) -> Image.Image:
    """Draw the tables of a dataset on its picture.

    Parameters
    ----------
    dataset : Dataset
    scene : Scene, optional
        The picture below; plain ground where there is none.
    long_side_px : int
        Long side of the map part of the picture.

    Returns
    -------
    PIL.Image.Image
        RGB; the map with a panel below: legend, scale, north, figures, attribution.
    """
    grid = scene.grid if scene is not None else _plain_grid(dataset)
    scale = long_side_px / max(grid.width_px, grid.height_px)
    size = (max(1, round(grid.width_px * scale)), max(1, round(grid.height_px * scale)))
    canvas = _Canvas(grid, size, dataset)
    if scene is not None:
        canvas.picture(scene)
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


class _Canvas:
    """An oversampled picture with the transform from the metric CRS to it."""

    def __init__(self, grid: Grid, size: tuple[int, int], dataset: Dataset) -> None:
        self.grid, self.size, self.dataset = grid, size, dataset
        self.large = (size[0] * _OVERSAMPLING, size[1] * _OVERSAMPLING)
        self.factor = self.large[0] / grid.width_px
        self.image = Image.new("RGBA", self.large, (70, 74, 70, 255))
        self.draw = ImageDraw.Draw(self.image, "RGBA")
        self.labels: list[tuple[float, float, str]] = []

    def picture(self, scene: Scene) -> None:
        rgb = scene.rgb.copy()
        rgb[~scene.valid] = 70
        self.image.paste(Image.fromarray(rgb).resize(self.large, Image.Resampling.BICUBIC))

    def tables(self) -> None:
        line = 1.1 * _OVERSAMPLING
        segments = self.dataset.table("segments")
        self.lines(self.dataset.table("gaps"), GAP, line, dash=(5.0, 5.0))
        self.lines(segments, TRACK, line, dash=(9.0, 4.0))
        for name in ("headland_tracks", "route", "turns"):
            if name in self.dataset.tables:
                self.lines(self.dataset.tables[name], HEADLAND, line)
        obstacles = self.dataset.table("obstacles")
        for status, colour in STATUS_COLOURS.items():
            part = obstacles[obstacles["status"] == status]
            dash = {"rejected": (6.0, 4.0), "possible": (1.5, 4.0)}.get(status)
            self.outlines(part, colour, 1.6 * _OVERSAMPLING, dash=dash)
        self.outlines(self.dataset.table("field"), OUTLINE, 2.4 * _OVERSAMPLING)
        self.numbers(obstacles, segments)

    def pixels(self, coordinates: NDArray[np.float64]) -> NDArray[np.float64]:
        x, y = self.grid.from_crs(coordinates[:, 0], coordinates[:, 1], self.dataset.crs)
        return np.column_stack([x, y]) * self.factor

    def lines(
        self,
        table: gpd.GeoDataFrame,
        colour: Colour,
        width: float,
        dash: tuple[float, float] | None = None,
    ) -> None:
        for part in shapely.get_parts(table.geometry.to_numpy()):
            points = self.pixels(shapely.get_coordinates(part))
            if dash is None:
                self.draw.line(points.ravel().tolist(), fill=colour, width=round(width))
                continue
            for a, b in _dashes(points, dash[0] * _OVERSAMPLING, dash[1] * _OVERSAMPLING):
                self.draw.line([*a, *b], fill=colour, width=round(width))

    def outlines(
        self,
        table: gpd.GeoDataFrame,
        colour: Colour,
        width: float,
        *,
        dash: tuple[float, float] | None = None,
    ) -> None:
        rings = shapely.get_rings(shapely.get_parts(table.geometry.to_numpy()))
        for ring in rings:
            points = self.pixels(shapely.get_coordinates(ring))
            flat = points.ravel().tolist()
            if dash is None:
                self.draw.line(flat, fill=_CASING, width=round(width * 2), joint="curve")
            if dash is not None:
                for a, b in _dashes(points, dash[0] * _OVERSAMPLING, dash[1] * _OVERSAMPLING):
                    self.draw.line([*a, *b], fill=colour, width=round(width))
            else:
                self.draw.line(flat, fill=colour, width=round(width), joint="curve")

    def numbers(self, obstacles: gpd.GeoDataFrame, segments: gpd.GeoDataFrame) -> None:
        if len(obstacles) and len(obstacles) <= 150:
            for number, shape in zip(obstacles["obstacle_no"], obstacles.geometry, strict=True):
                x0, _, x1, y1 = shape.bounds
                corner = self.pixels(np.array([[(x0 + x1) / 2 + 0.38 * (x1 - x0), y1]]))[0]
                self.labels.append((corner[0], corner[1], str(number)))
        first = segments.drop_duplicates("track_no")
        step = max(1, math.ceil(len(first) / _MAX_LABELS))
        for number, shape in zip(first["track_no"][::step], first.geometry[::step], strict=True):
            start = self.pixels(shapely.get_coordinates(shape)[:1])[0]
            self.labels.append((start[0], start[1], str(number)))

    def finish(self) -> Image.Image:
        image = self.image.resize(self.size, Image.Resampling.LANCZOS).convert("RGB")
        draw = ImageDraw.Draw(image)
        font = ImageFont.load_default(12)
        for x, y, text in self.labels:
            draw.text(
                (x / _OVERSAMPLING, y / _OVERSAMPLING),
                text,
                font=font,
                fill=_INK[:3],
                anchor="mm",
                stroke_width=2,
                stroke_fill=(0, 0, 0),
            )
        return image


def _dashes(
    points: NDArray[np.float64], on: float, off: float
) -> list[tuple[list[float], list[float]]]:
    """The drawn pieces of a dashed line through points."""
    pieces = []
    for a, b in itertools.pairwise(points):
        length = float(np.hypot(*(b - a)))
        if length == 0:
            continue
        starts = np.arange(0.0, length, on + off)
        ends = np.minimum(starts + on, length)
        direction = (b - a) / length
        pieces += [
            ((a + s * direction).tolist(), (a + e * direction).tolist())
            for s, e in zip(starts, ends, strict=True)
        ]
    return pieces


def _with_panel(picture: Image.Image, dataset: Dataset, grid: Grid, scale: float) -> Image.Image:
    """The picture with a panel below it."""
    panel_height = 104
    image = Image.new("RGB", (picture.width, picture.height + panel_height), _PANEL[:3])
    image.paste(picture)
    draw = ImageDraw.Draw(image)
    top = picture.height
    _legend(draw, dataset, 16, top + 14)
    _figures(draw, dataset, top, image.width)
    _scale_bar(draw, grid, scale, picture.width - 30, picture.height - 22)
    _north_arrow(draw, grid, picture.width - 42, 46)
    source = dataset.provenance.source
    credit = "  ".join(t for t in (source.attribution or source.name, source.licence) if t)
    if source.date:
        credit += f"  taken {source.date}"
    draw.text(
        (16, image.height - 12),
        credit.strip(),
        font=ImageFont.load_default(12),
        fill=(190, 195, 200),
        anchor="ls",
    )
    return image


def _legend(draw: ImageDraw.ImageDraw, dataset: Dataset, left: int, top: int) -> None:
    font = ImageFont.load_default(14)
    statuses = list(dict.fromkeys(dataset.table("obstacles")["status"].tolist()))
    entries: list[tuple[Colour, str]] = [(OUTLINE, "field")]
    entries += [(STATUS_COLOURS.get(s, GAP), f"obstacle, {s}") for s in statuses]
    if dataset.has("segments"):
        entries.append((TRACK, "track"))
    if dataset.has("gaps"):
        entries.append((GAP, "gap"))
    for index, (colour, text) in enumerate(entries):
        x, y = left + 170 * (index % 3), top + 24 * (index // 3)
        draw.line([x, y, x + 26, y], fill=colour[:3], width=3)
        draw.text((x + 34, y), text, font=font, fill=_INK[:3], anchor="lm")


def _figures(draw: ImageDraw.ImageDraw, dataset: Dataset, top: int, width: int) -> None:
    field = dataset.table("field").iloc[0]
    obstacles, tracks = dataset.table("obstacles"), dataset.table("tracks")
    lines = [f"{dataset.name}   {field['area_ha']:.2f} ha"]
    count = len(active(obstacles))
    idle = {s: int((obstacles["status"] == s).sum()) for s in schema.NOT_AVOIDED}
    others = ", ".join(f"{n} {status}" for status, n in idle.items() if n)
    lines.append(f"{count} obstacles" + (f" ({others})" if others else ""))
    if len(tracks):
        length = tracks["length_m"].sum() / 1000
        lines.append(
            f"{len(tracks)} tracks, {int(tracks['segment_count'].sum())} segments, "
            f"{length:.2f} km, heading {field['heading_deg']:.1f}°"
        )
    warning = dict(dataset.provenance.evidence.get("field", {})).get("reasons", [])
    for index, line in enumerate(lines):
        draw.text(
            (width - 16, top + 14 + 22 * index),
            line,
            font=ImageFont.load_default(16 if index == 0 else 14),
            fill=_INK[:3],
            anchor="rm",
        )
    if warning:
        draw.text(
            (width - 16, top + 92),
            "Check the outline: " + "; ".join(warning)[:110],
            font=ImageFont.load_default(13),
            fill=(255, 190, 90),
            anchor="rs",
        )


def _scale_bar(
    draw: ImageDraw.ImageDraw, grid: Grid, scale: float, right: float, bottom: float
) -> None:
    metres_per_px = grid.ground_resolution_m / scale
    wanted = 180 * metres_per_px
    power = 10.0 ** math.floor(math.log10(wanted))
    length = max(step * power for step in (1, 2, 5) if step * power <= wanted)
    left = right - length / metres_per_px
    for width, colour in ((7, (0, 0, 0)), (3, _INK[:3])):
        draw.line([left, bottom, right, bottom], fill=colour, width=width)
    label = f"{length:g} m" if length < 1000 else f"{length / 1000:g} km"
    draw.text(
        ((left + right) / 2, bottom - 7),
        label,
        font=ImageFont.load_default(14),
        fill=_INK[:3],
        anchor="ms",
        stroke_width=2,
        stroke_fill=(0, 0, 0),
    )


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
    draw.text(
        (x + 31 * ux, y + 31 * uy),
        "N",
        font=ImageFont.load_default(15),
        fill=_INK[:3],
        anchor="mm",
        stroke_width=2,
        stroke_fill=(0, 0, 0),
    )
