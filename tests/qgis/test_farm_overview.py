"""A farm's overview in QGIS: fields coloured by doubt, places without a plan, tracks from near."""

from __future__ import annotations

from dataclasses import replace

import geopandas as gpd
import numpy as np
import pytest
import shapely
from PIL import Image

import geofield as gf
from geofield import theme
from geofield.farm.folder import write_chunk
from geofield.farm.layers import tables_of
from geofield.farm.overview import write_overview
from geofield.farm.status import Outcome, outcome_words, status_table
from geofield.farm.store import Store


@pytest.fixture(scope="module")
def overview(tmp_path_factory):
    """Two rows of six fields; one is doubtful, and one place has no plan."""
    folder = tmp_path_factory.mktemp("farm")
    shapes = [
        shapely.box(x, y, x + 230, y + 180).union(shapely.box(x, y, x + 100, y + 195))
        for y in (5_300_000, 5_300_220)
        for x in range(500_000, 501_560, 260)
    ]
    frame = gpd.GeoDataFrame(
        {"field_id": [f"P{i}" for i in range(12)], "crop": ["wheat", "maize"] * 6},
        geometry=shapes, crs=32633,
    )  # fmt: skip
    frame.to_file(folder / "parcels.gpkg")
    plans = list(gf.plan_fields(folder / "parcels.gpkg", spacing_m=12))
    gf.Farm(plans).write(folder / "farm")
    store, tables = Store.of(folder / "farm"), tables_of(plans)
    field = tables["field"]
    doubts = [None, "it is as rough as a wood", *[None] * 10]
    tables["field"] = field.set_column(field.column_names.index("doubts"), "doubts", [doubts])
    outcomes = [
        Outcome(p.field.field_id, place=i + 1, **outcome_words(p)) for i, p in enumerate(plans)
    ]
    outcomes[1] = replace(outcomes[1], status="doubtful", doubts=doubts[1])
    outcomes = [
        replace(o, lat=p.field.polygon_lonlat.centroid.y, lon=p.field.polygon_lonlat.centroid.x)
        for o, p in zip(outcomes, plans, strict=True)
    ]
    lost = Outcome(
        "P12",
        "Marsh",
        13,
        47.8555,
        15.0215,
        "failed",
        "The place is outside the picture.",
        "Name another.",
    )
    write_chunk(store, 0, tables, status_table([*outcomes, lost]))
    write_overview(gf.read_farm(folder / "farm"), folder / "farm", name="Home farm")
    return folder / "farm"


def test_everything_opens_styled(qgis, overview):
    found = qgis("project", uri=str(overview / "farm.qgz"))
    assert found["bad"] == []
    assert (found["title"], found["crs"]) == ("Home farm", "EPSG:32633")
    layers = {facts["name"]: facts for facts in found["layers"].values()}
    assert {"Field", "Obstacles", "Tracks", "Segments", "Gaps", "Places"} <= set(layers)
    assert "Track points" not in layers
    assert layers["Field"]["rows"] == 12
    assert layers["Places"]["rows"] == 13
    assert layers["Field"]["rules"] == [
        "Outline", "Field", "Outline to be checked", "Field to be checked",
    ]  # fmt: skip
    assert "crop" in layers["Field"]["fields"]
    assert "field_id" in layers["Tracks"]["fields"]
    # What the next run makes anew cannot be typed into.
    assert layers["Places"]["read_only"]
    assert layers["Gaps"]["read_only"]
    # What is edited of tracks is taken in, as in the plan of one field.
    assert not layers["Tracks"]["read_only"]
    assert not layers["Segments"]["read_only"]
    assert {"field_id", "name"} <= set(layers["Field"]["editable"])
    # From afar there are only fields and places.
    assert layers["Tracks"]["scales"] == [True, 30_000]
    assert not layers["Places"]["scales"][0]


def _count(path, color):
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)
    return int((np.abs(pixels - theme.rgb(color)).max(axis=2) < 25).sum())


def test_what_is_drawn(qgis, overview, tmp_path):
    far, near = str(tmp_path / "far.png"), str(tmp_path / "near.png")
    uri = str(overview / "farm.qgz")
    assert qgis("render", uri=uri, png=far, scale=60_000)["errors"] == []
    assert qgis("render", uri=uri, png=near, scale=8_000)["errors"] == []
    assert _count(far, theme.UNFIT) > 20
    assert _count(near, theme.DOUBT) > 200
