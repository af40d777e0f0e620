"""Every algorithm in a real QGIS, beside the command line."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest
from plugin_place import PLUGINS, POINT, ROOT, SAMPLE

from geofield.formats import read_dataset
from geofield.plan import read_plan

sys.path.insert(0, str(PLUGINS))
import describe


def same_tables(one, other, layers):
    one, other = read_dataset(Path(one)), read_dataset(Path(other))
    for layer in layers:
        left, right = one.table(layer), other.table(layer)
        assert len(left) > 0
        assert left.geometry.geom_equals(right.geometry).all(), layer


@pytest.fixture
def sample_plan(tmp_path):
    """A copy: QGIS alters a GeoPackage when it opens it."""
    return shutil.copy(ROOT / "sample_data" / "field_1.gpkg", tmp_path / "sample.gpkg")


@pytest.fixture(scope="module")
def qgis_process(qgis_environment):
    """The environment of a `qgis_process` that has the plugin."""
    subprocess.run(
        ["/usr/bin/qgis_process.bin", "plugins", "enable", "geofield_qgis"],
        env=qgis_environment,
        capture_output=True,
        check=False,  # enabled already is an error
    )
    return qgis_environment


@pytest.fixture(scope="module")
def known(qgis):
    return qgis("parameters")


@pytest.fixture(scope="module")
def plan(geofield, tmp_path_factory):
    """The command line's own answer for the sample field."""
    folder = tmp_path_factory.mktemp("plan") / "out"
    geofield(
        "run", SAMPLE, "--lat", 35.075373, "--lon", 33.531142, "--spacing", 4, "--buffer", 1.5,
        "--out", folder,
    )  # fmt: skip
    return folder


def test_the_description_is_that_of_the_command_line():
    shipped = json.loads(describe.TARGET.read_text(encoding="utf-8"))
    assert shipped == describe.described(), "run: python plugin/describe.py"


def test_no_setting_is_unreachable(known):
    reached = {name for each in known["algorithms"].values() for name in each["settings"]}
    assert set(known["settings"]) - reached == set(known["in_file"])
    # What is in no form can still be said in a settings file.
    assert "SETTINGS_FILE" in known["algorithms"]["geofield:plan"]["parameters"]


def test_algorithms_have_all_that_a_dialogue_shows(known):
    assert set(known["algorithms"]) == {
        f"geofield:{name}"
        for name in (
            "plan", "outline", "obstacles", "tracks", "route", "imagery", "export", "import",
            "validate", "evaluate", "batch",
        )
    }  # fmt: skip
    for name, algorithm in known["algorithms"].items():
        assert algorithm["can"] == [True, ""], name
        assert algorithm["icon"], name
        assert len(algorithm["help"]) > 100, name
    parameters = known["algorithms"]["geofield:plan"]["parameters"]
    usual = [name for name, (_, advanced, _) in parameters.items() if not advanced]
    assert usual[:4] == ["IMAGERY", "POINT", "OUTPUT", "NAME"]
    assert parameters["EDGE_METHOD"][1]  # the study's own settings are advanced
    assert parameters["START_LONLAT"][0] == "point"
    assert parameters["SPACING_M"][2] == "Distance between tracks, metres."


def test_plan_by_qgis_process(qgis_process, plan, tmp_path):
    out = tmp_path / "Ergebnis für Anna" / "out"  # a space and an umlaut
    begun = time.monotonic()
    done = subprocess.run(
        [
            "/usr/bin/qgis_process.bin", "--json", "run", "geofield:plan", f"--IMAGERY={SAMPLE}",
            f"--POINT={POINT}", "--SPACING_M=4", "--BUFFER_M=1.5", f"--OUTPUT={out}",
        ],
        env=qgis_process,
        capture_output=True,
        text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    assert time.monotonic() > begun
    results = json.loads(done.stdout[done.stdout.index("{") :])["results"]
    assert results["TRACKS"] == f"{out}/field.gpkg|layername=tracks"
    same_tables(plan / "field.gpkg", out / "field.gpkg", ["field", "obstacles", "segments"])


def test_what_the_dialogue_shows_holds(qgis_process, sample_plan, tmp_path):
    """A geofield.toml in QGIS's working folder and variables won where a default was shown."""
    (tmp_path / "geofield.toml").write_text("[tracks]\nspacing_m = 9\n")
    made_with, said = [], []
    for more in ([], [f"--SETTINGS_FILE={tmp_path}/geofield.toml"]):
        out = tmp_path / f"out{len(more)}"
        done = subprocess.run(
            ["/usr/bin/qgis_process.bin", "run", "geofield:tracks",
             f"--INPUT={sample_plan}|layername=field", f"--OUTPUT={out}", *more],
            env={
                **qgis_process,
                "GEOFIELD_TRACKS__HEADLAND_M": "7",
                "geofield_tracks__offset_m": "0.5",  # read in any case
                "GEOFIELD_TRACKS": '{"spacing_m": 5, "min_segment_m": 30}',
                "geofield_Tracks": '{"SPACING_M": 5}',
            },
            cwd=tmp_path, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr[-2000:]
        (made,) = out.glob("*.gpkg")
        tracks = read_plan(made).settings.tracks
        made_with.append(
            (tracks.spacing_m, tracks.headland_m, tracks.offset_m, tracks.min_segment_m)
        )
        said.append("does not count here" in done.stdout)
    # A file that the dialogue names does.
    assert made_with == [(2.0, 0.0, None, 0.0), (9.0, 0.0, None, 0.0)]
    assert said == [True, False]


def test_stages_give_what_the_command_line_gives(qgis, plan, geofield, sample_plan, tmp_path):
    lon, lat = 33.531142, 35.075373
    answers = qgis(
        "several",
        requests=[
            {"do": "run", "algorithm": "geofield:outline", "project_crs": "EPSG:3857", "values": {
                "IMAGERY": {"raster": str(SAMPLE)},
                "POINT": "3732669.65316,4174128.75706 [EPSG:3857]",
                "OUTPUT": str(tmp_path / "outline.gpkg")}},
            {"do": "run", "algorithm": "geofield:obstacles", "values": {
                "IMAGERY": str(SAMPLE), "PLAN": f"{tmp_path}/outline.gpkg|layername=field",
                "BUFFER_M": 1.5, "OUTPUT": str(tmp_path / "obstacles.gpkg")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": f"{tmp_path}/obstacles.gpkg|layername=field", "SPACING_M": 4,
                "OUTPUT": str(tmp_path / "tracks")}},
            {"do": "run", "algorithm": "geofield:route", "values": {
                "INPUT": f"{tmp_path}/obstacles.gpkg|layername=field", "SPACING_M": 12,
                "HEADLAND_M": 8, "START_LONLAT": f"{lon},{lat} [EPSG:4326]",
                "OUTPUT": str(tmp_path / "route")}},
            {"do": "run", "algorithm": "geofield:export", "values": {
                "PLAN": f"{tmp_path}/tracks/obstacles.gpkg|layername=field",
                "FORMATS": ["isoxml", "kml"], "FARM": "Hof", "OUTPUT": str(tmp_path / "export")}},
            {"do": "run", "algorithm": "geofield:validate", "values": {
                "FILES": [str(tmp_path / "export/isoxml/TASKDATA/TASKDATA.XML")]}},
            {"do": "run", "algorithm": "geofield:import", "values": {
                "FILES": [str(tmp_path / "export/field.kml")],
                "OUTPUT": str(tmp_path / "imported.gpkg")}},
            {"do": "run", "algorithm": "geofield:imagery", "values": {
                "IMAGERY": str(SAMPLE), "POINT": f"{lon},{lat} [EPSG:4326]", "SIZE_M": 100,
                "OUTPUT": str(tmp_path / "cut.tif")}},
            {"do": "run", "algorithm": "geofield:evaluate", "values": {
                "DETECTED": f"{tmp_path}/obstacles.gpkg|layername=obstacles",
                "TRUTH": f"{sample_plan}|layername=obstacles",
                "PICTURE": str(tmp_path / "hits.png")}},
        ],
    )  # fmt: skip
    assert [each.get("error") for each in answers] == [None] * 9
    same_tables(
        plan / "field.gpkg",
        tmp_path / "tracks" / "obstacles.gpkg",
        ["field", "obstacles", "segments"],
    )
    assert len(read_dataset(tmp_path / "route" / "obstacles.gpkg").table("route")) > 0
    assert (tmp_path / "export" / "field.kml").is_file()
    assert answers[5]["result"]["ERRORS"] == 0
    assert len(read_dataset(tmp_path / "imported.gpkg").table("field")) == 1
    assert (tmp_path / "cut.tif").is_file()
    done = geofield(
        "evaluate", tmp_path / "obstacles.gpkg", sample_plan, "--truth-layer", "obstacles", "--json"
    )
    assert answers[8]["result"]["F1"] == pytest.approx(json.loads(done.stdout)["f1"])
    assert (tmp_path / "hits.png").is_file()


def test_any_polygon_layer(qgis, sample_plan, tmp_path):
    """From memory, filtered, with some features selected; several fields at once."""
    square = "POLYGON(({0} 0, {0} 90, {1} 90, {1} 0, {0} 0))"
    memory = {
        "memory": "parcels", "kind": "Polygon", "crs": "EPSG:32633", "fields": ["name"],
        "rows": [
            {"wkt": square.format(500000 + 200 * n, 500080 + 200 * n), "name": f"Acker {n}"}
            for n in range(4)
        ],
    }  # fmt: skip
    trees = {
        "memory": "trees", "kind": "Point", "crs": "EPSG:32633", "fields": ["radius_m"],
        "rows": [{"wkt": "POINT(500044 45)", "radius_m": 3.0}],
    }  # fmt: skip
    own = {**memory, "fields": ["FID", "Geom", "Name", "name"], "rows": [
        {"wkt": square.format(500000 + 200 * n, 500080 + 200 * n), "FID": 1, "Geom": "Polygon",
         "Name": f"Acker {n}", "name": "x"}
        for n in range(4)
    ]}  # fmt: skip
    arc = "CIRCULARSTRING(500080 0, 500100 45, 500080 90)"
    curved = {"memory": "arc", "kind": "CurvePolygon", "crs": "EPSG:32633", "rows": [
        {"wkt": f"CURVEPOLYGON(COMPOUNDCURVE({arc}, (500080 90, 500000 90, 500000 0, 500080 0)))"}
    ]}  # fmt: skip
    crossed = {"memory": "crossed", "kind": "Polygon", "crs": "EPSG:32633", "rows": [
        {"wkt": "POLYGON((500000 0, 500080 90, 500080 0, 500000 90, 500000 0))"}
    ]}  # fmt: skip
    every, some, edited, chosen, named, arced, invalid, filtered = qgis(
        "several",
        requests=[
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": memory, "OBSTACLES_TO_AVOID": trees, "SPACING_M": 10,
                "OUTPUT": str(tmp_path / "all of them")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": {**memory, "select": "name in ('Acker 1', 'Acker 3')"},
                "SPACING_M": 10, "OUTPUT": str(tmp_path / "some")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": {**memory, "edit": True}, "SPACING_M": 10,
                "OUTPUT": str(tmp_path / "edited")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": {**memory, "edit": True, "select": "TRUE"}, "SPACING_M": 10,
                "OUTPUT": str(tmp_path / "chosen")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": own, "SPACING_M": 10, "OUTPUT": str(tmp_path / "named")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": curved, "SPACING_M": 10, "OUTPUT": str(tmp_path / "arced")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": crossed, "SPACING_M": 10, "OUTPUT": str(tmp_path / "invalid")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": {"vector": f"{sample_plan}|layername=obstacles",
                          "filter": "obstacle_no < 4"},
                "SPACING_M": 1, "OUTPUT": str(tmp_path / "filtered")}},
        ],
    )  # fmt: skip
    assert every["result"]["FIELDS"] == 4
    # The log shows the command as a shell takes it.
    (command,) = (line for line in every["log"].splitlines() if line.startswith("geofield "))
    assert shlex.split(command)[:2] == ["geofield", "tracks"]
    assert str(tmp_path / "all of them") in shlex.split(command)
    assert some["result"]["FIELDS"] == 2
    assert sorted(each.stem for each in (tmp_path / "some").glob("*.gpkg")) == [
        "Acker_1",
        "Acker_3",
    ]
    assert len(read_dataset(tmp_path / "all of them" / "Acker_0.gpkg").table("gaps")) > 0
    assert "not saved" in edited["error"]
    assert "not saved" in chosen["error"]
    assert named["result"]["FIELDS"] == 4
    assert arced["result"]["FIELDS"] == 1
    (curve,) = (tmp_path / "arced").glob("*.gpkg")
    bow = read_dataset(curve).table("field").geometry.iloc[0].area - 80 * 90
    assert bow == pytest.approx(1246.0, abs=0.5)  # the segment of the circle
    assert "cannot be repaired without a guess" in invalid["error"]
    assert filtered["result"]["FIELDS"] == 3


def test_the_outlines_of_a_plan_stand_for_the_plan(qgis, sample_plan, tmp_path):
    """Its obstacles count, whatever row is selected; they are refused while they are edited."""
    field = {"vector": f"{sample_plan}|layername=field", "select": "TRUE"}
    obstacles = {"vector": f"{sample_plan}|layername=obstacles"}
    whole, selected, part, edited, nowhere, unnamed, numbered = qgis(
        "several",
        requests=[
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": {**field, "whole": True}, "SPACING_M": 8,
                "OUTPUT": str(tmp_path / "whole")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": field, "SPACING_M": 8, "OUTPUT": str(tmp_path / "selected")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": {**field, "filter": "area_ha > 1", "select": ""}, "SPACING_M": 8,
                "OUTPUT": str(tmp_path / "part")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": {**field, "whole": True}, "OBSTACLES_TO_AVOID": None, "SPACING_M": 8,
                "OUTPUT": str(tmp_path / "edited")}, "beside": {**obstacles, "edit": True}},
            {"do": "run", "algorithm": "geofield:export", "values": {
                "PLAN": {"memory": "drawn", "kind": "Polygon", "crs": "EPSG:32633", "rows": []},
                "FORMATS": ["kml"], "OUTPUT": str(tmp_path / "nowhere")}},
            # Beside the obstacles that are being edited still.
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": str(sample_plan), "SPACING_M": 8, "OUTPUT": str(tmp_path / "unnamed")}},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": {"vector": f"{sample_plan}|layerid=0"}, "SPACING_M": 8,
                "OUTPUT": str(tmp_path / "numbered")}},
        ],
    )  # fmt: skip
    known = len(read_dataset(Path(sample_plan)).table("obstacles"))
    for name, answer in (("whole", whole), ("selected", selected)):
        assert "Only some fields" not in answer["log"], answer["log"]
        assert len(read_dataset(tmp_path / name / "sample.gpkg").table("obstacles")) == known
    assert "Only some fields" in part["log"]
    for answer in (edited, unnamed, numbered):
        assert "not saved" in answer["error"]
    assert "Choose a layer of a plan" in nowhere["error"]


def test_a_plan_in_a_folder_behind_a_link_is_one_plan(qgis, plan, tmp_path):
    shutil.copytree(plan, tmp_path / "disk")
    (tmp_path / "documents").symlink_to(tmp_path / "disk")
    linked = tmp_path / "documents" / "field.gpkg"
    layers, edited = qgis(
        "several",
        requests=[
            {"do": "shown", "plan": str(linked)},
            {"do": "run", "algorithm": "geofield:export", "values": {
                "PLAN": f"{linked}|layername=field", "FORMATS": ["kml"],
                "OUTPUT": str(tmp_path / "out")},
             "beside": {"vector": f"{tmp_path}/disk/field.gpkg|layername=obstacles",
                        "edit": True}},
        ],
    )  # fmt: skip
    assert {"field", "obstacles", "tracks"} <= set(layers)
    assert "not saved" in edited["error"]


def test_in_a_model(qgis, plan, tmp_path):
    qgis("model", folder=str(tmp_path), imagery=str(SAMPLE), point=POINT)
    made = read_dataset(tmp_path / "tracks" / "obstacles.gpkg")
    assert len(made.table("tracks")) == len(read_dataset(plan / "field.gpkg").table("tracks"))


def test_layers_come_styled_in_their_group(qgis, sample_plan, tmp_path):
    values = {"INPUT": f"{sample_plan}|layername=field", "SPACING_M": 4}
    answer, both = qgis(
        "several",
        requests=[
            {"do": "loaded", "algorithm": "geofield:tracks",
             "values": {**values, "OUTPUT": str(tmp_path / out)}}
            for out in ("out", "again")
        ],
    )  # fmt: skip
    # Another plan of the same field has a group of its own.
    (title, layers), (more, again) = sorted(both["groups"].items())
    assert (more, again) == (f"{title} (again/sample)", layers)
    ((_, layers),) = answer["groups"].items()
    names = [name for name, _, _ in layers]
    assert names.index("Obstacles") < names.index("Tracks") < names.index("Field")
    assert {kind for name, _, kind in layers if name != "Picture"} == {"QgsRuleBasedRenderer"}
    assert answer["loose"] == []


@pytest.mark.parametrize("edits", [0, 1])
@pytest.mark.parametrize(
    "algorithm", ["plan", "outline", "obstacles", "tracks", "route", "import", "batch"]
)
def test_a_plan_that_is_edited_is_not_written(qgis, plan, tmp_path, algorithm, edits):
    """That QGIS holds its file was told when all the work was done."""
    shutil.copytree(plan, tmp_path / "own")
    own = tmp_path / "own" / ("farm.gpkg" if algorithm == "batch" else "field.gpkg")
    shutil.copy(tmp_path / "own" / "field.gpkg", tmp_path / "parcels.gpkg")
    if algorithm == "batch":
        shutil.copy(tmp_path / "own" / "field.gpkg", own)
    here = {"IMAGERY": str(SAMPLE), "POINT": "33.531142,35.075373 [EPSG:4326]"}
    values = {
        "plan": {**here, "OUTPUT": str(own.parent), "OVERWRITE": True},
        "outline": {**here, "OUTPUT": str(own), "OVERWRITE": True},
        "obstacles": {"IMAGERY": str(SAMPLE), "PLAN": f"{own}|layername=field", "OUTPUT": str(own)},
        "import": {"FILES": [str(tmp_path / "parcels.gpkg")], "OUTPUT": str(own)},
        "batch": {"PLACES": str(tmp_path / "parcels.gpkg"), "OUTPUT": str(own.parent)},
    }
    tracks = {"INPUT": f"{own}|layername=field", "SPACING_M": 8, "OUTPUT": str(own.parent)}
    answer = qgis(
        "run",
        algorithm=f"geofield:{algorithm}",
        values=values.get(algorithm, tracks),
        beside={"vector": f"{own}|layername=obstacles", "edit": edits},
    )
    assert ("not saved" if edits else "is being edited") in answer["error"]


def test_a_plan_that_is_shown_already_is_read_again(qgis, plan, tmp_path):
    """Layers stayed as they were before the run, or came once more."""
    own = shutil.copytree(plan, tmp_path / "own") / "field.gpkg"
    first, again = qgis(
        "several",
        requests=[
            {"do": "loaded", "algorithm": "geofield:obstacles", "values": {
                "IMAGERY": str(SAMPLE), "PLAN": f"{own}|layername=field",
                "BUFFER_M": margin_m, "OUTPUT": str(own)}}
            for margin_m in (1, 4)
        ],
    )  # fmt: skip
    assert "error" not in again, again
    assert again["groups"] == first["groups"]
    assert again["loose"] == []
    (before,), (after,) = first["obstacles_m2"], again["obstacles_m2"]
    assert after > 1.5 * before > 0


def test_a_plan_without_its_project_beside_it_is_shown(qgis, plan, tmp_path):
    """Of a plan whose `.qgz` was left behind nothing was loaded; one lies in the file itself."""
    own = shutil.copytree(plan, tmp_path / "own") / "field.gpkg"
    whole = qgis("shown", plan=str(own))
    own.with_suffix(".qgz").unlink()
    assert qgis("shown", plan=str(own)) == whole
    assert {"field", "obstacles"} <= set(whole)


def test_products_in_a_temporary_place_are_shown(qgis, sample_plan):
    """What a dialogue offers where no place is named."""
    values = {"FILES": [str(sample_plan)], "OUTPUT": "TEMPORARY_OUTPUT"}
    run, shown = qgis(
        "several",
        requests=[
            {"do": name, "algorithm": "geofield:import", "values": values}
            for name in ("run", "loaded")
        ],
    )
    assert run["result"]["OUTPUT"] in run["log"].splitlines()[0]
    assert run["result"]["FIELD"] == f"{run['result']['OUTPUT']}|layername=field"
    (layers,) = shown["groups"].values()
    assert {"Field", "Obstacles"} <= {name for name, _, _ in layers}


def test_a_picture_in_an_archive(qgis, tmp_path):
    with zipfile.ZipFile(tmp_path / "pictures.zip", "w") as archive:
        archive.write(SAMPLE, "of the farm/field.tif")
    picture = {"raster": f"/vsizip/{tmp_path}/pictures.zip/of the farm/field.tif"}
    values = {"IMAGERY": picture, "POINT": POINT, "SIZE_M": 90, "OUTPUT": str(tmp_path / "cut.tif")}
    answer = qgis("run", algorithm="geofield:imagery", values=values)
    assert "error" not in answer, answer["error"]
    assert (tmp_path / "cut.tif").is_file()


def test_a_stopped_run_leaves_nothing(qgis, tmp_path):
    answer = qgis(
        "run",
        algorithm="geofield:plan",
        values={"IMAGERY": str(SAMPLE), "POINT": POINT, "OUTPUT": str(tmp_path / "out")},
        stop_at_percent=25,  # the picture is read, the outline is being looked for
    )
    assert "Stopped" in answer["error"]
    assert answer["after_stop_s"] < 6.0  # two on a machine that has nothing else to do
    assert not any((tmp_path / "out").glob("*"))
