"""Geodesy: exact where it must be, and in step with its peers."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import mercantile
import numpy as np
import pytest
import rasterio.transform
from affine import Affine
from hypothesis import given
from hypothesis import strategies as st
from pyproj import CRS, Geod

from geofield.crs import LONLAT, WEB_MERCATOR, grid_north_deg, metric_crs, transformer, utm_crs
from geofield.errors import CRSError, GridError
from geofield.grid import TILE_SIZE_PX, Grid, web_mercator_resolution
from geofield.model.obstacles import from_circles_px

latitudes = st.floats(-85, 85)
longitudes = st.floats(-180, 180)
zooms = st.integers(0, 22)
pixels = st.floats(-2000, 2000)


def study_crop() -> Grid:
    """The crop behind the study's two printed tables."""
    grid = Grid.web_mercator(lat=35.075373, lon=33.531142, zoom=19)
    return grid.crop(164, 211, 300, 300)


def read_table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_obstacle_table_of_the_study_to_the_last_digit(shared: Path) -> None:
    rows = read_table(shared / "reference" / "obstacle_positions.csv")
    assert len(rows) == 8
    for row in rows:
        lon, lat = study_crop().to_lonlat(round(float(row["x_px"])), round(float(row["y_px"])))
        assert round(lat, 6) == float(row["lat"])
        assert round(lon, 6) == float(row["long"])


def test_trajectory_table_of_the_study_to_the_last_digit(shared: Path) -> None:
    rows = read_table(shared / "reference" / "trajectory_points.csv")
    assert len(rows) == 5
    for row in rows:
        lon, lat = study_crop().to_lonlat(float(row["x_px"]), float(row["y_px"]))
        assert round(lat, 8) == float(row["lat"])
        assert round(lon, 8) == float(row["long"])


def test_the_given_point_is_the_centre_and_the_crop_keeps_it() -> None:
    grid = Grid.web_mercator(lat=35.075373, lon=33.531142, zoom=19)
    assert grid.from_lonlat(33.531142, 35.075373) == pytest.approx((320, 320), abs=1e-6)
    assert study_crop().from_lonlat(33.531142, 35.075373) == pytest.approx((156, 109), abs=1e-6)


@given(lat=latitudes, lon=longitudes, zoom=zooms, x=pixels, y=pixels)
def test_pixel_round_trip(lat: float, lon: float, zoom: int, x: float, y: float) -> None:
    grid = Grid.web_mercator(lat=lat, lon=lon, zoom=zoom)
    # Stay on the map: at low zoom the world is smaller than the picture.
    half = 128 * 2.0**zoom
    cx, cy = grid.from_crs(0.0, 0.0, WEB_MERCATOR)
    x, y = float(np.clip(x, cx - half, cx + half)), float(np.clip(y, cy - half, cy + half))
    lon_1, lat_1 = grid.to_lonlat(x, y)
    x_1, y_1 = grid.from_lonlat(lon_1, lat_1)
    # Where the picture crosses the antimeridian, the same place is one world further.
    x_1 += round((x - x_1) / (2 * half)) * 2 * half
    assert math.hypot(x_1 - x, y_1 - y) < 1e-5
    lon_2, lat_2 = grid.to_lonlat(x_1, y_1)
    assert abs(lat_2 - lat_1) < 1e-9
    assert abs((lon_2 - lon_1 + 180) % 360 - 180) < 1e-9


@given(lat=st.floats(-84, 84), lon=st.floats(-179.9, 179.9), zoom=zooms)
def test_agrees_with_mercantile(lat: float, lon: float, zoom: int) -> None:
    tile = mercantile.tile(lon, lat, zoom)
    bounds = mercantile.xy_bounds(tile)
    resolution = web_mercator_resolution(zoom)
    assert (bounds.right - bounds.left) / 256 == pytest.approx(resolution, rel=1e-9)
    grid = Grid(
        256, 256, Affine(resolution, 0, bounds.left, 0, -resolution, bounds.top), WEB_MERCATOR
    )
    upper_left = mercantile.ul(tile)
    assert grid.to_lonlat(0, 0) == pytest.approx((upper_left.lng, upper_left.lat), abs=1e-9)
    x, y = grid.from_lonlat(lon, lat)
    assert -1e-6 <= x <= 256 + 1e-6
    assert -1e-6 <= y <= 256 + 1e-6


def test_longitudes_of_a_picture_across_the_180th_meridian_stay_on_earth() -> None:
    step = 1e-5
    grid = Grid(100, 100, Affine(step, 0, 180.0 - 50 * step, 0, -step, -17.5), CRS.from_epsg(4326))
    lon, lat = grid.to_lonlat(np.array([0.0, 50.0, 100.0]), np.zeros(3))
    assert lon == pytest.approx([179.9995, 180.0, -179.9995])
    assert grid.from_lonlat(lon, lat)[0] == pytest.approx([0.0, 50.0, 100.0], abs=1e-6)
    obstacle = from_circles_px([99.0], [50.0], [2.0], grid, buffer_m=1.0).iloc[0]
    assert obstacle["lon"] == pytest.approx(-179.99951)


def test_agrees_with_gdal_on_a_rotated_transform() -> None:
    transform = Affine(0.5, 0.12, 500_000.25, 0.13, -0.48, 4_000_000.75)
    grid = Grid(100, 80, transform, CRS.from_epsg(32633))
    rows, columns = np.array([0, 3, 79]), np.array([0, 50, 99])
    east, north = rasterio.transform.xy(transform, rows, columns, offset="center")
    x, y = grid.to_native(columns + 0.5, rows + 0.5)
    np.testing.assert_allclose(x, east, atol=1e-9)
    np.testing.assert_allclose(y, north, atol=1e-9)
    np.testing.assert_allclose(grid.from_native(x, y), [columns + 0.5, rows + 0.5], atol=1e-8)


def degrees_per_pixel(zoom: int) -> float:
    """The study's equation (1): degrees of longitude per pixel at a zoom."""
    return 360.0 / (TILE_SIZE_PX * 2.0**zoom)


def approximate_lonlat(
    x_px: float, y_px: float, *, centre_px: float, centre_lonlat: tuple[float, float], zoom: int
) -> tuple[float, float]:
    """Its equations (5) and (6), with the printed swap of x and y mended.

    The small-picture approximation of inverse Web Mercator, to check the exact one with.
    """
    lon, lat = centre_lonlat
    scale = degrees_per_pixel(zoom)
    north = scale * (centre_px - y_px) * math.cos(math.radians(lat))
    return lon - scale * (centre_px - x_px), lat + north


@given(lat=st.floats(-70, 70), lon=st.floats(-179, 179), x=st.floats(0, 640), y=st.floats(0, 640))
def test_the_studys_equations_agree_within_their_own_error(
    lat: float, lon: float, x: float, y: float
) -> None:
    zoom = 18
    grid = Grid.web_mercator(lat=lat, lon=lon, zoom=zoom)
    exact = grid.to_lonlat(x, y)
    found = approximate_lonlat(x, y, centre_px=320, centre_lonlat=(lon, lat), zoom=zoom)
    assert found[0] == pytest.approx(exact[0], abs=1e-10)
    # The latitude's error is the second term of the series: half the squared arc times tan.
    arc = math.radians(degrees_per_pixel(zoom)) * abs(y - 320) * math.cos(math.radians(lat))
    allowed = math.degrees(0.5 * arc**2 * abs(math.tan(math.radians(lat)))) * 1.01 + 1e-9
    assert abs(found[1] - exact[1]) <= allowed
    assert allowed < degrees_per_pixel(zoom)


def test_the_studys_constants() -> None:
    assert degrees_per_pixel(18) == pytest.approx(5.36441803e-6, rel=1e-6)
    assert web_mercator_resolution(18) == pytest.approx(0.5971645, abs=5e-7)


@given(lat=st.floats(0, 70), lon=st.floats(-179.9, 179.9), azimuth=st.floats(0, 360))
def test_lengths_in_the_metric_crs_are_geodesic_lengths(
    lat: float, lon: float, azimuth: float
) -> None:
    crs = utm_crs(lon, lat)
    end_lon, end_lat, _ = Geod(ellps="WGS84").fwd(lon, lat, azimuth, 500.0)
    x, y = transformer(LONLAT, crs).transform([lon, end_lon], [lat, end_lat])
    # 32V is wider than other zones: up to 0.14 % at its western border.
    allowed = 1.5e-3 if crs == CRS.from_epsg(32632) and lon < 6 else 1e-3
    assert math.hypot(x[1] - x[0], y[1] - y[0]) == pytest.approx(500.0, rel=allowed)


@pytest.mark.parametrize("lat", [0, 35.075, 52, 70])
def test_ground_resolution_is_what_a_tape_measures(lat: float) -> None:
    grid = Grid.web_mercator(lat=lat, lon=33.5, zoom=18)
    by_sphere = web_mercator_resolution(18) * math.cos(math.radians(lat))
    assert grid.ground_resolution_m == pytest.approx(by_sphere, rel=5e-3)
    assert grid.resolution_at(320, 320) == pytest.approx(grid.ground_resolution_m, rel=1e-9)
    # Far from the stretched metres of EPSG:3857 wherever the cosine matters.
    if lat:
        assert grid.ground_resolution_m < 0.99 * web_mercator_resolution(18)


def test_grid_north_turns_with_the_meridians() -> None:
    crs = CRS.from_epsg(32636)
    x, y = transformer(LONLAT, crs).transform(33.0, 35.0)
    assert grid_north_deg(crs, x, y) == pytest.approx(0.0, abs=1e-6)
    x, y = transformer(LONLAT, crs).transform(35.0, 35.0)
    assert grid_north_deg(crs, x, y) == pytest.approx(2 * math.sin(math.radians(35)), abs=0.01)


@pytest.mark.parametrize(
    ("lon", "lat", "code"),
    [
        (33.5, 35.1, 32636),
        (-70.0, -33.0, 32719),
        (5.3, 60.4, 32632),
        (15.0, 78.0, 32633),
        (25.0, 78.0, 32635),
        (8.0, 78.0, 32631),
        (9.0, 78.0, 32633),
        (10.0, 72.0, 32633),
        (41.9, 72.0, 32637),
        (10.0, 71.9, 32632),
        (2.9, 60.0, 32631),
        (3.0, 56.0, 32632),
        (5.0, 64.0, 32631),
        (33.0, -80.0, 32736),
        (0.0, 84.0, 5041),
        (0.0, 85.0, 5041),
        (180.0, 10.0, 32601),
        (0.0, -85.0, 5042),
    ],
)
def test_utm_zones_with_their_exceptions(lon: float, lat: float, code: int) -> None:
    assert utm_crs(lon, lat) == CRS.from_epsg(code)


def test_a_picture_in_utm_keeps_its_own_datum() -> None:
    assert metric_crs(-117.4, 33.9, own=CRS.from_epsg(26911)) == CRS.from_epsg(26911)
    assert metric_crs(-117.4, 33.9, own=WEB_MERCATOR) == CRS.from_epsg(32611)


@pytest.mark.parametrize(
    "arguments",
    [
        {"zoom": 23},
        {"zoom": -1},
        {"zoom": 17.5},
        {"zoom": "18"},
        {"width_px": 9.5},
        {"lat": 86.0},
        {"lat": math.nan},
        {"lon": 181.0},
    ],
)
def test_impossible_web_mercator_grids_are_refused(arguments: dict[str, Any]) -> None:
    with pytest.raises(GridError):
        Grid.web_mercator(**{"lat": 35.0, "lon": 33.0, "zoom": 18, **arguments})


def test_impossible_grids_and_crs_are_refused() -> None:
    with pytest.raises(GridError, match="no pixels"):
        Grid(0, 5, Affine.identity(), WEB_MERCATOR)
    with pytest.raises(GridError, match="inverted"):
        Grid(5, 5, Affine(0, 0, 0, 0, 0, 0), WEB_MERCATOR)
    with pytest.raises(CRSError, match="no coordinate reference system"):
        Grid(5, 5, Affine.identity(), None)
    with pytest.raises(CRSError, match="Unknown"):
        Grid(5, 5, Affine.identity(), "EPSG:999999")  # type: ignore[arg-type]
