"""A plan to review: a run of the real command on the sample, copied for each test."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import pytest
from shapely import LineString

from geofield.model import Alternative
from geofield.plan import read_plan
from geofield.plan_files import save_plan
from geofield_command import run_geofield

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `geofield run` leaves of the first sample field."""
    folder = tmp_path_factory.mktemp("run")
    picture = ROOT / "sample_data" / "field_1.tif"
    options = ["--lat", "35.075373", "--lon", "33.531142", "--spacing", "4", "--format", "gpkg"]
    run_geofield("run", picture, *options, "--out", folder, check=True)
    return folder


@pytest.fixture
def plan_path(run_folder: Path, tmp_path: Path) -> Path:
    """A copy of the plan, with its picture beside it."""
    for name in ("field.gpkg", "scene.tif"):
        shutil.copy(run_folder / name, tmp_path / name)
    return tmp_path / "field.gpkg"


@pytest.fixture
def doubtful_path(plan_path: Path) -> Path:
    """The plan, with another outline that may be meant."""
    plan = read_plan(plan_path)
    (own,) = plan.field.alternatives
    narrower = Alternative(own.polygon.buffer(-20.0), 0.01)
    field = replace(plan.field, alternatives=(own, narrower))
    save_plan(replace(plan, field=field), plan_path, read_from=plan_path)
    return plan_path


@pytest.fixture
def bent_path(plan_path: Path) -> Path:
    """The plan, with its longest track bent by hand, 3 m to its side at the middle."""
    segments = gpd.read_file(plan_path, layer="segments")
    row = segments.length.idxmax()
    (x0, y0), (x1, y1) = segments.geometry[row].coords
    aside = 3.0 / segments.geometry[row].length
    middle = (x0 + x1) / 2 + (y1 - y0) * aside, (y0 + y1) / 2 - (x1 - x0) * aside
    segments.loc[row, "geometry"] = LineString([(x0, y0), middle, (x1, y1)])
    segments.to_file(plan_path, layer="segments", driver="GPKG", geometry_name="geom")
    return plan_path
