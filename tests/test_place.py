"""The id of a field: the same place gives the same id."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely
from pyproj import CRS

import geofield as gf
from geofield.crs import metric_crs
from geofield.model.place import place_id

SHARED = Path(__file__).parents[2] / "shared" / "data"


def parcels() -> list[tuple[shapely.Polygon, CRS]]:
    file = SHARED / "fields" / "fields.gpkg"
    if not file.is_file():
        pytest.skip(f"no real parcels in {file}")
    found = []
    for shape in gpd.read_file(file).explode(ignore_index=True).geometry:
        crs = metric_crs(shape.centroid.x, shape.centroid.y)
        found.append((gpd.GeoSeries([shape], crs=4326).to_crs(crs)[0], crs))
    return found


@pytest.mark.real
def test_another_outline_of_the_same_field_has_the_same_id() -> None:
    rng = np.random.default_rng(1)
    same = []
    for polygon, crs in parcels():
        ident = place_id(polygon, crs)
        for _ in range(10):
            where = polygon.exterior.interpolate(rng.uniform(), normalized=True)
            bulge = where.buffer(0.1 * np.sqrt(polygon.area))
            other = polygon.union(bulge) if rng.random() < 0.5 else polygon.difference(bulge)
            other = max(shapely.get_parts(other), key=shapely.area)
            same.append(place_id(other, crs) == ident)
        # A row of trees less, or seen from a little farther off.
        moved = shapely.affinity.translate(polygon.buffer(-1.0), 0.5, -0.5)
        same.append(place_id(max(shapely.get_parts(moved), key=shapely.area), crs) == ident)
    assert np.mean(same) > 0.95


@pytest.mark.real
def test_parcels_beside_each_other_have_different_ids() -> None:
    ids = [place_id(polygon, crs) for polygon, crs in parcels()]
    assert len(set(ids)) == len(ids)


@pytest.mark.real
def test_a_meadow_in_three_years() -> None:
    ids = set()
    for year in (2016, 2018, 2020):
        picture = SHARED / "trees" / f"claremont_{year}_75.tif"
        if not picture.is_file():
            pytest.skip(f"no {picture}")
        scene = gf.read_scene(picture)
        lon, lat = scene.grid.to_lonlat(48, 180)
        ids.add(gf.extract_field(scene, lat=lat, lon=lon).field_id)
    assert ids == {"34.088N117.738W"}


@pytest.mark.parametrize(
    ("lon", "lat"), [(33.53, 35.075), (179.9995, -17.2), (-0.0004, 0.0003), (-70.0, -33.4)]
)
def test_the_id_lies_in_the_field_and_does_not_hang_on_the_zone(lon: float, lat: float) -> None:
    ids = set()
    here = metric_crs(lon, lat)
    x, y = gpd.GeoSeries([shapely.Point(lon, lat)], crs=4326).to_crs(here)[0].coords[0]
    box = shapely.box(x - 90, y - 60, x + 90, y + 60)
    for crs in (here, CRS.from_proj4(f"+proj=laea +lat_0={lat} +lon_0={lon}")):
        there = gpd.GeoSeries([box], crs=here).to_crs(crs)[0]
        ids.add(place_id(there, crs))
    (ident,) = ids
    side = "N" if "N" in ident else "S"
    north, east = ident[:-1].split(side)
    point = shapely.Point(
        float(east) * (1 if ident[-1] == "E" else -1), float(north) * (1 if side == "N" else -1)
    )
    inside = gpd.GeoSeries([point], crs=4326).to_crs(here)[0]
    assert box.contains(inside)
    # Rounder than the field is large: no more digits than are needed.
    assert len(north.partition(".")[2]) <= 4


def test_a_ring_of_a_field_still_has_an_id() -> None:
    crs = CRS.from_epsg(32636)
    around = shapely.Point(548000, 3881000).buffer(100).exterior.buffer(1)
    assert place_id(around, crs) == place_id(shapely.Polygon(around.exterior), crs)


def test_the_id_of_a_strip_half_around_the_world_fills_no_memory() -> None:
    """Its roundest latitude came with 22 million longitudes, and in 300 seconds."""
    degree_m = 111_319.49
    strip = shapely.box(-100 * degree_m, 1_020_000, 125 * degree_m, 1_020_002)
    tracemalloc.start()
    assert place_id(strip, CRS(3857)) == "9.12402N0.00000E"
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 150e6
