"""The schema keeps its promises: names, order, types."""

from __future__ import annotations

import geopandas as gpd
import pandas as pd
import pytest
from pyproj import CRS
from shapely import Point, box

import geofield as gf
from geofield import schema
from geofield.errors import FormatError
from geofield.model.scene import ROLES

PROMISED = {
    "field": "field_id name area_ha perimeter_m longest_edge_m heading_deg method imagery "
    "imagery_date licence certainty doubts",
    "obstacles": "obstacle_no kind status radius_m buffer_m confidence x_px y_px radius_px lat lon",
    "tracks": "track_no heading_deg segment_count gap_count point_count length_m",
    "segments": "track_no segment_no length_m",
    "gaps": "track_no gap_no length_m cause obstacle_no",
    "track_points": "point_no track_no segment_no x_px y_px lat lon",
}


@pytest.mark.parametrize("name", PROMISED)
def test_columns_are_the_promised_ones(name: str) -> None:
    assert schema.layer(name).column_names == PROMISED[name].split()


@pytest.mark.parametrize("layer", schema.LAYERS, ids=lambda layer: layer.name)
def test_every_layer_is_well_formed(layer: schema.Layer) -> None:
    assert len(set(layer.column_names)) == len(layer.columns)
    short = [column.shapefile for column in layer.columns]
    assert len(set(short)) == len(short)
    assert all(0 < len(name) <= 10 for name in short)
    assert set(layer.key) <= set(layer.column_names)
    assert layer.title
    assert layer.description.endswith(".")
    for column in layer.columns:
        unit = column.name.rpartition("_")[2]
        if unit in ("m", "ha", "deg", "px"):
            assert column.unit, column.name
            assert schema.unit_in_words(column) == {"deg": "°"}.get(unit, unit)
        meaning = schema.meaning(layer, column)
        assert meaning.endswith(".")
        assert len(meaning) > len(column.title)
    table = schema.empty(layer, CRS("EPSG:32636"))
    assert list(table.columns) == [*layer.column_names, "geometry"]
    assert table.crs == "EPSG:32636"


def test_the_heading_of_a_field_says_of_what_it_is() -> None:
    """Of its tracks, as soon as there are any: these run askew to its longest piece."""
    field = gf.Field(box(500_000, 3_880_000, 500_300, 3_880_200), crs="EPSG:32636")
    tracks = gf.plan_tracks(field, spacing_m=20.0, direction=45.0)
    alone, planned = (
        gf.Plan(field=field, tracks=each).to_dataset().table("field")["heading_deg"].iloc[0]
        for each in (None, tracks)
    )
    assert (alone, planned) == (pytest.approx(90.0, abs=0.1), pytest.approx(45.0))
    meaning = schema.meaning(schema.FIELD, schema.FIELD.column("heading_deg"))
    assert meaning.startswith("Direction of the tracks, without any that of the longest piece")


def test_conform_brings_any_table_into_shape() -> None:
    frame = gpd.GeoDataFrame(
        {
            "segment_no": [1, 2.0, 1],
            "mine": ["x", "y", "z"],
            "track_no": ["2", "1", None],
            "length_m": [1, 2, None],
        },
        geometry=[Point(0, 0), Point(1, 1), Point(2, 2)],
        crs="EPSG:32636",
    )
    done = schema.conform(schema.SEGMENTS, frame)
    assert list(done.columns) == ["track_no", "segment_no", "length_m", "geometry"]
    assert done["track_no"].tolist()[:2] == [1, 2]
    assert pd.isna(done["track_no"].iloc[2])
    assert str(done["track_no"].dtype) == "Int64"
    assert done.equals(schema.conform(schema.SEGMENTS, done))


def test_unknown_names_are_refused() -> None:
    with pytest.raises(FormatError, match="no layer 'trees'"):
        schema.layer("trees")
    with pytest.raises(FormatError, match="no column 'size'"):
        schema.OBSTACLES.column("size")
    assert len(set(ROLES)) == len(ROLES)
