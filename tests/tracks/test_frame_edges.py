"""Where the outline is the picture's edge, its frame or where its data end, it is no edge to drive
along."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely
from affine import Affine
from click.testing import CliRunner
from pyproj import CRS
from shapely import Polygon

import geofield as gf
from geofield.cli.main import cli
from geofield.grid import Grid
from geofield.imagery.write import write_scene
from geofield.model.frame import along_frame
from geofield.model.scene import Scene
from geofield.tracks import plan_tracks
from geofield.tracks.longest_edge import longest_edge

UTM = CRS.from_epsg(32636)
GRID = Grid(200, 200, Affine(1.0, 0, 500_000, 0, -1.0, 3_900_200), UTM)
FRAME = shapely.box(500_000, 3_900_000, 500_200, 3_900_200)
#: Cut off by the picture on three sides; its own border runs north-east.
CUT = Polygon(
    [(500_000, 3_900_000), (500_200, 3_900_000), (500_200, 3_900_140), (500_000, 3_900_060)]
)


def test_the_fields_own_edge_is_taken_though_the_frame_is_as_long() -> None:
    free = longest_edge(CUT)
    own = longest_edge(CUT, outside=along_frame(CUT, UTM, GRID))
    slope = (own.y1 - own.y0) / (own.x1 - own.x0)
    assert slope == pytest.approx(80 / 200, abs=1e-6)
    assert own.length == pytest.approx((200**2 + 80**2) ** 0.5, abs=1e-6)
    assert free.length >= own.length


def test_tracks_follow_the_fields_own_edge() -> None:
    steep = Polygon(
        [(500_000, 3_900_000), (500_200, 3_900_000), (500_090, 3_900_200), (500_000, 3_900_200)]
    )
    without = plan_tracks(steep, crs=UTM, spacing_m=5.0, direction="longest_edge")
    within = plan_tracks(steep, crs=UTM, spacing_m=5.0, grid=GRID)
    assert within.heading_deg == pytest.approx(180 - 28.81, abs=1.5)
    assert without.heading_deg == pytest.approx(within.heading_deg, abs=1.5)
    corner = [(500_000, 3_900_000), (500_200, 3_900_000), (500_200, 3_900_060)]
    cut = Polygon([*corner, (500_060, 3_900_200), (500_000, 3_900_200)])
    assert plan_tracks(cut, crs=UTM, spacing_m=5.0).heading_deg != pytest.approx(135, abs=1)
    tracks = plan_tracks(cut, crs=UTM, spacing_m=5.0, grid=GRID)
    assert tracks.heading_deg == pytest.approx(135, abs=1)


def test_a_field_that_fills_the_picture_still_gets_tracks() -> None:
    tracks = plan_tracks(FRAME, crs=UTM, spacing_m=5.0, grid=GRID)
    assert len(tracks.lines) == 40


@pytest.fixture(scope="module")
def half(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Polygon]:
    """A picture that shows half a square field of 100 m, cut at its diagonal, and that half.

    The field's own borders have headings of 80 and 170 degrees, the cut has 35.
    """
    rng = np.random.default_rng(3)
    grid = Grid(400, 400, Affine(0.5, 0, 500_000, 0, -0.5, 3_900_200), UTM)
    rows, columns = np.indices(grid.shape)
    x, y = (columns + 0.5) / 2 - 100, 100 - (rows + 0.5) / 2
    east, north = np.cos(np.radians(10)), np.sin(np.radians(10))
    u, v = x * east + y * north, y * east - x * north
    inside = (abs(u) < 50) & (abs(v) < 50)
    bands = np.where(inside, [[[70]], [[120]], [[60]]], [[[160]], [[130]], [[100]]])
    bands = np.clip(bands + rng.normal(0, 4, bands.shape), 0, 255).astype(np.uint8)
    scene = Scene(grid, bands, ("red", "green", "blue"), u > v)
    corners = np.array([(-50, -50), (50, -50), (50, 50)]) @ [[east, north], [-north, east]]
    corners += (500_100, 3_900_100)
    path = write_scene(scene, tmp_path_factory.mktemp("half") / "half.tif")
    return path, Polygon(corners)


def _run(*command: object) -> None:
    done = CliRunner().invoke(cli, [str(each) for each in command], catch_exceptions=False)
    assert done.exit_code == 0, done.output


@pytest.mark.parametrize("direction", ["dominant", "longest_edge"])
def test_tracks_do_not_follow_the_end_of_the_data(
    half: tuple[Path, Polygon], tmp_path: Path, direction: str
) -> None:
    picture, shown = half
    lon, lat = gf.Field(shown, UTM).inside_lonlat
    place = ("--lat", lat, "--lon", lon)
    how = ("--spacing", 5, "--direction", direction)
    _run("run", picture, *place, *how, "--format", "gpkg", "--out", tmp_path / "out")
    plan = gf.read_plan(tmp_path / "out" / "field.gpkg")
    assert plan.field.polygon.symmetric_difference(shown).area < 0.05 * shown.area
    row = plan.to_dataset().table("field").iloc[0]
    assert row["heading_deg"] % 90 == pytest.approx(80, abs=1.5)
    assert 90 < row["longest_edge_m"] < 103
    # The tracks' command, and a review, know it from the plan.
    _run("tracks", tmp_path / "out" / "field.gpkg", *how, "-o", tmp_path / "again.gpkg")
    again = gf.read_plan(tmp_path / "again.gpkg").to_dataset().table("field").iloc[0]
    assert again["heading_deg"] == row["heading_deg"]


def test_a_parcel_of_ones_own_is_whole_though_the_data_end_at_it(
    half: tuple[Path, Polygon], tmp_path: Path
) -> None:
    picture, shown = half
    gpd.GeoDataFrame(geometry=[shown], crs=UTM).to_file(tmp_path / "parcel.gpkg")
    how = ("--spacing", 5, "--direction", "longest_edge", "--format", "gpkg")
    _run("run", picture, "--boundary", tmp_path / "parcel.gpkg", *how, "--out", tmp_path / "out")
    plan = gf.read_plan(tmp_path / "out" / "field.gpkg")
    row = plan.to_dataset().table("field").iloc[0]
    assert row["heading_deg"] == pytest.approx(35, abs=0.1)
    assert row["longest_edge_m"] == pytest.approx(100 * 2**0.5, abs=0.1)
