"""What machines are told of a plan whose tracks a person took away, bent or drew anew."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from click.testing import CliRunner

import geofield as gf
from geofield.cli.main import cli
from geofield.formats import read_dataset, validate_file
from geofield_command import run_geofield

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")
Lines = tuple[list[tuple[float, float]], ...]
CRS = "EPSG:32633"
X, Y = 500_000.0, 5_540_000.0


def _run(*command: object) -> str:
    done = CliRunner().invoke(cli, [str(each) for each in command], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


def _planned(folder: Path, *how: object) -> Path:
    """A plan of ten tracks of 200 m, 6 m apart, from west to east."""
    parcel = gpd.GeoDataFrame(geometry=[shapely.box(X, Y, X + 200, Y + 60)], crs=CRS)
    parcel.to_file(folder / "parcel.gpkg")
    plan = folder / "plan.gpkg"
    _run("tracks", folder / "parcel.gpkg", "--spacing", 6, "--direction", 90, *how, "-o", plan)
    return plan


def _edited(
    plan: Path, *, taken: tuple[int, ...] = (), drawn: tuple[list[tuple[float, float]], ...] = ()
) -> None:
    """As in a GIS: rows of the tracks deleted, lines added; then planned again."""
    tracks = gpd.read_file(plan, layer="tracks")
    lines = [shapely.MultiLineString([np.add(line, (X, Y))]) for line in drawn]
    more = gpd.GeoDataFrame(geometry=lines, crs=tracks.crs)
    left = pd.concat([tracks[~tracks["track_no"].isin(taken)], more], ignore_index=True)
    left.to_file(plan, layer="tracks", mode="w")
    _run("tracks", plan, "-o", plan, "--overwrite")


BENT = [(40.0, 10.0), (100.0, 50.0), (160.0, 12.0)]


def test_agopengps_drives_the_bends_of_a_drawn_line(tmp_path: Path) -> None:
    plan = _planned(tmp_path)
    _edited(plan, drawn=(BENT,))
    _run("export", plan, "--format", "agopengps", "--out", tmp_path / "out")
    (folder,) = (tmp_path / "out" / "agopengps" / "Fields").iterdir()
    back = read_dataset(folder).table("tracks").to_crs(CRS)
    wanted = gpd.read_file(plan, layer="tracks")
    assert len(back) == len(wanted) == 11
    apart = shapely.hausdorff_distance(back.geometry.to_numpy(), wanted.geometry.to_numpy())
    assert apart.max() < 0.01
    rows = (folder / "TrackLines.txt").read_text().splitlines()
    at = rows.index("Track 11")
    mode, count = rows[at + 5], int(rows[at + 7])
    assert (mode, rows[6]) == ("4", "2")
    points = np.array([row.split(",") for row in rows[at + 8 : at + 8 + count]], dtype=float)
    steps = np.diff(points[:, :2], axis=0)
    assert np.hypot(*steps.T).max() < 1.01
    # The heading of a straight stretch is that of its step.
    assert points[5, 2] == pytest.approx(np.arctan2(*steps[5]), abs=2e-3)
    assert not [each for each in validate_file(folder) if each.level == "error"]


def test_what_is_copied_in_place_is_driven_once_and_told_once(tmp_path: Path) -> None:
    plan = _planned(tmp_path)
    for layer in ("tracks", "segments"):
        rows = gpd.read_file(plan, layer=layer)
        pd.concat([rows, rows[:2]]).to_file(plan, layer=layer, mode="w")
    done = run_geofield("export", plan, "--format", "geojson", "--out", tmp_path / "out")
    told = " ".join(done.stderr.split())
    for layer in ("tracks", "segments"):
        assert told.count(f"Layer '{layer}': 2 rows are copied in place and count once") == 1
        assert len(gpd.read_file(tmp_path / f"out/geojson/{layer}.geojson")) == 10


@pytest.mark.parametrize(
    ("how", "taken", "drawn", "right"),
    [
        ((), (), (BENT,), 9),
        # Beside the field's pattern, at its direction: the pattern does not reach it.
        ((), (), ([(10.0, 58.0), (190.0, 58.0)],), 9),
        ((), (2, 3, 4, 5, 6, 7, 8, 9), (), 9),
        ((), (10,), (), 8),
        # The last track is shifted back and lies 2 m behind its neighbour.
        (("--last-strip", "shift", "--offset", 7), (), (), 9),
    ],
)
def test_the_pattern_of_isoxml_is_that_of_the_plan(
    tmp_path: Path, how: tuple[object, ...], taken: tuple[int, ...], drawn: Lines, right: int
) -> None:
    plan = _planned(tmp_path, *how)
    if taken or drawn:
        _edited(plan, taken=taken, drawn=drawn)
    _run("export", plan, "-f", "isoxml", "-f", "isoxml-v3", "--out", tmp_path / "out")
    data = ET.parse(tmp_path / "out" / "isoxml" / "TASKDATA" / "TASKDATA.XML").getroot()
    reference, *explicit = list(data.iter("GPN"))
    assert len(explicit) == len(gf.read_plan(plan).tracks.segments)
    sides = sorted(int(reference.get(side)) for side in "NO")
    assert sides == [0, right]
    for name in ("isoxml", "isoxml-v3"):
        data = ET.parse(tmp_path / "out" / name / "TASKDATA" / "TASKDATA.XML").getroot()
        assert {line.get("C") for line in data.iter("LSG") if line.get("A") == "5"} == {"6000"}
