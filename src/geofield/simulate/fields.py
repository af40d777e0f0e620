"""Fields: outlines and crowns drawn from a seed, with their picture."""

from __future__ import annotations

import itertools
import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from affine import Affine
from numpy.typing import NDArray
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry

from geofield.crs import LONLAT, transformer, utm_crs
from geofield.errors import SettingsError, refuse_no_number
from geofield.grid import Grid
from geofield.model.field import Field
from geofield.model.obstacles import from_circles_px
from geofield.model.scene import ImagerySource, Scene
from geofield.simulate.painting import paint
from geofield.simulate.settings import CLIMATES, SimulationSettings

if TYPE_CHECKING:
    import geopandas as gpd

FloatArray = NDArray[np.float64]


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

    >>> made = gf.simulate_field(7)
    >>> len(made.obstacles) > 0
    True

    Parameters
    ----------
    seed : int
        From 0 on; the same seed and settings give the same field.
    settings : SimulationSettings, optional

    Raises
    ------
    SettingsError
        When the seed is below zero.
    """
    refuse_no_number(SettingsError, "0 or more", whole=True, seed=seed)
    if seed < 0:
        raise SettingsError(f"The seed {seed} is below zero.")
    settings = settings or SimulationSettings()
    rng = np.random.default_rng(seed)
    climate = settings.climate or CLIMATES[int(rng.integers(len(CLIMATES)))]
    grid = _grid(settings)
    outline_px = _outline(rng, settings)
    crowns = _crowns(rng, settings, outline_px)
    bands = paint(rng, settings, climate, outline_px, crowns)
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

    >>> [made.scene.grid.shape for made in gf.simulate_fields(2, seed=7)]
    [(640, 640), (640, 640)]

    Parameters
    ----------
    count, seed : int
    settings : SimulationSettings, optional
    obstacle_counts : sequence of int, optional
        Crowns per field, repeated when too short; fewer where there is no room for as many.
    equal_brightness_every : int
        0 for never.
    """
    settings = settings or SimulationSettings()
    every: dict[str, Any] = {"equal_brightness_every": equal_brightness_every}
    refuse_no_number(SettingsError, "of fields", whole=True, count=count, seed=seed, **every)
    for index in range(int(count)):
        one = settings
        if obstacle_counts:
            one = replace(one, obstacles=int(obstacle_counts[index % len(obstacle_counts)]))
        if equal_brightness_every and (index + 1) % equal_brightness_every == 0:
            one = replace(one, equal_brightness=True)
        yield simulate_field(int(seed) * 100_003 + index, one)


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
    # By squares so wide that what touches a crown stands in its own or in one beside it.
    wide, near = 2 * high + 3, defaultdict[tuple[int, int], list[tuple[float, float, float]]](list)
    shapely.prepare(outline)
    for attempt in range(400 * max(wanted, 1)):
        if len(placed) == wanted:
            break
        # Large crowns first would be denser; shrinking over time keeps crowded fields possible.
        shrink = 1.0 - 0.6 * attempt / (400 * wanted)
        radius = max(low, math.exp(rng.uniform(math.log(low), math.log(high))) * shrink)
        x, y = rng.uniform(x0, x1), rng.uniform(y0, y1)
        column, row = int(x // wide), int(y // wide)
        if any(math.hypot(x - a, y - b) <= radius + r + 3 for a, b, r in near[column, row]):
            continue
        inside = shapely.contains_xy(outline, x, y)
        if inside and outline.exterior.distance(Point(x, y)) >= radius + 3:
            placed.append((x, y, radius))
            for i, j in itertools.product((-1, 0, 1), repeat=2):
                near[column + i, row + j].append(placed[-1])
    return np.array(placed, float).reshape(-1, 3)


def _seed_point(grid: Grid, outline: Polygon, crowns: FloatArray) -> tuple[float, float]:
    """Latitude and longitude of a point in the field that is on no crown."""
    free: BaseGeometry = outline.buffer(-6)
    if len(crowns):
        discs = shapely.buffer(shapely.points(crowns[:, :2]), crowns[:, 2] * 2.2)
        free = free.difference(shapely.union_all(discs))
    point = (free if not free.is_empty else outline).representative_point()
    lon, lat = grid.to_lonlat(point.x, point.y)
    return float(lat), float(lon)
