"""Shapes with coordinates that are no numbers: refused by name, whatever the file stands for."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely

from geofield.errors import FieldWarning, TrackError
from geofield.field import field_from_boundary
from geofield.finite import finite
from geofield.tracks import plan_tracks
from geofield_command import run_geofield

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "sample_data" / "field_1.tif"
PLAN = ROOT / "sample_data" / "field_1.gpkg"
_CORNERS = shapely.Polygon([(548400, 3881500), (548450, 3881500), (548500, 3881600)])
BROKEN = shapely.transform(_CORNERS, lambda xy: np.where(xy == 548450, np.nan, xy))
WHOLE = shapely.box(548300, 3881450, 548500, 3881600)


@pytest.fixture
def broken_path(tmp_path: Path) -> Path:
    path = tmp_path / "broken.gpkg"
    gpd.GeoDataFrame(geometry=[WHOLE, BROKEN], crs="EPSG:32636").to_file(path)
    return path


@pytest.mark.parametrize(
    "arguments",
    [
        pytest.param(["tracks", PLAN, "--obstacles", "FILE", "-o", "OUT"], id="obstacles"),
        pytest.param(["evaluate", PLAN, "FILE"], id="truth"),
        pytest.param(["import", "FILE", "-o", "OUT"], id="import"),
        pytest.param(["tiles", PICTURE, "--area", "FILE", "-o", "OUT.tif"], id="area"),
    ],
)
def test_a_shape_that_is_nowhere_is_refused_with_its_row(
    broken_path: Path, tmp_path: Path, arguments: list[str | Path]
) -> None:
    """GEOS answered with a traceback; `--area` took the rest of the shape for the whole."""
    out = tmp_path / "out.gpkg"
    if arguments[0] == "tracks":  # a plan has its own obstacles, and takes none from a file
        boundary = tmp_path / "boundary.gpkg"
        gpd.GeoDataFrame(geometry=[WHOLE], crs="EPSG:32636").to_file(boundary)
        arguments = ["tracks", boundary, *arguments[2:]]
    given = {"FILE": broken_path, "OUT": out, "OUT.tif": tmp_path / "out.tif"}
    done = run_geofield(*(given.get(str(each), each) for each in arguments))
    assert done.returncode == 1
    assert "row 2: coordinates that are no finite numbers." in done.stderr
    assert "Mend the shape, or delete its row" in done.stderr
    assert "Traceback" not in done.stderr
    assert not out.exists()


def test_a_parcel_that_is_nowhere_is_left_out_or_refused_where_it_is_the_only_one(
    tmp_path: Path,
) -> None:
    parcels = gpd.GeoDataFrame(geometry=[BROKEN, WHOLE], crs="EPSG:32636")
    with pytest.warns(FieldWarning, match="1 polygon of the boundary file .*left out"):
        field = field_from_boundary(parcels)
    assert field.area_ha == pytest.approx(3.0, rel=0.01)
    path = tmp_path / "only.gpkg"
    parcels.iloc[:1].to_file(path)
    done = run_geofield("field", PICTURE, "--boundary", path, "-o", tmp_path / "out.gpkg")
    assert done.returncode == 1
    assert "with coordinates that are no finite numbers" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        pytest.param(["field", PICTURE, "--boundary", "FILE", "-o", "OUT"], id="boundary"),
        pytest.param(["info", "FILE"], id="info"),
        pytest.param(["validate", "FILE"], id="validate"),
        pytest.param(["evaluate", PLAN, "FILE"], id="truth"),
        pytest.param(["tracks", "FILE", "-o", "OUT"], id="tracks"),
        pytest.param(["batch", "FILE", "--out", "OUT"], id="batch"),
        pytest.param(["tiles", PICTURE, "--area", "FILE", "-o", "OUT.tif"], id="area"),
    ],
)
def test_shapes_outside_their_crs_are_refused(tmp_path: Path, arguments: list[str | Path]) -> None:
    """Eastings with the zone in front (EPSG:4647) under EPSG:25832 ended in tracebacks.

    `tracks` and `batch` said that no row has a position, `--area` that latitudes are infinite.
    """
    path, out = tmp_path / "zone.gpkg", tmp_path / "out.gpkg"
    parcel = shapely.box(32500000, 5500000, 32500300, 5500200)
    gpd.GeoDataFrame(geometry=[parcel], crs="EPSG:25832").to_file(path)
    given = {"FILE": path, "OUT": out, "OUT.tif": tmp_path / "out.tif"}
    done = run_geofield(*(given.get(str(each), each) for each in arguments))
    assert done.returncode == 1
    assert "are outside the area of EPSG:25832." in done.stdout + done.stderr
    assert "Check the CRS: the data may be in another one." in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    assert not out.exists()


def test_metres_that_a_file_calls_degrees_are_not_taken_for_swapped(tmp_path: Path) -> None:
    path = tmp_path / "metres.gpkg"
    gpd.GeoDataFrame(geometry=[WHOLE], crs="EPSG:4326").to_file(path)
    parcel = run_geofield("field", PICTURE, "--boundary", path, "-o", tmp_path / "out.gpkg")
    area = run_geofield("tiles", PICTURE, "--area", path, "-o", tmp_path / "out.tif")
    assert "latitudes from 3881450.0000 to 3881600.0000: they are none." in parcel.stderr
    assert "in metres.gpkg are outside the area of EPSG:4326." in area.stderr
    assert "swapped" not in parcel.stderr + area.stderr


def test_a_polygon_that_is_nowhere_has_no_tracks() -> None:
    with pytest.raises(TrackError, match="not finite numbers") as caught:
        plan_tracks(BROKEN, crs="EPSG:32636", spacing_m=6.0)
    assert "Mend the shape" in str(caught.value.hint)


def test_shapes_without_places_are_finite() -> None:
    shapes = [None, shapely.Polygon(), WHOLE, BROKEN, shapely.LineString([(0, 0), (np.inf, 1)])]
    assert finite(shapes).tolist() == [True, True, True, False, False]


@pytest.mark.parametrize(
    ("name", "told"),
    [
        pytest.param("empty.gpkg", "is empty (0 bytes).\nCopy it again.", id="empty"),
        pytest.param("folder", "It is a folder: name a file in it.", id="folder"),
        pytest.param("text.shp", "Is the file whole?", id="text"),
    ],
)
def test_what_cannot_be_read_is_told_without_advice_for_programmers(
    tmp_path: Path, name: str, told: str
) -> None:
    """GDAL's text told of drivers, and of a folder it was asked whether it is whole."""
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty.gpkg").touch()
    (tmp_path / "text.shp").write_text("no shape")
    done = run_geofield("tracks", tmp_path / name, "-o", tmp_path / "out.gpkg")
    assert done.returncode == 1
    assert told in done.stderr
    assert "driver" not in done.stderr
