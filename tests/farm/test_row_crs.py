"""Files of places in more than one CRS: told, and nothing written; layers each have their own."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import geopandas as gpd
import pytest
import shapely

from geofield.farm import read_places
from geofield_command import run_geofield

SHAPES = [shapely.box(10.0 + i / 500, 50.0, 10.001 + i / 500, 50.001) for i in range(3)]
PARCELS = gpd.GeoDataFrame({"id": [1, 2, 3]}, geometry=SHAPES, crs=4326)


def said_of(path: Path) -> str:
    """What the command says; it writes nothing."""
    farm = path.parent / "farm"
    done = run_geofield("batch", path, "--workers", 1, "--out", farm)
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert not farm.exists() or not list(farm.rglob("*"))
    return done.stderr


def named(epsg: int) -> dict[str, Any]:
    return {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{epsg}"}}


@pytest.mark.parametrize("where", ["feature", "geometry"])
def test_a_feature_that_says_another_crs(where: str, tmp_path: Path) -> None:
    PARCELS.to_file(tmp_path / "p.geojson")
    content = json.loads((tmp_path / "p.geojson").read_text())
    second = content["features"][1]
    (second if where == "feature" else second["geometry"])["crs"] = named(31467)
    (tmp_path / "p.geojson").write_text(json.dumps(content))
    said = said_of(tmp_path / "p.geojson")
    assert "row 2 is in urn:ogc:def:crs:EPSG::31467 by its own word" in said
    # The same word as the file's is none, nor is a column of that name.
    second["crs"] = second["geometry"]["crs"] = named(4326)
    second["properties"]["crs"] = "EPSG:31467"
    (tmp_path / "p.geojson").write_text(json.dumps(content))
    assert len(read_places(tmp_path / "p.geojson")) == 3


def test_degrees_in_a_file_that_says_metres(tmp_path: Path) -> None:
    PARCELS.to_file(tmp_path / "p.geojson")
    content = json.loads((tmp_path / "p.geojson").read_text()) | {"crs": named(25832)}
    (tmp_path / "p.geojson").write_text(json.dumps(content))
    said = said_of(tmp_path / "p.geojson")
    assert "is in EPSG:25832 by its own word, and its coordinates look like degrees" in said


def test_a_geopackage_with_a_row_of_another_zone(tmp_path: Path) -> None:
    for epsg in (25832, 25833):
        PARCELS.to_crs(epsg).to_file(tmp_path / f"{epsg}.gpkg", layer="p", SPATIAL_INDEX="NO")
    with (
        closing(sqlite3.connect(tmp_path / "25832.gpkg")) as mixed,
        closing(sqlite3.connect(tmp_path / "25833.gpkg")) as other,
    ):
        (stray,) = other.execute("SELECT geom FROM p WHERE fid = 3").fetchone()
        mixed.execute("DROP TRIGGER IF EXISTS trigger_update_feature_count_p")
        mixed.execute("UPDATE p SET geom = ? WHERE fid = 3", (stray,))
        mixed.commit()
    said = said_of(tmp_path / "25832.gpkg")
    assert "row 3 is in system 25833 by its own word" in said


def test_layers_of_a_geopackage_each_have_their_crs(tmp_path: Path) -> None:
    for epsg in (4326, 25832):
        PARCELS.to_crs(epsg).to_file(tmp_path / "p.gpkg", layer=f"in {epsg}")
    assert "has 2 layers: in 4326, in 25832" in said_of(tmp_path / "p.gpkg")
    for epsg in (4326, 25832):
        places = read_places(tmp_path / "p.gpkg", layer=f"in {epsg}")
        assert places.lat == pytest.approx([50.0005] * 3, abs=1e-6)
