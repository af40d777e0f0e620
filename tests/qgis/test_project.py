"""QGIS opens the project: layers, CRS, styles, value lists, labels, map tips as meant."""

from __future__ import annotations

import dataclasses
import html
import json
import os
import shutil
import sqlite3
import subprocess
from pathlib import Path

import numpy as np
import pytest
import shapely
from formats_plan import NAME, X0, Y0, make_dataset
from PIL import Image

from geofield import schema, theme
from geofield.errors import FormatError
from geofield.formats import read_dataset, write_dataset

STORED = Path(__file__).with_name("project.png")
TOP_TO_BOTTOM = ["obstacles", "track_points", "gaps", "tracks", "segments", "field", "scene"]


@pytest.fixture(scope="module", params=["qgz", "inside"])
def opened(request, product, qgis, tmp_path_factory):
    folder = Path(shutil.copytree(product, tmp_path_factory.mktemp("opened") / "copy"))
    uri = (
        str(folder / "field.qgz")
        if request.param == "qgz"
        else f"geopackage:{folder / 'field.gpkg'}?projectName=field"
    )
    return qgis("project", uri=uri)


def test_nothing_is_missing(opened):
    assert opened["bad"] == []
    assert opened["title"] == NAME
    assert opened["crs"] == "EPSG:32636"
    assert opened["order"] == [f"geofield_{name}" for name in TOP_TO_BOTTOM]
    assert "geofield_segments" not in opened["shown"]


def test_layers_have_rows_style_and_tips(opened):
    for layer in schema.LAYERS:
        if layer.optional:
            continue
        facts = opened["layers"][f"geofield_{layer.name}"]
        assert facts["valid"], facts["error"]
        assert facts["crs"] == "EPSG:32636"
        assert facts["rows"] > 0
        assert facts["renderer"] == "RuleRenderer"
        assert facts["name"] == layer.title
        assert "openstreetmap.org" in facts["tip"]
        assert facts["actions"] == ["Open this spot in a web map"]
        assert facts["fields"] == ["fid", *layer.column_names]
        for column in layer.columns:
            assert facts["aliases"][column.name].startswith(column.title)
    scene = opened["layers"]["geofield_scene"]
    assert scene["size"] == [700, 400]
    assert scene["renderer"] == "multibandcolor"


def test_a_person_chooses_the_status_from_a_list(opened):
    facts = opened["layers"]["geofield_obstacles"]
    values = [next(iter(entry.values())) for entry in facts["status_values"]["map"]]
    assert values == list(schema.STATUSES)
    assert facts["status_default"] == "'added'"
    assert facts["aliases"]["radius_m"] == "Radius (m)"
    assert facts["rules"] == [
        "Confirmed",
        "Detected",
        "Possible, not avoided",
        "Added by a person",
        "Rejected by a person",
    ]


def test_what_no_run_honours_cannot_be_typed(opened):
    editable = {"field": ["field_id", "name"]}
    editable["obstacles"] = ["kind", "status", "radius_m", "buffer_m"]
    editable |= {"tracks": [], "segments": ["track_no"]}
    for layer in schema.LAYERS:
        if not layer.optional:
            facts = opened["layers"][f"geofield_{layer.name}"]
            assert facts["read_only"] == (layer.name not in editable)
            assert facts["editable"] == ["fid", *editable.get(layer.name, [])]


def test_the_outlines_doubt_stands_in_the_map_tip(opened):
    tip = opened["layers"]["geofield_field"]["tip"]
    assert "doubts" in tip
    assert "certainty" in tip


def test_no_tag_of_a_name_counts_in_the_map_tip(qgis, tmp_path):
    dataset = make_dataset()
    dataset.tables["field"]["name"] = "<script>alert(1)</script>[% 1+1 %]"
    dataset.tables["field"]["doubts"] = "<img src=x onerror=alert(2)> & more"
    write_dataset(dataset, tmp_path, ["gpkg"], options={"project": False}, tell_drops=False)
    tip = qgis("vector", uri=f"{tmp_path / 'field.gpkg'}|layername=field")["tip_shown"]
    assert "<script" not in tip
    assert "<img" not in tip
    assert "&lt;script>alert(1)&lt;/script>[% 1+1 %]" in tip
    assert "&lt;img src=x onerror=alert(2)> &amp; more" in tip


def test_the_map_tip_says_what_was_not_seen_of_obstacles(qgis, tmp_path):
    dataset = make_dataset()
    told = "The picture does not show 37% of <the> field [% 1+1 %]."
    provenance = dataclasses.replace(dataset.provenance, evidence={"obstacles": {"doubts": [told]}})
    dataset.tables["field"]["imagery_date"] = None
    write_dataset(
        dataclasses.replace(dataset, provenance=provenance), tmp_path, ["gpkg"], tell_drops=False
    )
    alone, opened = qgis("several", requests=[
        {"do": "vector", "uri": f"{tmp_path / 'field.gpkg'}|layername=field"},
        {"do": "project", "uri": str(tmp_path / "field.qgz")},
    ])  # fmt: skip
    for tip in (alone["tip_shown"], opened["layers"]["geofield_field"]["tip_shown"]):
        said = html.unescape(tip)
        assert f"Obstacles: {told}" in said.replace("<b>", "").replace("</b>", "")
        assert "<the>" not in tip
        assert "imagery of" not in tip


def test_points_appear_from_a_readable_scale_on(opened):
    limited, scale = opened["layers"]["geofield_track_points"]["scales"]
    assert limited
    assert scale == 500


def test_styles_apply_without_the_project(copy, qgis):
    for layer in schema.LAYERS:
        if not layer.optional:
            facts = qgis("vector", uri=f"{copy / 'field.gpkg'}|layername={layer.name}")
            assert facts["renderer"] == "RuleRenderer"


def shades(path, size=(90, 70)):
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB").resize(size, Image.Resampling.BOX), float)


def test_the_picture_is_the_stored_one(copy, qgis, tmp_path):
    png = tmp_path / "project.png"
    facts = qgis("render", uri=str(copy / "field.qgz"), png=str(png))
    assert facts["errors"] == []
    if os.environ.get("STORE_PICTURES"):
        shutil.copy(png, STORED)
    ours, stored = shades(png), shades(STORED)
    # Fonts differ between machines, so not pixel by pixel.
    assert np.abs(ours - stored).mean() < 3.0
    assert np.corrcoef(ours.ravel(), stored.ravel())[0, 1] > 0.98


def test_every_obstacle_is_found_by_its_number(product, qgis, tmp_path):
    """What tracks run through had none in QGIS, and track numbers took the others' room."""
    dataset = read_dataset(product / "field.gpkg")
    obstacles = dataset.tables["obstacles"].copy()
    obstacles.loc[obstacles.index[0], "status"] = "possible"
    numbers = obstacles["obstacle_no"].astype(str).tolist()
    assert {"possible", "rejected", "added"} <= set(obstacles["status"])
    tables = {**dataset.tables, "obstacles": obstacles}
    write_dataset(dataclasses.replace(dataset, tables=tables), tmp_path, ["gpkg"])
    shown = qgis("render", uri=str(tmp_path / "field.qgz"), png=str(tmp_path / "shown.png"))
    assert sorted(shown["labels"]["geofield_obstacles"]) == sorted(numbers)


def test_only_the_route_says_which_way_is_driven(product):
    """Arrows on the tracks pointed the way lines are stored, against the route on every other."""
    with sqlite3.connect(product / "field.gpkg") as file:
        styles = dict(file.execute("SELECT f_table_name, styleQML FROM layer_styles"))
    assert "line" in styles["tracks"]
    assert "arrow" not in styles["tracks"]


def at(picture, x_m, y_m, extent):
    west, south, east, north = extent
    row = int((north - (Y0 + y_m)) / (north - south) * picture.shape[0])
    column = int(((X0 + x_m) - west) / (east - west) * picture.shape[1])
    return picture[row - 1 : row + 2, column - 1 : column + 2].reshape(-1, 3).astype(int)


def test_colours_lie_where_the_things_are(copy, qgis, tmp_path):
    extent = [X0 - 5, Y0 - 5, X0 + 125, Y0 + 65]
    png = tmp_path / "colours.png"
    qgis("render", uri=str(copy / "field.qgz"), png=str(png), width=1300, height=700, extent=extent)
    with Image.open(png) as image:
        picture = np.asarray(image.convert("RGB"))
    r, g, b = at(picture, 69.5, 18.9, extent).mean(axis=0)
    assert g > 1.3 * r  # the confirmed tree is green, as on every map; the ground is 1.18
    assert g > 1.3 * b
    outline = at(picture, 60, 0, extent)
    assert (np.abs(outline.astype(int) - theme.rgb(theme.OUTLINE)).max(axis=1) < 40).any()
    track = at(picture, 33.3, 2.5, extent)
    assert (track.min(axis=1) > 170).any()  # white, smoothed; the ground is 70 to 130


@pytest.mark.parametrize("scale", [30_500, 250_000])
def test_a_field_is_visible_at_region_scale(copy, qgis, tmp_path, scale):
    png = tmp_path / "region.png"
    qgis("render", uri=str(copy / "field.qgz"), png=str(png), scale=scale, width=400, height=300)
    with Image.open(png) as image:
        picture = np.asarray(image.convert("RGB")).astype(int)
    yellow = (picture[..., 0] > 220) & (picture[..., 1] > 180) & (picture[..., 2] < 80)
    assert yellow.sum() > 20


def test_a_headland_a_route_and_turns_are_shown(qgis, tmp_path):
    write_dataset(make_dataset(points=False, optional=True), tmp_path, ["gpkg"])
    opened = qgis("project", uri=str(tmp_path / "field.qgz"))
    assert opened["bad"] == []
    for name in ("headland", "headland_tracks", "route", "turns"):
        facts = opened["layers"][f"geofield_{name}"]
        assert facts["rows"] == 1
        assert facts["renderer"] == "RuleRenderer"
    assert opened["layers"]["geofield_turns"]["rules"] == ["Turn", "Turn that does not fit"]
    png = tmp_path / "optional.png"
    assert qgis("render", uri=str(tmp_path / "field.qgz"), png=str(png))["errors"] == []


def test_a_turn_that_does_not_fit_is_seen_along_an_obstacle(qgis, tmp_path):
    """The obstacle's own line hid it."""
    plan = make_dataset(points=False, optional=True)
    around = plan.table("obstacles").geometry.iloc[1].exterior
    turns = plan.table("turns").set_geometry([shapely.LineString(around.coords)], crs=plan.crs)
    write_dataset(
        dataclasses.replace(plan, tables={**plan.tables, "turns": turns}), tmp_path, ["gpkg"]
    )
    png = tmp_path / "turn.png"
    extent = list(around.buffer(10).bounds)
    qgis("render", uri=str(tmp_path / "field.qgz"), png=str(png), extent=extent)
    with Image.open(png) as image:
        picture = np.asarray(image.convert("RGB")).astype(int)
    assert (np.abs(picture - theme.rgb(theme.UNFIT)).max(axis=2) < 25).sum() > 100


def test_a_file_that_qgis_has_open_is_not_replaced(qgis_environment, tmp_path):
    """A second program holds the layer in an edit session while the plan is written again."""
    write_dataset(make_dataset(points=False), tmp_path, ["gpkg"])
    path = tmp_path / "field.gpkg"
    holder = subprocess.Popen(
        ["/usr/bin/python3", str(Path(__file__).with_name("client.py")),
         json.dumps({"do": "hold", "uri": f"{path}|layername=obstacles"})],
        env=qgis_environment,
        stdout=subprocess.PIPE,
        stdin=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    try:
        assert any("holding" in line for line in holder.stdout)
        with pytest.raises(FormatError, match="open in another program"):
            write_dataset(make_dataset(points=False), tmp_path, ["gpkg"], overwrite=True)
        assert len(read_dataset(path).table("obstacles")) == 4
    finally:
        holder.communicate("\n", timeout=60)
    write_dataset(make_dataset(points=False), tmp_path, ["gpkg"], overwrite=True)
    assert len(read_dataset(path).table("obstacles")) == 4
