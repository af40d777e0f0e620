"""The part of a picture that is read shows the whole field, whatever was known before."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
import rasterio.shutil
import rasterio.windows
from shapely.affinity import translate

import geofield as gf
from geofield.crs import LONLAT, transformer
from geofield.errors import ObstacleWarning, PointOutsideError
from geofield.imagery import reader, scene
from geofield.pipeline import plan_field, run_obstacles
from geofield.plan import Plan, read_plan
from geofield.settings import load_settings
from geofield.windows import scene_of_plan

SAMPLE = Path(__file__).parents[1] / "sample_data"
PICTURE = SAMPLE / "field_1.tif"
LAT, LON = 35.0754216, 33.5310261
COARSE = pytest.mark.filterwarnings("ignore:The picture is coarse")
TRUTH = read_plan(SAMPLE / "field_1.gpkg")


def settings(size_m: float | None = None) -> gf.Settings:
    return load_settings(None, {"imagery": {"size_m": size_m}, "tracks": {"spacing_m": 12.0}})


def overlap(plan: Plan) -> float:
    one, other = plan.field.polygon, TRUTH.field.polygon
    return float(one.intersection(other).area / one.union(other).area)


@pytest.fixture
def enormous(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the sample were too large to be read as a whole: 480 px, 288 m."""
    for module in (reader, scene):
        monkeypatch.setattr(module, "MAX_SIDE_PX", 300)
    monkeypatch.setattr("geofield.windows.WINDOW_M", 100.0)


@COARSE
@pytest.mark.usefixtures("enormous")
def test_the_window_in_an_enormous_picture_grows_with_the_field() -> None:
    plan = plan_field(PICTURE, lat=LAT, lon=LON, settings=settings())
    assert overlap(plan) > 0.95
    assert not plan.doubts
    assert plan.settings is not None
    assert plan.settings.imagery.size_m is None  # nobody asked for one


@COARSE
@pytest.mark.usefixtures("enormous")
@pytest.mark.parametrize("size_m", [None, 90.0])
def test_a_parcel_is_shown_as_a_whole(size_m: float | None) -> None:
    plan = plan_field(PICTURE, lat=LAT, lon=LON, settings=settings(size_m), boundary=TRUTH.field)
    assert not any("does not show" in doubt for doubt in plan.evidence.obstacle_doubts)
    assert plan.obstacles is not None
    assert len(plan.obstacles) >= 18  # of 21, in coarse pixels


def test_obstacles_are_looked_for_where_the_window_had_grown_to() -> None:
    """Eleven of 21 were found again, for the window had the size that was asked for at first."""
    asked = settings(120.0)
    plan = plan_field(PICTURE, lat=LAT, lon=LON, settings=asked)
    assert plan.obstacles is not None
    again = run_obstacles(plan, scene_of_plan(PICTURE, plan, asked), settings=asked)
    assert again.obstacles is not None
    assert len(again.obstacles) == len(plan.obstacles) >= 20
    assert not again.evidence.obstacle_doubts


def test_a_drawn_outline_is_shown_as_a_whole() -> None:
    """A re-run keeps it, and looks for obstacles in all of it."""
    asked = settings(60.0)
    plan = plan_field(PICTURE, lat=LAT, lon=LON, settings=asked, boundary=TRUTH.field)
    moved = replace(plan.field, polygon=plan.field.polygon.buffer(-2.0))
    drawn = Plan(moved, evidence=plan.evidence)
    again = plan_field(PICTURE, lat=LAT, lon=LON, settings=asked, previous=drawn)
    assert again.field.polygon.equals(drawn.field.polygon)
    assert not again.evidence.obstacle_doubts


def test_a_parcel_of_which_the_picture_shows_a_part_beside_its_middle(tmp_path: Path) -> None:
    """Through every door: the part that is shown is searched, and the rest is told."""
    with rasterio.open(PICTURE) as opened:
        window = rasterio.windows.Window(0, 0, 480, 170)
        profile = {**opened.profile, "height": 170, "driver": "GTiff"}
        profile["transform"] = opened.window_transform(window)
        pixels = opened.read(window=window)
    with rasterio.open(tmp_path / "part.tif", "w", **profile) as part:
        part.write(pixels)
        part.set_band_description(4, "nir")
    lon, lat = TRUTH.field.inside_lonlat
    with pytest.warns(ObstacleWarning, match="does not show"):
        plan = plan_field(
            tmp_path / "part.tif", lat=lat, lon=lon, settings=settings(), boundary=TRUTH.field
        )
    assert plan.obstacles is not None
    assert 3 <= len(plan.obstacles) < 12
    elsewhere = replace(TRUTH.field, polygon=translate(TRUTH.field.polygon, 5000.0))
    lon, lat = elsewhere.inside_lonlat
    with pytest.raises(PointOutsideError):
        plan_field(tmp_path / "part.tif", lat=lat, lon=lon, settings=settings(), boundary=elsewhere)


def test_a_parcel_with_a_gap_of_the_data_in_its_middle(tmp_path: Path) -> None:
    lon, lat = TRUTH.field.inside_lonlat
    with rasterio.open(PICTURE) as opened:
        profile, pixels = {**opened.profile, "driver": "GTiff"}, opened.read()
        row, column = opened.index(*transformer(LONLAT, TRUTH.field.crs).transform(lon, lat))
    mask = np.full(pixels.shape[1:], 255, np.uint8)
    mask[row - 20 : row + 20, column - 20 : column + 20] = 0
    with (
        rasterio.Env(GDAL_TIFF_INTERNAL_MASK=True),
        rasterio.open(tmp_path / "gap.tif", "w", **profile) as gap,
    ):
        gap.write(pixels)
        gap.write_mask(mask)
        gap.set_band_description(4, "nir")
    at: dict[str, Any] = {"lat": lat, "lon": lon, "settings": settings()}
    with pytest.warns(ObstacleWarning, match="does not show 2% of the field"):
        plan = plan_field(tmp_path / "gap.tif", **at, boundary=TRUTH.field)
    assert plan.obstacles is not None
    assert len(plan.obstacles) >= 20
    with pytest.raises(PointOutsideError, match="no data"):
        plan_field(tmp_path / "gap.tif", **at)
