"""Synthetic fields with known truth: believable pictures made from a seed.

A picture shows one target field among neighbours: rows and tramlines, soil patches, a track
along one side, crowns with shadows, hedges, noise and the blur of a lens. The truth is the
outline and the circle of every crown. The same seed gives the same picture everywhere.

Simulated pictures flatter every method; they are for tests, examples and controlled
comparisons, not for claims about real fields.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
import shapely
from affine import Affine
from numpy.typing import NDArray
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry

from geofield.crs import LONLAT, transformer, utm_crs
from geofield.errors import SettingsError
from geofield.grid import Grid
from geofield.model.field import Field
from geofield.model.obstacles import from_circles_px
from geofield.model.scene import ImagerySource, Scene

if TYPE_CHECKING:
    import geopandas as gpd

FloatArray = NDArray[np.float64]
Climate = Literal["temperate", "dry", "lush", "bare"]
CLIMATES: tuple[Climate, ...] = ("temperate", "dry", "lush", "bare")

#: Red, green, blue, near infrared of ground covers, 0..255, per climate: typical of summer
#: aerial pictures, chosen by eye.
_COVERS: dict[Climate, tuple[tuple[int, int, int, int], ...]] = {
    "temperate": (
        (150, 160, 105, 175),
        (120, 145, 85, 185),
        (180, 165, 120, 160),
        (165, 140, 110, 135),
    ),
    "dry": ((190, 170, 135, 180), (205, 188, 155, 190), (170, 148, 115, 165), (180, 168, 120, 175)),
    "lush": ((98, 135, 72, 205), (115, 150, 85, 210), (85, 122, 62, 195), (130, 150, 90, 190)),
    "bare": ((165, 130, 100, 140), (150, 118, 92, 130), (185, 150, 118, 155), (140, 112, 90, 125)),
}
_ROAD = (200, 188, 165, 190)
_CROWN = (62, 84, 50, 150)


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """What a simulated picture shows.

    Attributes
    ----------
    width_px, height_px : int
        Size of the picture.
    resolution_m : float
        Metres per pixel.
    obstacles : int or None
        Crowns inside the field; None draws 3 to 25.
    radius_m : (float, float)
        Range of the crowns' radii.
    climate : {"temperate", "dry", "lush", "bare"} or None
        Colours of the ground; None draws one.
    equal_brightness : bool
        Give the neighbours the field's grey level, so that only colour, near infrared and
        texture tell them apart: the case in which thresholds fail.
    nir : bool
        Add the near infrared band.
    lat, lon : float
        The place of the picture's centre, degrees.
    """

    width_px: int = 640
    height_px: int = 640
    resolution_m: float = 0.6
    obstacles: int | None = None
    radius_m: tuple[float, float] = (2.0, 7.0)
    climate: Climate | None = None
    equal_brightness: bool = False
    nir: bool = True
    lat: float = 35.075373
    lon: float = 33.531142

    def __post_init__(self) -> None:
        if min(self.width_px, self.height_px) < 64:
            raise SettingsError("A simulated picture has at least 64 x 64 px.")
        if not 0 < self.radius_m[0] <= self.radius_m[1]:
            raise SettingsError(f"The radius range {self.radius_m} is empty.")
        if not self.resolution_m > 0:
            raise SettingsError("The resolution must be above zero.")
        if self.climate is not None and self.climate not in CLIMATES:
            raise SettingsError(f"Unknown climate {self.climate!r}.", hint=f"Use {CLIMATES}.")


@dataclass(frozen=True, eq=False)
class SimulatedField:
    """A picture and its truth.

    Attributes
    ----------
    scene : Scene
    field : Field
        The true outline.
    obstacles : GeoDataFrame
        The true crowns, status `confirmed`, no safety margin.
    lat, lon : float
        A point in the field, on no crown.
    """

    scene: Scene
    field: Field
    obstacles: gpd.GeoDataFrame
    lat: float
    lon: float


def simulate_field(seed: int, settings: SimulationSettings | None = None) -> SimulatedField:
    """Draw one field from a seed.

    Parameters
    ----------
    seed : int
        The same seed and settings give the same field.
    settings : SimulationSettings, optional
    """
    settings = settings or SimulationSettings()
    rng = np.random.default_rng(seed)
    climate = settings.climate or CLIMATES[int(rng.integers(len(CLIMATES)))]
    grid = _grid(settings)
    outline_px = _outline(rng, settings)
    crowns = _crowns(rng, settings, outline_px)
    picture = _ground(rng, settings, climate, outline_px)
    _draw_track(rng, picture, outline_px, settings)
    sun = rng.uniform(0, 2 * math.pi)
    outside = _hedge_trees(rng, settings, outline_px)
    _draw_crowns(rng, picture, np.vstack([outside, crowns]), sun)
    bands = _expose(rng, picture)
    roles: tuple[str, ...] = ("red", "green", "blue", "nir")
    if not settings.nir:
        bands, roles = bands[:3], roles[:3]
    source = ImagerySource(
        name=f"simulated-{seed}", attribution="geofield simulate", licence="CC0-1.0"
    )
    scene = Scene(grid, bands, roles, np.ones(grid.shape, bool), source)
    polygon = shapely.transform(outline_px, grid.to_metric_array)
    field = Field(polygon, grid.crs, name=f"simulated {seed}", method="truth", licence="CC0-1.0")
    obstacles = from_circles_px(crowns[:, 0], crowns[:, 1], crowns[:, 2], grid, buffer_m=0.0)
    obstacles["status"] = "confirmed"
    obstacles["confidence"] = 1.0
    lat, lon = _seed_point(grid, outline_px, crowns)
    return SimulatedField(scene, field, obstacles, lat, lon)


def simulate_fields(
    count: int,
    seed: int,
    settings: SimulationSettings | None = None,
    *,
    obstacle_counts: Sequence[int] | None = None,
    equal_brightness_every: int = 3,
) -> Iterator[SimulatedField]:
    """Draw several fields, one at a time; every third has neighbours of its own grey level.

    Parameters
    ----------
    count, seed : int
    settings : SimulationSettings, optional
    obstacle_counts : sequence of int, optional
        Crowns per field, repeated when too short.
    equal_brightness_every : int
        0 for never.
    """
    settings = settings or SimulationSettings()
    for index in range(count):
        one = settings
        if obstacle_counts:
            one = replace(one, obstacles=int(obstacle_counts[index % len(obstacle_counts)]))
        if equal_brightness_every and (index + 1) % equal_brightness_every == 0:
            one = replace(one, equal_brightness=True)
        yield simulate_field(seed * 100_003 + index, one)


def _grid(settings: SimulationSettings) -> Grid:
    crs = utm_crs(settings.lon, settings.lat)
    x, y = transformer(LONLAT, crs).transform(settings.lon, settings.lat)
    resolution = settings.resolution_m
    # Whole multiples of the pixel size, as real orthophotos have.
    west = round((x - settings.width_px * resolution / 2) / resolution) * resolution
    north = round((y + settings.height_px * resolution / 2) / resolution) * resolution
    return Grid(
        settings.width_px,
        settings.height_px,
        Affine(resolution, 0, west, 0, -resolution, north),
        crs,
    )


def _outline(rng: np.random.Generator, settings: SimulationSettings) -> Polygon:
    """A field of four to six corners, pixels, well inside the picture."""
    w, h = settings.width_px, settings.height_px
    half_length, half_width = rng.uniform(0.27, 0.36) * w, rng.uniform(0.2, 0.34) * h
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    corners += rng.uniform(-0.14, 0.14, corners.shape)
    kind = rng.integers(3)
    if kind == 1:  # a cut-off corner
        corners = np.vstack([corners[:2], [[1.0, 0.35], [0.45, 1.0]], corners[3:]])
    elif kind == 2:  # a notch: an L-shaped field
        corners = np.vstack([corners[:2], [[1.0, 0.15], [0.3, 0.2], [0.25, 1.0]], corners[3:]])
    corners *= [half_length, half_width]
    angle = rng.uniform(0, math.pi)
    rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    corners = corners @ rotation.T
    room = 0.44 * min(w, h) / np.abs(corners).max()
    corners *= min(1.0, room)
    return Polygon(corners + np.array([w / 2, h / 2]))


def _crowns(rng: np.random.Generator, settings: SimulationSettings, outline: Polygon) -> FloatArray:
    """Centres and radii (n, 3) in pixels, apart from each other and from the border."""
    wanted = int(rng.integers(3, 26)) if settings.obstacles is None else settings.obstacles
    low, high = (r / settings.resolution_m for r in settings.radius_m)
    x0, y0, x1, y1 = outline.bounds
    placed: list[tuple[float, float, float]] = []
    for attempt in range(400 * max(wanted, 1)):
        if len(placed) == wanted:
            break
        # Large crowns first would be denser; shrinking over time keeps crowded fields possible.
        shrink = 1.0 - 0.6 * attempt / (400 * wanted)
        radius = max(low, math.exp(rng.uniform(math.log(low), math.log(high))) * shrink)
        x, y = rng.uniform(x0, x1), rng.uniform(y0, y1)
        point = Point(x, y)
        if not outline.contains(point) or outline.exterior.distance(point) < radius + 3:
            continue
        if all(math.hypot(x - a, y - b) > radius + r + 3 for a, b, r in placed):
            placed.append((x, y, radius))
    return np.array(placed, float).reshape(-1, 3)


def _hedge_trees(
    rng: np.random.Generator, settings: SimulationSettings, outline: Polygon
) -> FloatArray:
    """Crowns in the hedges outside the field, which are no obstacles."""
    ring = outline.buffer(14 / settings.resolution_m * 0.6, join_style="mitre").exterior
    count = int(rng.integers(4, 18))
    rows = []
    for position in np.sort(rng.uniform(0, ring.length, count)):
        point = ring.interpolate(float(position))
        radius = rng.uniform(*settings.radius_m) / settings.resolution_m * 0.8
        if outline.distance(point) > radius + 2:
            rows.append((point.x, point.y, radius))
    return np.array(rows, float).reshape(-1, 3)


def _ground(
    rng: np.random.Generator, settings: SimulationSettings, climate: Climate, outline: Polygon
) -> FloatArray:
    """The picture (4, rows, columns) of parcels with rows, tramlines and soil patches."""
    from rasterio.features import rasterize
    from scipy.ndimage import gaussian_filter

    shape = (settings.height_px, settings.width_px)
    parcels = _parcels(rng, settings, outline)
    label = rasterize(
        ((polygon, index + 1) for index, polygon in enumerate(parcels)), shape, dtype="int32"
    )
    covers = _COVERS[climate]
    own = int(rng.integers(len(covers)))
    colours = np.empty((len(parcels) + 1, 4))
    for index in range(len(parcels) + 1):
        others = [i for i in range(len(covers)) if i != own]
        colours[index] = covers[others[int(rng.integers(len(others)))]]
        colours[index] += rng.normal(0, 8) + rng.normal(0, 3, 4)
    colours[1] = np.array(covers[own]) + rng.normal(0, 4, 4)
    if settings.equal_brightness:
        weights = np.array([0.298, 0.587, 0.114])
        colours[:, :3] += (colours[1, :3] @ weights - colours[:, :3] @ weights)[:, None]
        # Equal in brightness does not mean equal: keep a difference of hue.
        tint = rng.choice([-1.0, 1.0], len(colours))[:, None] * np.array([9.0, -6.0, 7.37])
        tint[1] = 0
        colours[:, :3] += tint
    picture: FloatArray = np.moveaxis(colours[label], -1, 0).copy()
    y, x = np.mgrid[: shape[0], : shape[1]].astype(float)
    rows = np.zeros(shape)
    for index in range(len(parcels) + 1):
        part = label == index
        angle = rng.uniform(0, math.pi)
        if index == 1:
            angle = _longest_edge_angle(outline)
        across = x * -math.sin(angle) + y * math.cos(angle)
        period, strength = rng.uniform(3.2, 7.0), rng.uniform(1.0, 5.0)
        rows[part] = strength * np.sin(2 * math.pi * across[part] / period)
        if index == 1 or rng.random() < 0.5:
            tramline = np.abs((across % (24.0 / settings.resolution_m)) - 4.0) < 0.7
            rows[part & tramline] += 7.0
    large = gaussian_filter(rng.normal(size=shape), 36)
    fine = gaussian_filter(rng.normal(size=shape), 5)
    soil = 6.0 * large / large.std() + 2.5 * fine / fine.std()
    picture += (rows + soil) * np.array([1.0, 0.9, 0.8, -0.6])[:, None, None]
    return picture


def _parcels(
    rng: np.random.Generator, settings: SimulationSettings, outline: Polygon
) -> list[Polygon]:
    """The target field first, then its neighbours."""
    w, h = settings.width_px, settings.height_px
    points = shapely.multipoints(rng.uniform([0, 0], [w, h], (int(rng.integers(6, 12)), 2)))
    frame = shapely.box(-w, -h, 2 * w, 2 * h)
    cells = shapely.get_parts(shapely.voronoi_polygons(points, extend_to=frame))
    neighbours = shapely.difference(cells, outline)
    picture = shapely.box(0, 0, w, h)
    return [outline, *neighbours[shapely.intersects(neighbours, picture)]]


def _longest_edge_angle(outline: Polygon) -> float:
    coordinates = shapely.get_coordinates(outline.exterior)
    steps = np.diff(coordinates, axis=0)
    dx, dy = steps[np.argmax(np.hypot(*steps.T))]
    return math.atan2(dy, dx)


def _draw_track(
    rng: np.random.Generator, picture: FloatArray, outline: Polygon, settings: SimulationSettings
) -> None:
    """A farm track outside one or two edges, and a grass verge or ditch around the rest."""
    from rasterio.features import rasterize

    shape = picture.shape[1:]
    verge = outline.buffer(rng.uniform(1.0, 2.2), join_style="mitre").difference(outline)
    dark = rasterize([(verge, 1)], shape).astype(bool)
    picture[:, dark] -= np.array([26.0, 18.0, 22.0, 10.0])[:, None] * rng.uniform(0.5, 1.0)
    ring = outline.buffer(4.0, join_style="mitre").exterior
    coordinates = shapely.get_coordinates(ring)
    width = rng.uniform(3.0, 5.0) / settings.resolution_m
    for _ in range(int(rng.integers(1, 3))):
        i = int(rng.integers(len(coordinates) - 1))
        a, b = coordinates[i], coordinates[i + 1]
        step = (b - a) / np.hypot(*(b - a))
        far = 2.0 * max(shape)
        line = shapely.LineString([a - far * step, b + far * step])
        road = line.buffer(width / 2).difference(outline)
        part = rasterize([(road, 1)], shape).astype(bool)
        count = int(part.sum())
        picture[:, part] = np.array(_ROAD, float)[:, None] + rng.normal(0, 4, (4, count))


def _draw_crowns(
    rng: np.random.Generator, picture: FloatArray, crowns: FloatArray, sun: float
) -> None:
    """Shadows first, then crowns: lobed outlines, lit on the side of the sun."""
    shape = picture.shape[1:]
    away = np.array([-math.cos(sun), -math.sin(sun)])
    length = rng.uniform(0.5, 1.1)
    for x, y, radius in crowns:
        for part in np.linspace(0.3, 1.0, 4):
            cx, cy = np.array([x, y]) + away * part * length * radius
            box, dx, dy = _window(cx, cy, radius, shape)
            cover = np.clip(radius * 0.95 - np.hypot(dx, dy) + 0.5, 0, 1)
            picture[(slice(None), *box)] *= 1 - 0.14 * cover
    for x, y, radius in crowns:
        box, dx, dy = _window(x, y, radius, shape)
        angle, distance = np.arctan2(dy, dx), np.hypot(dx, dy)
        lobes = sum(
            rng.normal(0, 0.035) * np.cos(k * angle + rng.uniform(0, 2 * math.pi))
            for k in range(2, 7)
        )
        cover = np.clip(radius * (1 + lobes) - distance + 0.5, 0, 1)
        lit = -(dx * away[0] + dy * away[1]) / radius
        shade = 16.0 * lit + rng.normal(0, 5, dx.shape)
        colour = np.array(_CROWN, float) + rng.normal(0, 6) + rng.normal(0, 3, 4)
        value = colour[:, None, None] + shade * np.array([1.0, 1.1, 0.8, 1.6])[:, None, None]
        region = (slice(None), *box)
        picture[region] = picture[region] * (1 - cover) + value * cover


def _window(
    x: float, y: float, radius: float, shape: tuple[int, ...]
) -> tuple[tuple[slice, slice], FloatArray, FloatArray]:
    """The rows and columns around a circle, and each pixel centre's offset from it."""
    reach = 1.3 * radius + 2
    r0, r1 = (int(np.clip(v, 0, shape[0])) for v in (y - reach, y + reach + 1))
    c0, c1 = (int(np.clip(v, 0, shape[1])) for v in (x - reach, x + reach + 1))
    dy, dx = np.mgrid[r0:r1, c0:c1] + 0.5
    return (slice(r0, r1), slice(c0, c1)), dx - x, dy - y


def _expose(rng: np.random.Generator, picture: FloatArray) -> NDArray[np.uint8]:
    """Blur of the lens, noise of the sensor, eight bits."""
    from scipy.ndimage import gaussian_filter

    blurred = gaussian_filter(picture, (0, 0.65, 0.65), mode="nearest")
    common = rng.normal(0, 1.6, picture.shape[1:])
    noisy = blurred + common + rng.normal(0, 1.4, picture.shape)
    return np.asarray(np.clip(np.rint(noisy), 0, 255), np.uint8)


def _seed_point(grid: Grid, outline: Polygon, crowns: FloatArray) -> tuple[float, float]:
    """Latitude and longitude of a point in the field that is on no crown."""
    free: BaseGeometry = outline.buffer(-6)
    if len(crowns):
        discs = shapely.buffer(shapely.points(crowns[:, :2]), crowns[:, 2] * 2.2)
        free = free.difference(shapely.union_all(discs))
    point = (free if not free.is_empty else outline).representative_point()
    lon, lat = grid.to_lonlat(point.x, point.y)
    return float(lat), float(lon)
