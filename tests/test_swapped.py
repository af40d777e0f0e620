"""Latitude and longitude exchanged, both in range: noticed where something else can tell."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import pytest
import shapely

from geofield_command import run_geofield

SAMPLE = Path(__file__).parents[1] / "sample_data"
LAT, LON = 35.075373, 33.531142


def refused(*args: object) -> str:
    """Run the command as a process; what it said when it refused."""
    done = run_geofield(*args)
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    return " ".join(done.stderr.split())


@pytest.fixture
def parcels(tmp_path: Path) -> Path:
    """The sample's field with its coordinates in the wrong order."""
    table = gpd.read_file(SAMPLE / "field_1.gpkg", layer="field").to_crs(4326)
    swapped = shapely.transform(table.geometry.to_numpy(), lambda xy: xy[:, ::-1])
    path = tmp_path / "parcels.geojson"
    gpd.GeoDataFrame({"name": ["mine"]}, geometry=swapped, crs=4326).to_file(path)
    return path


def run(out: Path, *more: object, lat: float = LAT, lon: float = LON) -> tuple[object, ...]:
    where = ("--lat", lat, "--lon", lon, "--out", out, "--spacing", 6)
    return ("run", SAMPLE / "field_1.tif", *where, "--format", "gpkg", *more)


def test_a_swapped_point(tmp_path: Path) -> None:
    told = refused(*run(tmp_path / "out", lat=LON, lon=LAT))
    assert f"look swapped: try --lat {LAT} --lon {LON}" in told


@pytest.mark.parametrize("option", ["--include-lonlat", "--exclude-lonlat"])
def test_a_swapped_further_point(option: str, tmp_path: Path) -> None:
    told = refused(*run(tmp_path / "out", option, f"{LAT},{LON}"))
    assert f"of {option} lies outside" in told
    assert f"look swapped: try {option} {LON},{LAT}" in told


def test_a_swapped_parcel(parcels: Path, tmp_path: Path) -> None:
    assert "swapped" in refused(*run(tmp_path / "out", "--boundary", parcels))


def test_a_swapped_parcel_without_a_point(parcels: Path, tmp_path: Path) -> None:
    """It told of a point that nobody had given, and how to give it otherwise."""
    where = (SAMPLE / "field_1.tif", "--boundary", parcels)
    told = refused("run", *where, "--spacing", 6, "--out", tmp_path / "out")
    assert "boundary mine lies outside the picture. Its latitude and longitude look sw" in told
    assert "--lat" not in told
    table = gpd.read_file(parcels).translate(0, 80)
    gpd.GeoDataFrame(geometry=table).to_file(parcels)
    told = refused("field", *where, "-o", tmp_path / "plan.gpkg")
    assert "they look swapped with longitudes. Exchange them in the file" in told


def test_a_swapped_parcel_by_name(parcels: Path, tmp_path: Path) -> None:
    told = refused(*run(tmp_path / "out", "--boundary", parcels, "--boundary-name", "mine"))
    assert "mine lies outside the picture" in told
    assert "swapped" in told


def test_swapped_obstacles(tmp_path: Path) -> None:
    table = gpd.read_file(SAMPLE / "field_1.gpkg", layer="obstacles").to_crs(4326)
    swapped = shapely.transform(table.geometry.to_numpy(), lambda xy: xy[:, ::-1])
    gpd.GeoDataFrame(geometry=swapped, crs=4326).to_file(tmp_path / "trees.geojson")
    field = gpd.read_file(SAMPLE / "field_1.gpkg", layer="field")
    field.to_file(tmp_path / "field.geojson")
    told = refused(
        "tracks", tmp_path / "field.geojson", "--obstacles", tmp_path / "trees.geojson",
        "--spacing", 6, "-o", tmp_path / "plan.gpkg",
    )  # fmt: skip
    assert "swapped" in told


def test_a_swapped_line(tmp_path: Path) -> None:
    field = gpd.read_file(SAMPLE / "field_1.gpkg", layer="field")
    field.to_file(tmp_path / "field.geojson")
    told = refused(
        "tracks", tmp_path / "field.geojson", "--spacing", 6, "-o", tmp_path / "plan.gpkg",
        "--ab-lonlat", LAT, LON, LAT + 0.001, LON,
    )  # fmt: skip
    assert "swapped" in told
