"""Every importable format: out and back, within the precision that the registry states."""

from __future__ import annotations

import pytest
from formats_compare import assert_same_table
from formats_plan import NAME

from geofield.formats import FORMATS, read_dataset, write_dataset

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")

#: Format, what to read, and the layers that come back row by row.
WHOLE = [
    ("gpkg", "field.gpkg", ("field", "obstacles", "tracks", "segments", "gaps", "track_points")),
    ("geojson", "geojson", ("field", "obstacles", "tracks", "segments", "gaps", "track_points")),
    ("shapefile", "shapefile", ("field", "obstacles", "segments")),
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
            number_tolerance=0.0 if name == "gpkg" else 1e-9,
        )


def test_geopackage_keeps_the_origin(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["gpkg"])
    back = read_dataset(tmp_path / "field.gpkg")
    assert back.provenance == dataset.provenance
    assert back.grid == dataset.grid
    assert back.crs == dataset.crs
