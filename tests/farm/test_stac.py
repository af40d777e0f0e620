"""A farm as a STAC catalogue, read by pystac."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import pystac
import pytest
import shapely

import geofield as gf
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
