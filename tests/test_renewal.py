"""Products beside a plan: told when they are older than it, and renewed by one command."""

from __future__ import annotations

import json
import os
import sqlite3
import subprocess
import time
from contextlib import closing
from pathlib import Path

import geopandas as gpd
import pytest
import shapely

from geofield.renewal import outdated
from geofield.simulate import SimulatedField
from geofield.staging import written_ns
from geofield_command import run_geofield

PRODUCTS = ["field.rdf", "geojson/", "map.png", "obstacles.rdf", "report.json", "shapefile/"]
PRODUCTS += ["tracks.rdf"]


def geofield(*words: object) -> subprocess.CompletedProcess[str]:
    return run_geofield(*words, check=True)


@pytest.fixture(scope="module")
def out(
    simulated: SimulatedField, simulated_tif: Path, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    folder = tmp_path_factory.mktemp("renewal") / "my $out; 田"
    point = ("--lat", simulated.lat, "--lon", simulated.lon)
    told = geofield("run", simulated_tif, *point, "--spacing", 8, "--out", folder)
    assert "Older than the plan" not in told.stderr
    return folder


def test_a_stage_says_what_is_older_and_one_command_renews_it(out: Path) -> None:
    plan = out / "field.gpkg"
    before = {name: (out / name).read_bytes() for name in ("map.png", "tracks.rdf")}
    told = geofield("tracks", plan, "--spacing", 12, "-o", plan).stderr
    assert f"Older than the plan: {', '.join(PRODUCTS)} (" in told
    quote = '"' if os.name == "nt" else "'"
    assert f"geofield refresh {quote}{plan}{quote})" in told

    renewed = json.loads(geofield("refresh", plan, "--json").stdout)
    assert renewed["outdated"] == []
    assert {Path(file).relative_to(out).parts[0].rstrip("/") for file in renewed["files"]} == {
        name.rstrip("/") for name in PRODUCTS
    }
    for name, old in before.items():
        assert (out / name).read_bytes() != old
    tracks = gpd.read_file(plan, layer="tracks")
    assert len(gpd.read_file(out / "geojson" / "tracks.geojson")) == len(tracks)
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert report["tracks"]["tracks"] == len(tracks)
    assert set(report["formats"]) == {"gpkg", "geojson", "shapefile", "rdf"}
    assert "Older" not in geofield("export", plan, "-f", "kml", "--out", out).stderr
    # What lies there is of the folder's own plan, not of another one beside it.
    assert "Older" not in geofield("tracks", plan, "--spacing", 9, "-o", out / "wide.gpkg").stderr
    assert json.loads(geofield("refresh", out / "wide.gpkg", "--json").stdout)["files"] == []


def test_what_a_person_has_under_the_plans_name_stays(tmp_path: Path) -> None:
    """The file that was imported, the `.prj` of a Shapefile, a drawing; products are renewed."""
    parcel = gpd.GeoDataFrame(geometry=[shapely.box(33.53, 35.07, 33.532, 35.071)], crs="EPSG:4326")
    parcel.to_file(tmp_path / "parcel.shp")
    parcel.to_file(tmp_path / "parcel.kml", driver="KML")
    parcel.geometry.to_file(tmp_path / "parcel.dxf", driver="DXF")
    (tmp_path / "parcel.ttl").write_text("@prefix gf: <https://w3id.org/geofield#> .")
    own = {file: file.read_bytes() for file in tmp_path.iterdir()}
    plan = tmp_path / "parcel.gpkg"
    geofield("import", tmp_path / "parcel.kml", "-o", plan)
    assert "Older" not in geofield("tracks", plan, "--spacing", 9, "-o", plan).stderr
    assert json.loads(geofield("refresh", plan, "--json").stdout)["files"] == []
    assert {file: file.read_bytes() for file in own} == own

    plan = plan.rename(tmp_path / "other.gpkg")
    kinds = ["kml", "gpx", "dxf", "turtle", "jsonld", "ntriples", "html", "fiboa"]
    wanted = [word for kind in kinds for word in ("-f", kind)]
    geofield("export", plan, *wanted, "--stem", "other", "--out", tmp_path)
    made = json.loads(geofield("refresh", plan, "--json").stdout)["files"]
    ends = {"kml", "gpx", "dxf", "prj", "ttl", "jsonld", "nt", "html", "geojson", "parquet"}
    assert {Path(file).suffix[1:] for file in made} == ends


def test_what_a_run_did_not_write_again_is_told(
    out: Path, simulated: SimulatedField, simulated_tif: Path
) -> None:
    point = ("--lat", simulated.lat, "--lon", simulated.lon)
    told = geofield(
        "run", simulated_tif, *point, "--out", out, "--format", "gpkg", "--overwrite"
    ).stderr
    line = next(line for line in told.splitlines() if line.startswith("Older than the plan"))
    assert "geojson/" in line
    assert "map.png" not in line
    # Taking a run back makes all products older: they are of the other plan.
    assert "map.png" in geofield("undo", out / "field.gpkg").stderr


def test_the_study_files_are_renewed_as_such(out: Path, tmp_path: Path) -> None:
    plan = tmp_path / "field.gpkg"
    plan.write_bytes((out / "field.gpkg").read_bytes())
    geofield("export", plan, "-f", "rdf-study", "--out", tmp_path)
    geofield("tracks", plan, "--spacing", 16, "-o", plan)
    geofield("refresh", plan)
    assert b"www.DLC.org/Obstacle#" in (tmp_path / "obstacles.rdf").read_bytes()[:4096]
    assert not (tmp_path / "map.png").exists()


def test_an_edit_that_lies_in_the_log_beside_the_plan_counts(tmp_path: Path) -> None:
    plan, product = tmp_path / "field.gpkg", tmp_path / "map.png"
    with closing(sqlite3.connect(plan)) as file:
        file.execute("PRAGMA journal_mode = WAL")
        file.execute("CREATE TABLE field (name TEXT)")
        file.commit()
        file.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        product.write_bytes(b"")
        # An empty log is no edit.
        os.utime(product, ns=(written_ns(plan),) * 2)
        os.utime(tmp_path / "field.gpkg-wal", ns=(written_ns(plan) + 10**9,) * 2)
        assert outdated(plan) == []
        file.execute("INSERT INTO field VALUES ('Home')")
        file.commit()
        os.utime(tmp_path / "field.gpkg-wal", ns=(written_ns(product) + 10**9,) * 2)
        assert outdated(plan) == ["map.png"]


def test_a_plan_is_not_searched_for_who_made_it(tmp_path: Path) -> None:
    """A review of 3000 ha, whose plan has 1 GB, ended 24 s after Ctrl-C."""
    plan = tmp_path / "field.gpkg"
    plan.touch()
    os.truncate(plan, 1 << 30)
    began = time.monotonic()
    assert outdated(plan) == []
    assert time.monotonic() - began < 3
