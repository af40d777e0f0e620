"""The oldest versions that pyproject.toml allows do the work as the newest do."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, get_args

import pyogrio
import pytest

from geofield.settings import FormatName

ROOT = Path(__file__).resolve().parents[2]
OLDEST = ROOT / "requirements" / "oldest.txt"
PICTURE = ROOT / "sample_data" / "field_1.tif"
PLACE = ["--lat", "35.075373", "--lon", "33.531142"]


def test_the_lock_holds_the_bounds_of_the_project() -> None:
    locked = dict(re.findall(r"^([a-z0-9-]+)==([\w.]+)", OLDEST.read_text(), re.MULTILINE))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    for dependency in project["dependencies"]:
        name, bound = dependency.partition(";")[0].split(">=")
        assert f"{locked[name]}.".startswith(f"{bound}."), f"make lock: {name} {locked[name]}"


@pytest.fixture(scope="module")
def oldest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A Python that has those versions, and this checkout."""
    if sys.version_info >= (3, 13):
        pytest.skip("the oldest numpy that is allowed has no wheel for this Python")
    home = tmp_path_factory.mktemp("oldest") / "environment"
    uv, python = Path(sys.executable).with_name("uv"), home / "bin" / "python"
    commands: list[list[Any]] = [
        [uv, "venv", "-q", "--python", sys.executable, home],
        [uv, "pip", "install", "-q", "--python", python, "--require-hashes", "-r", OLDEST],
    ]
    for command in commands:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if "Failed to fetch" in done.stderr:
            pytest.skip("no package index can be reached")
        assert done.returncode == 0, done.stderr
    site = next((home / "lib").glob("python*/site-packages"))
    (site / "geofield.pth").write_text(f"{ROOT / 'src'}\n")
    return python


def geofield(python: Path | str, *arguments: Any, folder: Path) -> str:
    """What a command printed; it ends well."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    command = [python, "-m", "geofield", *arguments]
    done = subprocess.run(
        command, cwd=folder, env=clean, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "Warning" not in done.stderr
    return done.stdout


@pytest.mark.slow
def test_they_do_the_main_job_in_all_formats(oldest: Path, tmp_path: Path) -> None:
    # Linked data and the study's have files of one name.
    names = [name for name in get_args(FormatName) if name != "rdf-study"]
    formats = [part for name in names for part in ("--format", name)]
    run = ["run", PICTURE, *PLACE, "--spacing", "6", "--json", *formats, "--out"]
    ours = json.loads(geofield(sys.executable, *run, "new", folder=tmp_path))
    theirs = json.loads(geofield(oldest, *run, "old", folder=tmp_path))
    assert theirs["formats"].keys() == ours["formats"].keys() > {"gpkg", "isoxml", "study-xml"}
    for part in ("field", "obstacles", "tracks"):
        assert theirs[part] == pytest.approx(ours[part], rel=5e-3)
    geofield(oldest, "validate", "old", folder=tmp_path)
    for name in ("field.rdf", "field.kml", "isoxml", "geojson", "geoparquet", "shapefile"):
        geofield(oldest, "import", f"old/{name}", "-o", f"{name}.gpkg", folder=tmp_path)
    geofield(oldest, "query", "old/tracks.rdf", "length-per-track", folder=tmp_path)


@pytest.mark.slow
def test_they_do_the_stages_and_many_fields(oldest: Path, tmp_path: Path) -> None:
    geofield(oldest, "tiles", PICTURE, *PLACE, "--size-m", "150", "-o", "cut.tif", folder=tmp_path)
    geofield(oldest, "field", "cut.tif", *PLACE, "-o", "one.gpkg", folder=tmp_path)
    study = ["--strategy", "dlc", "-o", "one.gpkg"]
    geofield(oldest, "obstacles", "cut.tif", "one.gpkg", *study, folder=tmp_path)
    geofield(oldest, "tracks", "one.gpkg", "--route", "skip", "-o", "one.gpkg", folder=tmp_path)
    (tmp_path / "places.csv").write_text(f"id,lat,lon\n7,{PLACE[1]},{PLACE[3]}\n")
    geofield(oldest, "batch", "places.csv", PICTURE, "--out", "farm", folder=tmp_path)
    for layer, least in (("field", 1), ("obstacles", 5), ("tracks", 20)):
        assert pyogrio.read_info(tmp_path / "farm" / "farm.gpkg", layer=layer)["features"] >= least
