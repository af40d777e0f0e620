"""Options that change nothing because of another one are told, and nothing else is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from geofield.cli.main import main
from geofield.settings import Settings, idle, load_settings

SAMPLE = Path(__file__).parents[1] / "sample_data"
PICTURE, PLAN = SAMPLE / "field_1.tif", SAMPLE / "field_1.gpkg"
POINT = ("--lat", "35.075373", "--lon", "33.531142")


def geofield(*words: object) -> int:
    with pytest.raises(SystemExit) as stop:
        main([str(word) for word in words])
    return int(stop.value.code or 0)


@pytest.mark.parametrize(
    ("settings", "said", "told"),
    [
        ({"obstacles": {"threshold": 0.2}}, "threshold", "--strategy single"),
        ({"obstacles": {"strategy": "dlc", "threshold": 0.2}}, "threshold", "--strategy single"),
        ({"obstacles": {"strategy": "single", "threshold": 0.2}}, "threshold", ""),
        ({"obstacles": {"strategy": "dlc", "careful": True}}, "careful", "--strategy auto"),
        ({"obstacles": {"strategy": "dlc", "careful": False}}, "careful", ""),
        ({"obstacles": {"cost_missed": 9, "min_confidence": 0.5}}, "cost_missed", "instead"),
        ({"obstacles": {"sensitivity": 0.9}}, "sensitivity", "the study's strategies"),
        ({"obstacles": {"strategy": "study_dlc", "radius_m": (2, 4)}}, "radius_m", "own"),
        ({"obstacles": {"radius_m": (2, 4)}}, "radius_m", ""),
        ({"field": {"min_hole_m2": 5}}, "min_hole_m2", "--holes keep"),
        ({"field": {"min_hole_m2": 5, "method": "study"}}, "min_hole_m2", ""),
        ({"tracks": {"turning_radius_m": 4}}, "turning_radius_m", "--route"),
        ({"tracks": {"turning_radius_m": 4, "route": "skip"}}, "turning_radius_m", ""),
        ({"tracks": {"route": "skip", "curve": "reeds_shepp"}}, "curve", "--turning-radius"),
        ({"tracks": {"route": "shortest", "skip": 2}}, "skip", "--route skip"),
        ({"tracks": {"headland_holes": True}}, "headland_holes", "--headland"),
        (
            {"tracks": {"width_m": 8, "overlap_m": 1, "spacing_m": 4}},
            "overlap_m",
            "beside --spacing",
        ),
        ({"tracks": {"width_m": 8, "overlap_m": 1}}, "overlap_m", ""),
        ({"export": {"formats": ["gpkg"], "points": True}}, "points", "--format rdf"),
        ({"export": {"points": True}}, "points", ""),
    ],
)
def test_what_changes_nothing_is_told(
    settings: dict[str, dict[str, Any]], said: str, told: str
) -> None:
    section = next(iter(settings))
    found = idle(load_settings(None, settings), {section: {said: settings[section][said]}})
    assert (told in " ".join(found)) if told else found == []


def test_a_settings_file_may_serve_several_ways() -> None:
    both = {"obstacles": {"threshold": 0.2, "careful": True}}
    assert idle(load_settings(None, both), {}) == []
    assert idle(Settings(), {"fetch": {"threads": 3}}) == []


def test_the_command_tells_and_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "tracks.gpkg"
    assert geofield("tracks", PLAN, "--spacing", 9, "--turning-radius", 3, "-o", out) == 0
    assert "--turning-radius changes nothing without a route" in capsys.readouterr().err
    assert out.is_file()
    # What the plan was made with decides, too.
    routed = tmp_path / "routed.gpkg"
    assert geofield("tracks", PLAN, "--spacing", 9, "--route", "skip", "-o", routed) == 0
    assert geofield("tracks", routed, "--turning-radius", 3, "-o", routed) == 0
    assert "changes nothing" not in capsys.readouterr().err


def test_options_of_the_outline_beside_a_parcel(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("field", PICTURE, *POINT, "-o", tmp_path / "field.gpkg")
    assert geofield(*words, "--boundary-name", "mine") == 2
    assert "name it with --boundary" in capsys.readouterr().err
    parcel = ("--boundary", PLAN, "--boundary-layer", "field", "--tolerance", 2)
    assert geofield(*words, *parcel) == 0
    assert "--tolerance changes nothing beside --boundary" in capsys.readouterr().err


@pytest.mark.parametrize("more", [("--include-lonlat", "33.5311,35.0753"), ("--choose", "1")])
def test_a_region_and_another_outline_at_once(
    more: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("field", PICTURE, *POINT, "--region", 2, "-o", tmp_path / "field.gpkg")
    assert geofield(*words, *more) == 2
    assert "--region takes" in capsys.readouterr().err


def test_a_crs_for_a_plan_that_says_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("tracks", PLAN, "--spacing", 9, "-o", tmp_path / "plan.gpkg", "--crs", "EPSG:3857")
    assert geofield(*words) == 0
    assert "--crs changes nothing: field_1.gpkg says its own." in capsys.readouterr().err
