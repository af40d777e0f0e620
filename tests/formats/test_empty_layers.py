"""Every format and profile writes every layer that is empty, or of which only untyped cells are."""

from __future__ import annotations

import dataclasses

import fiona
import pandas as pd
import pytest
from formats_plan import make_dataset

from geofield import schema
from geofield.errors import FormatError
from geofield.formats import FORMATS, write_dataset
from geofield.formats.shapefile_profiles import PROFILES
from geofield_command import run_geofield

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")
PRODUCTS: list[tuple[str, dict[str, str]]] = [
    (name, {}) for name in FORMATS if name not in ("shapefile", "scene")
]
PRODUCTS += [("shapefile", {"profile": profile}) for profile in PROFILES]
#: A terminal's files and AgOpenGPS's are of one field, or none.
ONE_FIELD = ("isoxml", "isoxml-v3", "agopengps", "map", "map-svg", "map-pdf", "report", "html")


def without(case):
    dataset = make_dataset(points=False, optional=case == "nothing is round")
    tables = dict(dataset.tables)
    if case == "all":
        tables = {}
    elif case == "all are round":
        tables["obstacles"] = tables["obstacles"].dropna(subset="radius_m")
    elif case == "nothing is round":
        tables["obstacles"] = tables["obstacles"][tables["obstacles"]["radius_m"].isna()]
    elif case == "untyped cells":
        tables["obstacles"] = tables["obstacles"].assign(
            kind=None, status=None, confidence=pd.Series([None] * 4, dtype=object)
        )
    elif case == "all rejected":
        tables["obstacles"] = tables["obstacles"].assign(status="rejected")
    elif case in tables:
        tables[case] = schema.empty(schema.layer(case), dataset.crs)
    return dataclasses.replace(dataset, tables=tables)


@pytest.mark.parametrize("case", [
    "field", "obstacles", "tracks", "segments", "gaps", "all", "all are round",
    "nothing is round", "untyped cells", "all rejected",
])  # fmt: skip
@pytest.mark.parametrize(("name", "options"), PRODUCTS, ids=lambda v: v if type(v) is str else "")
def test_every_format_with_every_empty_layer(tmp_path, name, options, case):
    dataset = without(case)
    if case in ("field", "all") and name in ONE_FIELD:
        with pytest.raises(FormatError, match="one field; there are 0"):
            write_dataset(dataset, tmp_path, [name], options=options)
        return
    written = write_dataset(dataset, tmp_path, [name], options=options)
    assert written
    assert all(path.stat().st_size for path in written)


@pytest.mark.parametrize("profile", list(PROFILES))
def test_empty_shapefiles_have_the_columns_of_full_ones(tmp_path, profile):
    columns: dict[str, dict[str, object]] = {}
    for name, dataset in (("full", make_dataset()), ("empty", without("obstacles"))):
        write_dataset(dataset, tmp_path / name, ["shapefile"], options={"profile": profile})
        columns[name] = {}
        for file in (tmp_path / name).rglob("*.shp"):
            with fiona.open(file) as source:
                columns[name][file.name] = (source.schema, source.crs.to_epsg())
                if name == "empty" and "Feature" in file.name:
                    assert len(source) == 0
    for file, found in columns["empty"].items():
        assert found == columns["full"][file]


def test_plans_with_round_obstacles_alone_and_with_none(tmp_path):
    write_dataset(without("all are round"), tmp_path / "round", ["gpkg"])
    write_dataset(without("obstacles"), tmp_path / "none", ["gpkg"])
    for plan in ("round", "none"):
        for profile in PROFILES:
            done = run_geofield(
                "export", tmp_path / plan / "field.gpkg", "-f", "shapefile", "--profile", profile,
                "--out", tmp_path / plan / profile,
            )  # fmt: skip
            assert done.returncode == 0, done.stderr
            assert "room on the disk" not in done.stderr


def test_long_doubts_are_cut_and_names_are_not(tmp_path):
    dataset = make_dataset(points=False)
    dataset.tables["field"].loc[0, "doubts"] = "the border is weak in the north; " * 20
    write_dataset(dataset, tmp_path, ["shapefile"])
    with fiona.open(tmp_path / "shapefile" / "boundary.shp") as source:
        (row,) = source
    assert row.properties["doubts"].endswith("…")
    assert len(row.properties["doubts"].encode()) <= 254


def test_what_tracks_run_through_is_no_obstacle_of_a_terminal(tmp_path):
    dataset = make_dataset(points=False)
    dataset.tables["obstacles"]["status"] = ["detected", "possible", "rejected", "added"]
    write_dataset(dataset, tmp_path, ["shapefile"])
    numbers = {}
    for file in (tmp_path / "shapefile").glob("obstacles*.shp"):
        with fiona.open(file) as source:
            numbers[file.stem] = [row.properties["obst_no"] for row in source]
    assert numbers == {
        "obstacles": [1, 4], "obstacles_possible": [2], "obstacles_rejected": [3]
    }  # fmt: skip
