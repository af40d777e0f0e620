"""A farm as a STAC catalogue, read by pystac."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import pystac
import pytest
import shapely

import geofield as gf
from geofield.farm.finish import renew
from geofield.farm.stac import write_stac
from geofield.farm.store import Store
from geofield.model import ImagerySource


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("stac")
    shapes = [shapely.box(x, 5_300_000, x + 200, 5_300_150) for x in range(500_000, 501_000, 250)]
    gpd.GeoDataFrame({"field_id": list("abcd")}, geometry=shapes, crs=32633).to_file(
        place / "parcels.gpkg"
    )
    plans = []
    for day, plan in zip(
        ("2020-05-01", "2021-06-02", None, None),
        gf.plan_fields(place / "parcels.gpkg", spacing_m=20),
        strict=True,
    ):
        source = ImagerySource("ortho", day, "© Survey of Somewhere", "CC BY 4.0")
        field = replace(plan.field, imagery="ortho", imagery_date=day, licence=source.licence)
        plans.append(replace(plan, field=field, source=source))
    gf.Farm(plans).write(place / "farm")
    write_stac(Store.of(place / "farm"), name="home")
    return place / "farm"


def test_pystac_finds_every_file_with_its_terms(folder):
    collection = pystac.Collection.from_file(str(folder / "collection.json"))
    assert collection.id == "home"
    assert collection.license == "CC-BY-4.0"
    (item,) = collection.get_items()
    assert item.get_collection().id == "home"
    found = {name: asset.get_absolute_href() for name, asset in item.assets.items()}
    assert {"field", "obstacles", "tracks", "segments", "gaps", "plan", "status"} <= set(found)
    for href in found.values():
        assert Path(href).is_file()
    fields = gpd.read_parquet(found["field"])
    assert item.bbox == pytest.approx(list(fields.total_bounds), abs=1e-6)
    assert (item.properties["start_datetime"][:10], item.properties["end_datetime"][:10]) == (
        "2020-05-01", "2021-06-02",
    )  # fmt: skip
    assert "© Survey of Somewhere" in collection.description
    terms = item.properties["geofield:imagery"]
    assert {term["licence"] for term in terms} == {"CC BY 4.0"}
    assert {term.get("date") for term in terms} == {"2020-05-01", "2021-06-02", None}


def test_it_is_written_the_same_again(folder):
    before = (folder / "collection.json").read_bytes()
    write_stac(Store.of(folder), name="home")
    assert (folder / "collection.json").read_bytes() == before
    assert json.loads(before)["extent"]["temporal"]["interval"][0][0] == "2020-05-01T00:00:00Z"


def test_a_farm_on_windows_goes_by_the_name_of_its_folder(folder, tmp_path):
    farm = shutil.copytree(folder, tmp_path / r"C:\Users\ann\home")
    renew(Store.of(farm))
    assert json.loads((farm / "collection.json").read_text())["id"] == "home"


def test_boxes_across_180_degrees_do_not_go_round_the_world(tmp_path):
    """Fiji: fields west of the meridian, across it and east of it."""
    metric = "EPSG:32760"
    shapes = [shapely.box(x, 8_150_000, x + 300, 8_150_200) for x in (816_000, 819_500, 823_000)]
    table = gpd.GeoDataFrame({"field_id": list("abc")}, geometry=shapes, crs=metric)
    sides = table.centroid.to_crs(4326).x
    assert sides.min() < -179.9
    assert sides.max() > 179.9
    table.to_file(tmp_path / "parcels.gpkg")
    gf.Farm(list(gf.plan_fields(tmp_path / "parcels.gpkg", spacing_m=20))).write(tmp_path / "farm")
    write_stac(Store.of(tmp_path / "farm"))
    collection = pystac.Collection.from_file(str(tmp_path / "farm" / "collection.json"))
    (item,) = collection.get_items()
    for west, south, east, north in (item.bbox, *collection.extent.spatial.bboxes):
        assert 179.9 < west < 180
        assert -180 < east < -179.9
        assert 0 < north - south < 0.01
    shape = shapely.geometry.shape(item.geometry)
    assert len(shapely.get_parts(shape)) == 2
    assert shape.area < 0.001
    assert shape.intersects(shapely.Point(180.0, south))


def test_items_of_chunks_that_are_gone_go_too(folder, tmp_path):
    farm = tmp_path / "farm"
    shutil.copytree(folder, farm)
    (farm / "stac" / "chunk-0007.json").write_text("{}")
    (farm / "stac" / "mine.json").write_text("{}")
    write_stac(Store.of(farm), name="home")
    assert {each.name for each in (farm / "stac").iterdir()} == {"chunk-0000.json", "mine.json"}
    for each in (farm / "status").rglob("*.parquet"):
        each.unlink()
    assert write_stac(Store.of(farm), name="home") == []
    assert not (farm / "collection.json").exists()
    assert [each.name for each in (farm / "stac").iterdir()] == ["mine.json"]
