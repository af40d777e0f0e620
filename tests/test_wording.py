"""What is told in Python speaks Python; on the command line it speaks of options."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import pytest
import shapely

import geofield as gf
import geofield.settings  # knows what its options are called
from geofield.wording import in_python
from geofield_command import run_geofield

SAMPLE = Path(__file__).parents[1] / "sample_data" / "field_1.tif"
PLAN = SAMPLE.with_suffix(".gpkg")


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("for instance --spacing 3.", "for instance spacing_m=3."),
        ("Name it: --crs EPSG:4326, for instance.", 'Name it: crs="EPSG:4326", for instance.'),
        ("or use --missing mask to leave", 'or use missing="mask" to leave'),
        ("Add --size-m 400.", "Add size_m=400."),
        ("--min-hole, --headland or --include-lonlat", "min_hole_m2, headland_m or include"),
        ("see `geofield info --json`, or --fresh", "see `geofield info --json`, or previous=None"),
    ],
)  # fmt: skip
def test_options_become_names(said: str, told: str) -> None:
    assert in_python(said) == told


def test_an_error_speaks_to_both() -> None:
    with pytest.raises(gf.GeofieldError, match="for instance spacing_m=3") as caught:
        gf.plan_field(SAMPLE, lat=35.075373, lon=33.531142, spacing_m=6000)
    assert "--" not in str(caught.value)
    assert caught.value.hint.endswith("--spacing 3.")
    plan = SAMPLE.with_suffix(".gpkg")
    done = run_geofield("tracks", plan, "--spacing", 6000, "-o", "never.gpkg")
    assert "--spacing 3." in done.stderr


def test_commands_count_in_words_and_give_no_figure_that_is_none(tmp_path: Path) -> None:
    """They told of "1 obstacles", a status "nan", and a bias of "nan m (nan to nan)"."""
    trees = gpd.GeoDataFrame(geometry=[shapely.Point(500_000, 5_300_000)], crs="EPSG:32633")
    trees.to_file(tmp_path / "tree.gpkg")
    done = run_geofield("import", tmp_path / "tree.gpkg", "-o", tmp_path / "plan.gpkg", check=True)
    assert "1 obstacle in" in done.stderr
    done = run_geofield("evaluate", PLAN, tmp_path / "tree.gpkg", check=True)
    assert "0 hits of 21 detected and 1 true obstacle\n" in done.stderr
    assert "radius bias  no figure" in done.stderr
    assert "nan" not in done.stderr
    edited = Path(shutil.copy(PLAN, tmp_path / "edited.gpkg"))
    obstacles = gpd.read_file(edited, layer="obstacles")
    obstacles.loc[obstacles.index[0], "status"] = None
    obstacles.to_file(edited, layer="obstacles")
    assert "  without a status: 1\n" in run_geofield("info", edited, check=True).stdout


def test_an_error_names_an_argument_though_no_settings_were_loaded() -> None:
    """It spoke of "exclude_lonlat" and "clearance", which no function takes."""
    code = (
        "import sys, geofield as gf\n"
        "error = gf.GeofieldError('Not --exclude-lonlat.', hint='Give a --clearance.')\n"
        "assert 'geofield.settings' not in sys.modules\n"
        "print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "Not exclude. Give a clearance_m.\n"
