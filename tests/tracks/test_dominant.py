"""The way tracks run: the same though a border is cut into many edges, and why is told."""

from __future__ import annotations

import csv
import json
import os
import warnings
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from click.testing import CliRunner
from rasterio.warp import transform
from shapely import Polygon
from shapely.affinity import rotate

from geofield.cli.main import cli
from geofield.errors import FieldWarning
from geofield.field import extract_field
from geofield.imagery import read_scene
from geofield.tracks import longest_edge, plan_tracks
from geofield.tracks.dominant import dominant_edge

CRS = 32611
SHARED = Path(os.environ.get("GEOFIELD_SHARED", Path(__file__).parents[2].parent / "shared"))
TREES = SHARED / "data" / "trees"


def meadow(*, pieces: int) -> shapely.Polygon:
    """60 m by 107 m; the long eastern border is cut into pieces that stray by some degrees."""
    y = np.linspace(0.0, 107.0, pieces + 1)
    x = 60.0 + np.where(np.arange(pieces + 1) % 2, 0.0, 2.2)
    x[[0, -1]] = 60.0
    # The western border bends, so that the short southern one is the longest straight edge.
    west = [(0.0, 107.0), (9.0, 72.0), (8.0, 36.0), (0.0, 0.0)]
    ring = np.array([*zip(x, y, strict=True), *west])
    return shapely.Polygon(ring + np.array([440_000, 3_770_000]))


@pytest.mark.parametrize("pieces", [1, 2, 6])
def test_a_border_cut_into_pieces_counts_as_one(pieces: int) -> None:
    outline = meadow(pieces=pieces)
    heading = plan_tracks(outline, crs=CRS, spacing_m=3.0).heading_deg
    assert abs((heading + 90.0) % 180.0 - 90.0) < 10.0
    if pieces == 6:
        edge = plan_tracks(outline, crs=CRS, spacing_m=3.0, direction="longest_edge").heading_deg
        assert edge == pytest.approx(90.0, abs=1.0)


@pytest.mark.parametrize("along_px", [0, 7, 60])
@pytest.mark.parametrize("stray_m", [0.0, 0.02])
def test_vertices_on_a_straight_border_change_nothing(along_px: int, stray_m: float) -> None:
    """As a surveyor or a receiver sets them: one every two metres of the long sides."""
    x = np.linspace(0.0, 234.0, 120)
    ring = np.array([*((each, 0.0) for each in x), *((each, 100.0) for each in x[::-1])])
    ring += np.random.default_rng(1).normal(0.0, stray_m, ring.shape)
    outline = shapely.Polygon(np.roll(ring, along_px, axis=0) + np.array([440_000, 3_770_000]))
    tracks = plan_tracks(outline, crs=CRS, spacing_m=3.0)
    assert abs(tracks.heading_deg - 90.0) < 0.6  # grid north is not true north
    assert tracks.direction_why.startswith("along an edge of 234 m; 70 %")


def test_why_is_told_and_what_fewest_would_save(tmp_path: Path) -> None:
    corners = [
        (0, 0),
        (60, 0),
        (60, 30),
        (10, 30),
        (10, 34),
        (60, 34),
        (60, 66),
        (10, 66),
        (10, 70),
    ]
    comb = np.array([*corners, (60, 70), (60, 100), (0, 100)])
    outline = shapely.Polygon(comb + np.array([440_000, 3_770_000]))
    gpd.GeoDataFrame(geometry=[outline], crs=CRS).to_file(tmp_path / "comb.gpkg", layer="parcel")
    told = []
    for direction in ("dominant", "fewest"):
        done = CliRunner().invoke(
            cli,
            ["tracks", str(tmp_path / "comb.gpkg"), "--spacing", "4", "--direction", direction,
             "-o", str(tmp_path / f"{direction}.gpkg"), "--json"],
        )  # fmt: skip
        assert done.exception is None, done.output
        told.append(json.loads(done.stdout)["fields"][0])
    ours, fewest = told
    assert ours["track_count"] > fewest["track_count"]
    assert "% of the border run that way" in ours["direction_why"]
    saved = f"fewest would need {fewest['track_count']} tracks instead of {ours['track_count']}"
    assert ours["direction_why"].endswith(saved)
    assert fewest["direction_why"] == ""


@pytest.mark.real
@pytest.mark.skipif(not TREES.is_dir(), reason=f"no real pictures in {TREES}")
def test_a_meadow_photographed_in_three_years_is_worked_the_same_way() -> None:
    with (TREES / "field_truth.csv").open() as file:
        row = next(r for r in csv.DictReader(file) if r["image"] == "claremont_2020_75")
    headings = []
    for year in (2016, 2018, 2020):
        path = TREES / f"claremont_{year}_75.tif"
        with rasterio.open(path) as picture:
            x, y = picture.transform @ (float(row["seed_x_px"]), float(row["seed_y_px"]))
            beyond = picture.transform @ (135.0, 200.0)
            places = transform(picture.crs, "EPSG:4326", *zip((x, y), beyond, strict=True))
        (lon, apart_lon), (lat, apart_lat) = places
        scene = read_scene(path, lat=lat, lon=lon)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FieldWarning)
            # In one of the years the ground beyond the eastern border looks the same.
            field = extract_field(scene, lat=lat, lon=lon, exclude=[(apart_lon, apart_lat)])
        tracks = plan_tracks(field.polygon, crs=field.crs, spacing_m=4.0, grid=scene.grid)
        headings.append(tracks.heading_deg)
    turn = (np.subtract.outer(headings, headings) + 90.0) % 180.0 - 90.0
    assert np.abs(turn).max() < 3.0, headings


@pytest.mark.parametrize("find", [longest_edge, lambda outline: dominant_edge(outline)[0]])
def test_a_vertex_more_or_one_twice_leaves_the_edge_where_it_is(find: Any) -> None:
    """Of two sides as long the one of fewer vertices counted; a vertex twice bent the direction."""
    for turned_deg in (0, 20, 50, 140):
        ring = shapely.get_coordinates(rotate(shapely.box(0, 0, 100, 60), turned_deg))[:-1]
        edge = find(Polygon(ring))
        for at in range(4):
            for share in (0.0, 0.3, 0.5):
                more = (1.0 - share) * ring[at] + share * ring[(at + 1) % 4]
                other = find(Polygon(np.insert(ring, at + 1, more, axis=0)))
                assert np.hypot(other.x0 - edge.x0, other.y0 - edge.y0) < 1e-6
                assert np.hypot(other.x1 - edge.x1, other.y1 - edge.y1) < 1e-6
    stairs = np.array([[0, 0], [60, 0], [60, 20.3], [62, 41], [20, 60], [0, 61.0]])
    edge = find(Polygon(stairs))
    for at in range(6):
        assert find(Polygon(np.insert(stairs, at, stairs[at], axis=0))) == edge
