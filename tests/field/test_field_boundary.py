"""The user's own parcel instead of extraction."""

from typing import Any

import geopandas as gpd
import pandas as pd
import pytest
import shapely

from geofield.errors import CRSError, FieldError, FieldWarning, GeofieldError
from geofield.field import field_from_boundary

LAT, LON = 50.0, 10.0
A = shapely.box(9.999, 49.999, 10.001, 50.001)
B = shapely.box(10.002, 49.999, 10.004, 50.001)


def parcels(crs="EPSG:4326"):
    return gpd.GeoDataFrame({"name": ["A", "B"], "id": [7, 8]}, geometry=[A, B], crs=crs)


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:25832", "EPSG:3857", "EPSG:3035"])
def test_the_parcel_at_the_point_in_any_crs(crs):
    field = field_from_boundary(parcels().to_crs(crs), lat=LAT, lon=LON)
    assert field.name == "A"
    assert field.method == "boundary"
    assert field.crs.utm_zone == "32N"
    truth = parcels().to_crs(32632).geometry.iloc[0]
    assert field.area_ha * 1e4 == pytest.approx(truth.area, rel=1e-3)


def test_a_parcel_of_an_old_datum_is_told():
    india = parcels().translate(67.0, -22.0).to_crs(24378)
    with pytest.warns(FieldWarning, match="The boundary: Positions in EPSG:24378 are good to 22 m"):
        field_from_boundary(india.to_frame("geometry"), lat=28.0, lon=77.0)


def test_what_else_the_file_has_in_the_parcel_is_told():
    """Tracks ran through a pond of the same file without a word."""
    across = shapely.LineString([(9.999, 50.0), (10.001, 50.0003)])
    inside = [shapely.Point(LON, LAT).buffer(1e-4), across, shapely.Point(10.0001, 49.9995)]
    # The same parcel as of another year, its border as a line, and what lies elsewhere.
    others = [B, A.buffer(1e-5), A.exterior, across.buffer(1e-5).difference(A), None]
    crs = "EPSG:4326"
    for shape in inside:
        both = gpd.GeoDataFrame(geometry=[A, *others, shape], crs=crs).to_crs(32632)
        with pytest.warns(FieldWarning, match="1 more shape lies in this parcel") as told:
            field_from_boundary(both, lat=50.0005, lon=LON)
        assert len(told) == 1
    quiet = gpd.GeoDataFrame({"name": ["A", *"bcdef"]}, geometry=[A, *others], crs=crs)
    assert field_from_boundary(quiet, lat=50.0005, lon=LON).name == "A"


def test_a_parcel_by_name_or_number():
    assert field_from_boundary(parcels(), lat=LAT, lon=LON, name="B").name == "B"
    assert field_from_boundary(parcels(), lat=LAT, lon=LON, name="8").name == "B"
    with pytest.raises(FieldError, match="named 'C'"):
        field_from_boundary(parcels(), lat=LAT, lon=LON, name="C")


def test_parcels_of_one_name_are_told_apart_by_a_point():
    """The smallest was taken, wherever the point lay."""
    both = parcels().assign(name="West", crop="wheat")
    both.loc[1, "geometry"] = shapely.box(10.002, 49.999, 10.003, 50.001)
    for name in ("West", "wheat"):
        found = field_from_boundary(both, lat=LAT, lon=LON, name=name)
        assert found.polygon_lonlat.covers(shapely.Point(LON, LAT))
        with pytest.raises(FieldError, match="2 parcels of the boundary file are named") as caught:
            field_from_boundary(both, name=name)
        assert "--lat and --lon" in caught.value.hint
    with pytest.raises(FieldError, match="contains lat 51"):
        field_from_boundary(both, lat=51.0, lon=LON, name="West")


def test_a_name_counts_before_an_id_and_other_values():
    mixed = parcels().assign(name=["8", "B"], crop=["B", "rye"])
    assert field_from_boundary(mixed, name="8").name == "8"
    assert field_from_boundary(mixed, name="B").polygon_lonlat.centroid.x > 10.002
    # An id beside a missing one is read as 7.0.
    assert field_from_boundary(parcels().assign(name=None, id=[7.0, None]), name="7").name == "7"


def test_a_parcel_without_a_point():
    """The only one, or the one named: the CRS is that of its own place."""
    alone = field_from_boundary(parcels().iloc[:1])
    assert (alone.name, alone.crs.utm_zone) == ("A", "32N")
    assert field_from_boundary(parcels(), name="B").name == "B"
    with pytest.raises(FieldError, match="holds 2 polygons") as caught:
        field_from_boundary(parcels())
    assert "--boundary-name" in caught.value.hint


def test_the_smallest_of_overlapping_parcels():
    nested = parcels()
    nested.loc[1, "geometry"] = shapely.box(9.9995, 49.9995, 10.0005, 50.0005)
    assert field_from_boundary(nested, lat=LAT, lon=LON).name == "B"


def test_clear_refusals():
    with pytest.raises(FieldError, match="contains lat 51"):
        field_from_boundary(parcels(), lat=51.0, lon=LON)
    with pytest.raises(CRSError, match="no coordinate reference system"):
        field_from_boundary(parcels(None), lat=LAT, lon=LON)
    points = gpd.GeoDataFrame(geometry=[shapely.Point(LON, LAT)], crs=4326)
    with pytest.raises(FieldError, match="no polygon"):
        field_from_boundary(points, lat=LAT, lon=LON)


def test_a_closed_line_is_an_outline_where_there_is_no_polygon():
    lines = parcels().set_geometry(parcels().boundary)
    field = field_from_boundary(lines, lat=LAT, lon=LON)
    assert field.polygon.equals(field_from_boundary(parcels(), lat=LAT, lon=LON).polygon)
    opened = lines.set_geometry([shapely.LineString(list(x.coords)[:-1]) for x in lines.geometry])
    with pytest.raises(FieldError, match="no closed line") as refused:
        field_from_boundary(opened.set_crs(4326), lat=LAT, lon=LON)
    assert "Lines to polygons" in refused.value.hint
    mixed = gpd.GeoDataFrame(pd.concat([parcels().iloc[1:], lines.iloc[:1]]), crs=4326)
    with pytest.raises(FieldError, match="contains lat"):
        field_from_boundary(mixed, lat=LAT, lon=LON)


def test_an_invalid_parcel_is_repaired_and_flagged():
    bow = shapely.Polygon([(9.999, 49.999), (10.001, 50.001), (10.001, 49.999), (9.999, 50.0005)])
    table = gpd.GeoDataFrame({"name": ["bow"]}, geometry=[bow], crs=4326)
    field = field_from_boundary(table, lat=49.9998, lon=10.0008)
    assert field.polygon.is_valid
    assert field.quality is not None
    assert not field.quality.trusted
    (told,) = field.quality.reasons
    assert told.endswith(f"repaired: {field.area_ha:.2f} ha kept, 0.51 ha left out")
    # A point says which of its parts is meant.
    smaller = field_from_boundary(table, lat=50.0, lon=9.9992)
    assert smaller.area_ha == pytest.approx(0.51, abs=0.005)
    assert field_from_boundary(table).area_ha == pytest.approx(field.area_ha)


def test_holes_and_parts_are_kept():
    ring: Any = A.difference(shapely.box(9.9999, 49.9999, 10.0001, 50.0001))
    table = gpd.GeoDataFrame({"name": ["x"]}, geometry=[shapely.MultiPolygon([ring, B])], crs=4326)
    with pytest.warns(FieldWarning, match="The parcel has 2 parts: only the one with the point"):
        field = field_from_boundary(table, lat=50.0005, lon=10.0005)
    assert len(list(field.polygon.interiors)) == 1
    # Rows of one index, as of tables that were put together, are no parts.
    together = parcels().set_index(pd.Index([0, 0]))
    assert field_from_boundary(together, lat=LAT, lon=LON).name == "A"


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("point", [(None, None), (-16.8005, 179.9995), (-16.8005, -179.9995)])
def test_a_parcel_across_180_degrees_is_one(tmp_path, cut, point):
    """Cut there, as in GeoJSON, half of it was taken; else it went round the world."""
    from geofield.cli.parcels import parcel_and_point

    sides = [shapely.box(179.999, -16.801, 180, -16.8), shapely.box(-180, -16.801, -179.999, -16.8)]
    west, south, east, north = -179.999, -16.801, 179.999, -16.8
    ring = shapely.Polygon([(east, south), (west, south), (west, north), (east, north)])
    file = tmp_path / "parcel.geojson"
    shape = shapely.MultiPolygon(sides) if cut else ring
    gpd.GeoDataFrame(geometry=[shape], crs=4326).to_file(file)
    field, _, lon = parcel_and_point(file, None, None, *point)
    assert field is not None
    assert field.area_ha == pytest.approx(2.36, abs=0.01)
    assert abs(abs(lon) - 180) < 0.002


@pytest.mark.parametrize(("text", "told"), [
    ('name;geometry\nmine;"{degrees}"\n', None),
    ('name,wkt\nmine,"{degrees}"\n', None),
    ('name,wkt\nmine,"{metres}"\n', "no coordinate reference system"),
    ("Easting;Northing\n500000,0;5200000,0\n500100,5;5200000,0\n", "but 2 points"),
    ("lat,lon\n47.0,15.0\n47.0,15.1\n", "but 2 points"),
    ("a,b\n1,2\n", "no columns lat and lon and no geometry"),
])  # fmt: skip
def test_a_table_of_outlines(text, told, tmp_path):
    """Shapes as text are read; of a table without them it is told what it has."""
    from geofield.cli.parcels import parcel_and_point

    metres = gpd.GeoSeries([shapely.box(500_000, 5_200_000, 500_100, 5_200_100)], crs=32633)
    degrees = metres.to_crs(4326)
    file = tmp_path / "parcels.csv"
    file.write_text(text.format(metres=metres.iloc[0].wkt, degrees=degrees.iloc[0].wkt))
    if told is None:
        field = parcel_and_point(file, None, None, None, None)[0]
        assert (field.name, round(field.area_ha, 2)) == ("mine", 1.0)
        return
    with pytest.raises(GeofieldError, match=told) as refused:
        parcel_and_point(file, None, None, None, None)
    assert "ogrinfo" not in str(refused.value)


def test_that_only_the_first_of_several_layers_has_the_parcels_is_told(tmp_path, capsys):
    from geofield.cli.parcels import parcel_and_point

    file = tmp_path / "mine.gpkg"
    for layer, east in (("winter", 500_000), ("summer", 501_000)):
        shape = shapely.box(east, 5_200_000, east + 100, 5_200_100)
        gpd.GeoDataFrame({"name": [layer]}, geometry=[shape], crs=32633).to_file(file, layer=layer)
    assert parcel_and_point(file, None, None, None, None)[0].name == "winter"
    told = "of its layers winter, summer the first is taken"
    assert told in " ".join(capsys.readouterr().err.split())
    assert parcel_and_point(file, "summer", None, None, None)[0].name == "summer"
    assert told not in " ".join(capsys.readouterr().err.split())
