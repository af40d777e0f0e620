"""Engines that are missing, do not fit, crash or never end."""

from __future__ import annotations

from pathlib import Path

import pytest
from plugin_place import POINT, SAMPLE

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
    assert len(known["algorithms"]) == 10
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
