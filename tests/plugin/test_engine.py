"""Engines that are missing, do not fit, crash or never end."""

from __future__ import annotations

import json
import subprocess
import time
from pathlib import Path

import pytest
from plugin_place import CLIENT, POINT, SAMPLE, tiny_engine

from real_qgis import PYTHON

HEAD = "#!/bin/sh\nif [ \"$1\" = --version ]; then echo 'geofield, version {version}'; exit 0; fi\n"


def engine(folder: Path, body: str, version: str = "0.1.0") -> str:
    folder.mkdir(parents=True, exist_ok=True)
    script = folder / "geofield"
    script.write_text(HEAD.format(version=version) + body)
    script.chmod(0o755)
    return str(script)


@pytest.fixture
def planned(qgis, tmp_path):
    def ask(command, **arguments):
        return qgis(
            "several",
            requests=[
                {"do": "setting", "name": "geofield/engine", "value": command},
                {"do": "run", "algorithm": "geofield:plan", **arguments, "values": {
                    "IMAGERY": str(SAMPLE), "POINT": POINT, "OUTPUT": str(tmp_path / "out")}},
                {"do": "parameters"},
                {"do": "setting", "name": "geofield/engine", "value": ""},
            ],
        )[1:3]  # fmt: skip

    return ask


def test_no_engine(planned, tmp_path):
    answer, known = planned(str(tmp_path / "nothing"))
    assert len(known["algorithms"]) == 11
    for algorithm in known["algorithms"].values():
        assert algorithm["can"][0] is False
        assert "install it or name it under Plugins" in algorithm["can"][1]
    assert "error" in answer


def test_another_version(planned, tmp_path):
    _, known = planned(engine(tmp_path / "old", "exit 0", version="0.0.7"))
    words = known["algorithms"]["geofield:plan"]["can"][1]
    assert "version 0.0.7" in words
    assert "update it" in words


def test_a_crash_is_told(planned, tmp_path):
    """In a folder with a space and letters of other alphabets."""
    answer, _ = planned(engine(tmp_path / "Мой движок ü", "echo 'out of memory' >&2; kill -9 $$"))
    assert "ended unexpectedly" in answer["error"]
    assert "out of memory" in answer["error"]


def test_an_error_is_told_in_the_engines_words(planned, tmp_path):
    body = """echo '{"error": {"message": "No field there.", "hint": "Move on."}}' >&2; exit 1"""
    answer, _ = planned(engine(tmp_path / "e", body))
    assert "No field there. Move on." in answer["error"]


def test_huge_output_does_not_block(planned, tmp_path):
    body = "head -c 60000000 /dev/zero | tr '\\0' 'x'; head -c 3000000 /dev/zero >&2; exit 3"
    answer, _ = planned(engine(tmp_path / "huge", body))
    assert "error" in answer


def test_an_engine_that_does_not_listen_is_killed(planned, tmp_path):
    body = f"trap '' TERM INT; echo $$ > {tmp_path}/pid; while true; do sleep 0.1; done"
    answer, _ = planned(engine(tmp_path / "deaf", body), stop_after_s=1.0)
    assert "Stopped" in answer["error"]
    assert answer["after_stop_s"] < 6.0
    assert not Path(f"/proc/{(tmp_path / 'pid').read_text().strip()}").exists()


def test_nothing_of_qgis_reaches_the_engine(qgis, tmp_path):
    command = engine(tmp_path / "env", f"env > {tmp_path}/environment; exit 0")
    qgis(
        "several",
        variables={"GDAL_DATA": "/x", "PROJ_LIB": "/x", "LD_LIBRARY_PATH": "/x", "MINE": "kept"},
        requests=[
            {"do": "setting", "name": "geofield/engine", "value": command},
            {"do": "run", "algorithm": "geofield:tracks", "values": {
                "INPUT": "/nothing.gpkg", "OUTPUT": str(tmp_path)}},
            {"do": "run", "algorithm": "geofield:validate", "values": {"FILES": [str(SAMPLE)]}},
            {"do": "setting", "name": "geofield/engine", "value": ""},
        ],
    )  # fmt: skip
    names = {line.partition("=")[0] for line in (tmp_path / "environment").read_text().splitlines()}
    assert not {"GDAL_DATA", "PROJ_LIB", "LD_LIBRARY_PATH", "PYTHONHOME", "PYTHONPATH"} & names
    assert "MINE" in names


def test_of_a_section_in_a_variable_stays_what_no_form_shows(qgis, tmp_path):
    command = engine(tmp_path / "env", f"env > {tmp_path}/environment; exit 0")
    qgis(
        "several",
        variables={
            "GEOFIELD_FETCH": '{"keys": {"survey": "k"}, "Cache_Max_MB": 5}',
            "GEOFIELD_EXPORT": '{"points": true}',
            "GEOFIELD_FIELD": "no section",
        },
        requests=[
            {"do": "setting", "name": "geofield/engine", "value": command},
            {"do": "run", "algorithm": "geofield:plan", "values": {
                "IMAGERY": str(SAMPLE), "POINT": POINT, "OUTPUT": str(tmp_path / "out")}},
            {"do": "setting", "name": "geofield/engine", "value": ""},
        ],
    )  # fmt: skip
    reached = dict(
        line.split("=", 1)
        for line in (tmp_path / "environment").read_text().splitlines()
        if line.startswith("GEOFIELD_")
    )
    # What cannot be read is the engine's to refuse.
    assert reached == {
        "GEOFIELD_FETCH": '{"keys": {"survey": "k"}}',
        "GEOFIELD_FIELD": "no section",
    }


def test_web_layers_are_told_by_address_and_terms(qgis, geofield, tmp_path):
    xyz, wms = qgis(
        "web_layers",
        addresses=[
            "type=xyz&url=https://tiles.example.org/%7Bz%7D/%7Bx%7D/%7By%7D.png&zmax=19&zmin=3",
            "contextualWMSLegend=0&crs=EPSG:3857&dpiMode=7&format=image/png&layers=ortho&styles=&"
            "url=https://wms.example.org/service?map%3D1",
        ],
    )
    told = []
    for name, variables in (xyz, wms):
        settings = json.loads(variables["GEOFIELD_FETCH__SOURCES"])[name]
        assert settings["attribution"] == "© Survey"
        told.append(settings)
        # The command takes it as it is, and does not hold that deriving is allowed.
        listed = json.loads(geofield("sources", "--json", variables=variables).stdout)
        row = next(each for each in listed if each["name"] == name)
        assert row["may_derive"] is False
    assert told[0]["url"] == "https://tiles.example.org/{z}/{x}/{y}.png"
    assert (told[0]["kind"], told[0]["min_zoom"], told[0]["max_zoom"]) == ("xyz", 3, 19)
    assert (told[1]["kind"], told[1]["layer"]) == ("wms", "ortho")
    assert told[1]["url"] == "https://wms.example.org/service?map=1"


def test_the_plugin_itself_costs_little(planned, tmp_path):
    """All that is not the command's own work: two starts of a process, forms, files."""
    quick, _ = planned(engine(tmp_path / "quick", "exit 0"))
    assert quick["wall_s"] < 4.0  # one on a machine that has nothing else to do


def test_the_engine_ends_with_qgis(qgis_environment, tmp_path):
    """QGIS is killed during a run: nobody else can stop the command any more."""
    request = {"do": "run", "algorithm": "geofield:plan", "values": {
        "IMAGERY": str(SAMPLE), "POINT": POINT, "OUTPUT": str(tmp_path / "out")}}  # fmt: skip
    window = subprocess.Popen(
        [PYTHON, str(CLIENT), json.dumps(request)],
        env=qgis_environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        # At once: on a quiet machine it is done two seconds later.
        until(lambda: any(tmp_path.glob("out/.geofield-*/claim")), 60)
        assert running(str(tmp_path))
    finally:
        window.kill()
        window.wait()
    until(lambda: not running(str(tmp_path)), 20)
    assert not any((tmp_path / "out").glob("*"))


def test_the_engine_is_installed_by_its_hash(qgis, tmp_path):
    """A tiny engine of the same name: only the file with the hash that is named comes in."""
    wheel, locked = tiny_engine(tmp_path, "print('geofield, version 0.1.0')")
    requirements = tmp_path / "requirements.txt"
    requirements.write_text(locked)
    other = tmp_path / "other" / wheel.name
    other.parent.mkdir()
    other.write_bytes(wheel.read_bytes() + b" ")
    answer = qgis(
        "install",
        requirements=str(requirements),
        wheels=[str(other), str(wheel), str(other)],
        killed_before=2,
    )
    refused, done, again = answer["ends"]
    assert "HASH" in refused.upper()
    assert done == "done"
    # A failed update leaves the engine that was there before, and nothing else; so it does where
    # QGIS was killed in the middle of the update before it.
    assert "HASH" in again.upper()
    assert answer["there"] == [False, True, True]
    assert answer["folders"] == [[], ["engine"], ["engine"]]
    (in_use,) = answer["in_use"]
    assert "is in use: close" in in_use
    assert answer["found"].endswith("/geofield/engine/bin/geofield")
    assert answer["network"]["HTTPS_PROXY"] == "http://anna:p%40ss%20word@proxy.farm:3128"
    assert "1080 MB" in answer["consent"]


def running(word):
    """Commands that name this folder, QGIS itself left out."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = entry.read_bytes().decode("utf-8", "replace").split("\0")
        except OSError:
            continue
        if any(each.startswith(word) for each in line):
            found.append(line)
    return found


def until(true, seconds):
    begun = time.monotonic()
    while not true():
        assert time.monotonic() - begun < seconds
        time.sleep(0.1)
