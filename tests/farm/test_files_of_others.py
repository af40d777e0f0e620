"""Fields in files as other programs leave them, given to `geofield tracks`."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import geopandas as gpd
import pyogrio
import pytest
import shapely

from geofield_command import run_geofield

NAME = "Höfe ß"
FIELD = gpd.GeoDataFrame(
    {"name": [NAME]}, geometry=[shapely.box(500000, 5500000, 500200, 5500150)], crs=32633
)


def tracks(folder: Path, file: str) -> tuple[int, str]:
    done = run_geofield("tracks", file, "--spacing", 9, "-o", "plan.gpkg", folder=folder)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr


@pytest.mark.parametrize(("says", "code"), [(None, 0), ("KLINGON", 0), ("UTF-8", 1)])
def test_a_shapefile_in_latin_1(tmp_path: Path, says: str | None, code: int) -> None:
    """Without a word of its encoding, as most programs write it, its names ended in a traceback."""
    pyogrio.write_dataframe(FIELD, tmp_path / "a.shp", encoding="ISO-8859-1")
    (tmp_path / "a.cpg").unlink()
    if says is not None:
        (tmp_path / "a.cpg").write_text(says)
    found, told = tracks(tmp_path, "a.shp")
    assert found == code, told
    assert (NAME if code == 0 else "not in the encoding it claims") in told


def test_a_list_as_the_name(tmp_path: Path) -> None:
    shape = shapely.geometry.mapping(FIELD.to_crs(4326).geometry[0])
    feature = {"type": "Feature", "properties": {"name": ["north", "south"]}, "geometry": shape}
    (tmp_path / "a.geojson").write_text(json.dumps(feature))
    code, told = tracks(tmp_path, "a.geojson")
    assert code == 0, told
    assert "north" in told


def test_a_zip_whose_files_lie_in_a_folder(tmp_path: Path) -> None:
    """As portals hand them out; `geofield import` read them, and nothing else did."""
    for name in ("a", "b"):
        pyogrio.write_dataframe(FIELD, tmp_path / f"{name}.shp")
    for archive, names in (("one.zip", "a"), ("two.zip", "ab"), ("none.zip", "")):
        with zipfile.ZipFile(tmp_path / archive, "w") as file:
            for name in names:
                for part in tmp_path.glob(f"{name}.*"):
                    file.write(part, f"Export 2026/{part.name}")
    code, told = tracks(tmp_path, "one.zip")
    assert code == 0, told
    (tmp_path / "plan.gpkg").unlink()  # what is there already is told first
    code, told = tracks(tmp_path, "two.zip")
    assert code == 1
    assert "two.zip has 2 layers: a, b." in told
    line = "batch two.zip --layer b --spacing 9 --workers 1 --out farm"
    assert run_geofield(*line.split(), folder=tmp_path).returncode == 0
    code, told = tracks(tmp_path, "none.zip")
    assert code == 1
    assert told.startswith("Error: none.zip holds no product"), told


def test_a_plan_in_a_zip_is_not_planned_without_its_obstacles(tmp_path: Path, sample: Path) -> None:
    """Its outline alone was taken: tracks ran through 21 trees, and nothing was told."""
    with zipfile.ZipFile(tmp_path / "plan.zip", "w") as file:
        file.write(sample / "field_1.gpkg", "field_1.gpkg")
    code, told = tracks(tmp_path, "plan.zip")
    assert code == 1, told
    assert "plan.zip holds field_1.gpkg of geofield" in told
    assert "Unpack it" in told
    assert not (tmp_path / "plan.gpkg").exists()


def test_of_a_recorded_round_the_next_step_is_told(tmp_path: Path) -> None:
    ring = FIELD.to_crs(4326).geometry[0].exterior.coords
    points = "".join(f'<trkpt lat="{lat}" lon="{lon}"/>' for lon, lat in ring)
    (tmp_path / "round.gpx").write_text(
        '<gpx version="1.1" creator="x" xmlns="http://www.topografix.com/GPX/1/1">'
        f"<trk><name>round</name><trkseg>{points}</trkseg></trk></gpx>"
    )
    code, told = tracks(tmp_path, "round.gpx")
    assert code == 1
    step = "geofield import round.gpx -o field.gpkg"
    assert step in " ".join(told.split())
    assert run_geofield(*step.split()[1:], folder=tmp_path).returncode == 0
    assert tracks(tmp_path, "field.gpkg")[0] == 0
