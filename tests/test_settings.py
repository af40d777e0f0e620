"""Settings: defaults, file, environment and command line, in this order."""

from __future__ import annotations

from pathlib import Path

import pytest

from geofield.errors import SettingsError
from geofield.settings import Settings, from_mapping, load_settings


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_later_sources_win(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert load_settings().tracks.spacing_m == 2.0
    Path("geofield.toml").write_text("[tracks]\nspacing_m = 3\nstep_m = 0.5\n")
    assert load_settings().tracks.spacing_m == 3.0
    monkeypatch.setenv("GEOFIELD_TRACKS__SPACING_M", "4")
    assert load_settings().tracks.spacing_m == 4.0
    settings = load_settings(None, {"tracks": {"spacing_m": 5.0, "step_m": None}})
    assert settings.tracks.spacing_m == 5.0
    assert settings.tracks.step_m == 0.5


def test_settings_survive_being_recorded() -> None:
    settings = load_settings(None, {"obstacles": {"radius_m": (1.5, 6)}})
    assert from_mapping(settings.model_dump(mode="json")) == settings


def test_names_of_another_version_are_passed_over() -> None:
    assert from_mapping({"tracks": {"gone": 1, "spacing_m": 7.0}}).tracks.spacing_m == 7.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[tracks]\nspacing_m = 0\n", "tracks.spacing_m"),
        ("[tracks]\nspacing_m = nan\n", "tracks.spacing_m"),
        ("[tracks]\nspacing = 2\n", "tracks.spacing"),
        ("[trucks]\nspacing_m = 2\n", "trucks"),
        ("[tracks\n", "not valid TOML"),
    ],
)
def test_wrong_settings_are_named(text: str, message: str) -> None:
    Path("geofield.toml").write_text(text)
    with pytest.raises(SettingsError, match=message):
        load_settings()


def test_settings_do_not_change() -> None:
    with pytest.raises(ValueError, match="frozen"):
        Settings().tracks.spacing_m = 3.0  # type: ignore[misc]


def test_what_may_hold_keys_is_not_recorded() -> None:
    Path("geofield.toml").write_text(
        '[fetch.sources.mine]\nurl = "https://x/{z}/{x}/{y}"\nkey = "s3cret"\n'
        '[fetch.sources.mine.headers]\nAuthorization = "s3cret"\n'
    )
    settings = load_settings()
    assert settings.fetch.sources["mine"].headers["Authorization"].get_secret_value() == "s3cret"
    assert "s3cret" not in repr(settings.fetch)
    assert "s3cret" not in settings.model_dump_json()
    assert "s3cret" not in repr(settings.model_dump())
