"""Painting: the picture of a simulated field, from parcels to the noise of the sensor."""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from geofield.simulate.settings import Climate, SimulationSettings

FloatArray = NDArray[np.float64]

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


def paint(
    rng: np.random.Generator,
    settings: SimulationSettings,
    climate: Climate,
    outline: Polygon,
    crowns: FloatArray,
) -> NDArray[np.uint8]:
    """The picture of a field: bands (red, green, blue, near infrared), rows, columns.

    Parameters
    ----------
    rng : numpy.random.Generator
    settings : SimulationSettings
    climate : str
    outline : shapely.Polygon
        Of the field, pixel coordinates.
    crowns : float array (n, 3)
        Centres and radii in the field, pixels.
    """
    picture = _ground(rng, settings, climate, outline)
    _draw_track(rng, picture, outline, settings)
    sun = rng.uniform(0, 2 * math.pi)
    outside = _hedge_trees(rng, settings, outline)
    _draw_crowns(rng, picture, np.vstack([outside, crowns]), sun)
    return _expose(rng, picture)


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
