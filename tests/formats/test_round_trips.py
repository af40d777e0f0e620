"""Every importable format: out and back, within the precision that the registry states."""

from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path

import pytest
import shapely
from formats_compare import assert_same_table
from formats_plan import NAME, make_dataset
from hypothesis import given, settings
from hypothesis import strategies as st

from geofield.formats import FORMATS, read_dataset, validate_file, write_dataset
from geofield.formats.names import cut_name

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")

ALL = ("field", "obstacles", "tracks", "segments", "gaps", "track_points")
#: Format, what to read, and the layers that come back row by row.
WHOLE = [
    ("gpkg", "field.gpkg", ALL),
    ("geojson", "geojson", ALL),
    ("geoparquet", "geoparquet", ALL),
    ("flatgeobuf", "flatgeobuf", ALL),
    ("shapefile", "shapefile", ("field", "obstacles", "segments")),
    ("kml", "field.kml", ("field", "obstacles", "tracks", "gaps")),
]


@pytest.mark.parametrize(("name", "product", "layers"), WHOLE)
def test_same_rows_and_shapes(dataset, tmp_path, name, product, layers):
    write_dataset(dataset, tmp_path, [name])
    back = read_dataset(tmp_path / product)
    assert back.crs == dataset.crs
    assert back.name == NAME
    for layer in layers:
        assert_same_table(
            dataset.table(layer),
            back.table(layer),
            precision_m=FORMATS[name].precision_m,
            number_tolerance=0.0 if FORMATS[name].precision_m == 0 else 1e-9,
        )


@pytest.mark.parametrize("name", ["isoxml", "isoxml-v3"])
def test_terminals_get_what_they_drive_by(dataset, tmp_path, name):
    write_dataset(dataset, tmp_path, [name])
    back = read_dataset(tmp_path / name)
    assert back.name == NAME
    kept = dataset.table("obstacles")
    kept = kept[kept["status"] != "rejected"].reset_index(drop=True)
    precision = FORMATS[name].precision_m
    numbers = ["obstacle_no", "kind"] if name == "isoxml" else ["obstacle_no"]
    assert_same_table(
        dataset.table("field"), back.table("field"), precision_m=precision, columns=["name"]
    )
    assert_same_table(kept, back.table("obstacles"), precision_m=precision, columns=numbers)
    for layer, columns in (
        ("segments", ["track_no", "segment_no"]),
        ("tracks", ["track_no", "gap_count"]),
    ):
        assert_same_table(
            dataset.table(layer), back.table(layer), precision_m=precision, columns=columns
        )
    assert set(back.table("obstacles")["status"]) == {"added"}


def test_agopengps_keeps_rings_numbers_and_lines(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["agopengps"])
    back = read_dataset(tmp_path / "agopengps" / "Fields")
    assert back.name == NAME
    precision = FORMATS["agopengps"].precision_m
    assert_same_table(
        dataset.table("field"),
        back.table("field"),
        precision_m=precision,
        columns=["name"],
        same_vertices=False,
    )
    kept = dataset.table("obstacles")
    kept = kept[kept["status"] != "rejected"].reset_index(drop=True)
    kept.geometry = [shapely.Polygon(shape.exterior) for shape in kept.geometry]
    assert_same_table(
        kept,
        back.table("obstacles"),
        precision_m=precision,
        columns=["obstacle_no"],
        same_vertices=False,
    )
    whole = dataset.table("tracks").copy()
    whole.geometry = [
        shapely.multilinestrings([shapely.get_coordinates(line)[[0, -1]]])
        for line in whole.geometry
    ]
    assert_same_table(whole, back.table("tracks"), precision_m=precision, columns=["track_no"])


@pytest.mark.parametrize("name", ["gpkg", "geoparquet"])
def test_lossless_formats_keep_the_origin(dataset, tmp_path, name):
    write_dataset(dataset, tmp_path, [name])
    back = read_dataset(tmp_path / ("field.gpkg" if name == "gpkg" else name))
    assert back.provenance == dataset.provenance
    assert back.grid == dataset.grid
    assert back.crs == dataset.crs


OPTIONAL = ("headland", "headland_tracks", "route", "turns")


@pytest.mark.parametrize("name", ["gpkg", "geojson", "geoparquet", "flatgeobuf"])
def test_layers_that_not_every_plan_has(tmp_path, name):
    dataset = make_dataset(optional=True)
    write_dataset(dataset, tmp_path, [name])
    back = read_dataset(tmp_path / ("field.gpkg" if name == "gpkg" else name))
    for layer in OPTIONAL:
        assert_same_table(
            dataset.table(layer),
            back.table(layer),
            precision_m=FORMATS[name].precision_m,
            number_tolerance=1e-9,
        )


def test_terminals_get_the_headland(tmp_path):
    dataset = make_dataset(optional=True)
    write_dataset(dataset, tmp_path, ["isoxml", "shapefile"], options={"profile": "tracklead"})
    text = (tmp_path / "isoxml" / "TASKDATA" / "TASKDATA.XML").read_text(encoding="utf-8")
    assert text.count('<PLN A="10"') == 1
    assert [f.level for f in validate_file(tmp_path / "isoxml") if f.level == "error"] == []
    names = {path.name for path in (tmp_path / "shapefile").glob("*.shp")}
    assert names == {
        f"Grosser_Acker_Nandu_{kind}.shp"
        for kind in ("boundary", "obstacles", "guidancepath", "headland")
    }


# Characters that XML has no way to write are refused (test_bad_input).
TEXTS = st.text(
    st.characters(codec="utf-8", exclude_categories=["Cc", "Cs", "Cn"]), min_size=1, max_size=40
)


@given(TEXTS, st.sampled_from(["gpkg", "geojson", "shapefile", "isoxml", "kml", "geoparquet"]))
@settings(max_examples=25, deadline=None)
def test_any_name_survives(text, name):
    name_there = text.strip() or "x"
    dataset = make_dataset(points=False)
    field = dataset.tables["field"].assign(name=name_there)
    small = dataclasses.replace(dataset, tables={"field": field}, name=name_there)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        write_dataset(small, out, [name])
        read = {"gpkg": "field.gpkg", "kml": "field.kml"}
        back = read_dataset(out / read.get(name, name))
    expected = cut_name(name_there, 32) if name == "isoxml" else name_there
    assert back.name == expected
