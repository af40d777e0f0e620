"""What people wrote beside the shapes of their own files comes out again, and nothing else does."""

from __future__ import annotations

from datetime import date
from pathlib import Path
from typing import Any

import geopandas as gpd
import pandas as pd
import pyogrio
import pytest
import shapely

from geofield.field import field_from_boundary
from geofield_command import run_geofield

X, Y, UTM = 500_000, 5_500_000, "EPSG:32633"
#: A column that is named like one of the layer, and says something else, has another name.
FIELD = {"owner": "Anna Öz", "crop": "wheat", "lease": 17, "place_area_ha": 5.5}
TREES: dict[str, list[Any]] = {
    "name": ["Old oak", "Shed", None],
    "height": [12.5, None, 3.0],
    "planted": [1897, None, 2**53 + 1],
    "note": ["NA", None, "none"],
    "own_kind": ["oak", "hut", None],
}


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    """A field, trees and lines as another program has them."""
    outline = shapely.box(X, Y, X + 200, Y + 100)
    columns: dict[str, Any] = {name.removeprefix("place_"): [it] for name, it in FIELD.items()}
    spots = [shapely.Point(X + 30 + 60 * no, Y + 50) for no in range(3)]
    trees: dict[str, Any] = {name.removeprefix("own_"): said for name, said in TREES.items()}
    trees |= {"radius": [3, 4, 0], "planted": pd.array(TREES["planted"], dtype="Int64")}
    lines = [shapely.LineString([(X, Y + y), (X + 200, Y + y)]) for y in (10, 20)]
    tables = {
        "home": ({"Name": ["Home"], **columns}, [outline]),
        "trees": (trees, spots),
        "guidance": ({"name": ["AB 1", "Track 2"], "tool": ["drill", "plough"]}, lines),
    }
    for name, (values, shapes) in tables.items():
        frame = gpd.GeoDataFrame(values, geometry=shapes, crs=UTM)
        frame.to_file(tmp_path / f"{name}.gpkg")
    return [tmp_path / f"{name}.gpkg" for name in tables]


def geofield(*words: str | Path) -> str:
    done = run_geofield(*words)
    assert done.returncode == 0, done.stderr
    return done.stderr


def rows(plan: Path, layer: str, columns: Any) -> dict[str, list[Any]]:
    """Columns as another program reads them, None where nothing stands."""
    _, table = pyogrio.read_arrow(plan, layer=layer, read_geometry=False)
    return table.select(list(columns)).to_pydict()


def test_they_come_out_again_of_every_format_that_carries_them(
    files: list[Path], tmp_path: Path
) -> None:
    """All were dropped without a word: whose the field is, and what is known of each tree."""
    plan = tmp_path / "plan.gpkg"
    geofield("import", *files, "-o", plan)
    once = {name: [value] for name, value in FIELD.items()}
    assert rows(plan, "field", FIELD) == once
    assert rows(plan, "obstacles", TREES) == TREES
    lines = {"name": ["AB 1", "Track 2"], "tool": ["drill", "plough"]}
    assert rows(plan, "segments", lines) == lines
    ours = set(rows(plan, "obstacles", pyogrio.read_info(plan, layer="obstacles")["fields"]))
    assert not ours & {"radius", "fid"}  # which the table says itself
    geofield("export", plan, "-f", "geojson,shapefile,kml", "--out", tmp_path)
    for product in ("geojson", "shapefile", "field.kml"):
        back = tmp_path / "back.gpkg"
        geofield("import", tmp_path / product, "-o", back, "--overwrite")
        area = "place_area" if product == "shapefile" else "place_area_ha"  # ten letters fit
        assert rows(back, "field", ["owner", "crop", "lease", area])["lease"] == [17]
        assert rows(back, "field", [area]) == {area: [5.5]}
        found = rows(back, "obstacles", TREES)
        found["planted"] = [each and int(each) for each in found["planted"]]
        assert found == TREES, product
        if product != "field.kml":
            assert rows(back, "segments", lines) == lines


def test_those_of_obstacles_stay_in_plans_of_many_fields(files: list[Path], tmp_path: Path) -> None:
    """Their `field_id` is no id of ours."""
    boxes = [shapely.box(x, Y, x + 90, Y + 100) for x in (X, X + 100)]
    parcels = gpd.GeoDataFrame({"id": ["west", "east"]}, geometry=boxes, crs=UTM)
    parcels.to_file(tmp_path / "parcels.gpkg")
    trees = gpd.read_file(files[1]).assign(field_id="W/1")
    trees.to_file(files[1])
    farm = tmp_path / "farm.gpkg"
    geofield(
        "tracks", tmp_path / "parcels.gpkg", "--obstacles", files[1], "--spacing", "30", "-o", farm
    )
    found = rows(farm, "obstacles", ["field_id", "note", "height", "own_field_id"])
    assert sorted(found["field_id"]) == ["east", "west", "west"]
    assert sorted(map(str, found["note"])) == ["NA", "None", "none"]
    assert set(found["own_field_id"]) == {"W/1"}


def test_a_parcel_for_the_outline_brings_its_own() -> None:
    """`geofield field --boundary` dropped them, and its id, which `geofield batch` keeps."""
    parcel = gpd.GeoDataFrame(
        {
            "NAME": ["Home"],
            "field_id": ["F-7"],
            "owner": ["Anna"],
            "doubts": ["wet"],
            "sown": pd.array([None], dtype="Int64"),
        },
        geometry=[shapely.box(X, Y, X + 200, Y + 100)],
        crs=UTM,
    )
    field = field_from_boundary(parcel)
    assert (field.name, field.field_id) == ("Home", "F-7")
    own = dict(field.own)
    assert list(own) == ["owner", "place_doubts", "sown"]
    assert (own["owner"], own["place_doubts"]) == ("Anna", "wet")
    assert pd.isna(own["sown"])


_EARTH = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2"><Document><Folder><name>Farm</name>
<Placemark id="01"><name>Home</name><description>wheat</description><Polygon><tessellate>1
</tessellate><outerBoundaryIs><LinearRing><coordinates>15,50,0 15.002,50,0 15.002,50.001,0
15,50.001,0 15,50,0</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>
<Folder><name>Trees</name><Placemark><name>Old oak</name><TimeStamp><when>2024-05-01</when>
</TimeStamp><Point><coordinates>15.001,50.0005,0</coordinates></Point></Placemark></Folder>
</Folder></Document></kml>"""


def test_placemarks_have_the_names_that_people_gave_them(tmp_path: Path) -> None:
    """Of a plan each had a column `name` that says its number; what people wrote was dropped."""
    earth, plan = tmp_path / "earth.kml", tmp_path / "plan.gpkg"
    earth.write_text(_EARTH, encoding="utf-8")
    geofield("import", earth, "-o", plan)
    assert rows(plan, "field", ["name", "description"]) == {
        "name": ["Home"],
        "description": ["wheat"],
    }
    tree = rows(plan, "obstacles", ["name", "timestamp"])
    assert (tree["name"], tree["timestamp"][0].date()) == (["Old oak"], date(2024, 5, 1))
    own = set(pyogrio.read_info(plan, layer="obstacles")["fields"])
    assert not own & {"tessellate", "visibility", "icon", "description", "Name"}
    geofield("tracks", plan, "--spacing", "20", "-o", plan, "--overwrite")
    geofield("export", plan, "-f", "kml", "--out", tmp_path)
    geofield("import", tmp_path / "field.kml", "-o", tmp_path / "back.gpkg")
    assert rows(tmp_path / "back.gpkg", "obstacles", ["name"]) == {"name": ["Old oak"]}
    assert "name" not in pyogrio.read_info(tmp_path / "back.gpkg", layer="tracks")["fields"]
    # Renamed in Google Earth.
    text = (tmp_path / "field.kml").read_text(encoding="utf-8")
    for before, after in (("Track 2<", "Wet<"), ("<name>Home</name>", "<name>House</name>")):
        assert before in text
        text = text.replace(before, after)
    (tmp_path / "field.kml").write_text(text, encoding="utf-8")
    geofield("import", tmp_path / "field.kml", "-o", tmp_path / "back.gpkg", "--overwrite")
    assert rows(tmp_path / "back.gpkg", "field", ["name"]) == {"name": ["House"]}
    named = rows(tmp_path / "back.gpkg", "tracks", ["name"])["name"]
    assert named[1] == "Wet"
    assert set(named) == {None, "Wet"}
