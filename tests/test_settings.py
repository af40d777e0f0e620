"""Settings: defaults, file, environment and command line, in this order."""

from __future__ import annotations

import inspect
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import click
import pytest

from geofield.errors import SettingsError
from geofield.settings import (
    SECTIONS,
    DirectionName,
    FormatName,
    Settings,
    as_before,
    from_mapping,
    load_settings,
    option_named,
    with_values,
)
from geofield.settings.sections import MODELS


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
        ("[tracks]\nheadland_m = true\n", "tracks.headland_m: .* not true or false"),
        ("[trucks]\nspacing_m = 2\n", "trucks"),
        ("[obstacles]\nspacing_m = 2\n", r"obstacles.spacing_m: .*it belongs to \[tracks\]"),
        ("[machines.m]\nwidth_m = 2\nbuffer_m = 1\n", r"it belongs to \[obstacles\]"),
        ("spacing_m = 2\n", r"in no section; it belongs to \[tracks\]"),
        ("[tracks\n", "not valid TOML"),
        ("tracks = 3\n", "tracks is a section"),
        ("machines = 5\n[tracks]\nmachine = 'm'\n", "machines is a section"),
        ("[field]\ninclude = [5]\n", "as LON,LAT"),
        ("[field]\ninclude = [[1, [2]]]\n", "as LON,LAT"),
        ("[field]\ninclude = ['35.1,a']\n", "as LON,LAT"),
        ("[field]\ninclude = ['35.1,95']\n", "exchanged, 95,35.1, it is"),
        ("[field]\ninclude = 5\n", "should be a list"),
        ("[trakcs]\nspacing_m = 2\n", "Did you mean 'tracks'"),
        ("[tracks]\nspacing_n = 2\n", "Did you mean 'spacing_m'"),
        ('[tracks]\ndirection = "longest_edg"\n', "Did you mean 'longest_edge'"),
        ('[tracks]\ndirection = "nan"\n', "finite heading"),
        ('[tracks]\nroute = "shortst"\n', "Did you mean 'shortest'"),
        ('[obstacles]\nstrategy = "study_lsting"\n', "Did you mean 'study_listing'"),
        ('[export]\nformats = ["gpgk"]\n', "Did you mean 'gpkg'"),
    ],
)
def test_wrong_settings_are_named(text: str, message: str) -> None:
    Path("geofield.toml").write_text(text)
    with pytest.raises(SettingsError, match=message):
        load_settings()


@pytest.mark.parametrize(
    "content", [b'[fetch]\ncache_dir = "D:\\Daten"\n', "# Größe\n".encode("cp1252")]
)
def test_settings_as_windows_has_paths_and_letters_are_told_how_to_be_written(
    content: bytes,
) -> None:
    Path("geofield.toml").write_bytes(content)
    with pytest.raises(SettingsError, match="not valid TOML") as told:
        load_settings()
    assert "in UTF-8; paths in it are written with / or in single quotes" in str(told.value.hint)


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


@pytest.mark.parametrize(
    "line",
    [
        "run p.tif --lat 1 --lon 1 --out o --format gpgk",
        "run p.tif --lat 1 --lon 1 --out o --direction longest_edg",
        "run p.tif --lat 1 --lon 1 --out o --strategy aut",
        "run p.tif --lat 1 --lon 1 --out o --spacing 0",
        "field p.tif --lat 1 --lon 1 -o o.gpkg --method stdy",
        "tracks . --spacing -1 -o o.gpkg",
    ],
)
def test_a_typo_is_told_before_anything_large_is_loaded(line: str) -> None:
    code = (
        "import sys\nfrom geofield.cli import main\n"
        f"try: main({line.split()})\n"
        "except SystemExit as stop: code = stop.code\n"
        "print(code, bool({'numpy', 'rasterio', 'shapely'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["2", "False"], done.stderr


def test_the_environment_is_checked_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GEOFIELD_TRACKS__ROUTE", "shortst")
    with pytest.raises(SettingsError, match="Did you mean 'shortest'"):
        load_settings()


@pytest.mark.parametrize("name", ["GEOFIELD_EXPORT__FORMATS", "GEOFIELD_FETCH__KEYS"])
def test_a_variable_that_cannot_be_read_is_named(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(name, "gpkg,kml")
    with pytest.raises(SettingsError, match=name) as told:
        load_settings()
    assert "JSON" in str(told.value)
    assert "gpkg,kml" not in str(told.value)


def test_a_variable_of_no_section_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GEOFIELD_KEY_A__B", "a key of a source")
    monkeypatch.setenv("GEOFIELD_SHARED", "another program's own")
    load_settings()
    monkeypatch.setenv("GEOFIELD_TRACK__SPACING_M", "3")
    with pytest.raises(SettingsError, match=r"GEOFIELD_TRACK__SPACING_M.*Did you mean 'tracks'"):
        load_settings()
    monkeypatch.delenv("GEOFIELD_TRACK__SPACING_M")
    for wrong in ("GEOFIELD_TRACKS_SPACING_M", "GEOFIELD_SPACING_M"):
        monkeypatch.setenv(wrong, "3")
        with pytest.raises(SettingsError, match=rf"{wrong}.*sets nothing") as told:
            load_settings()
        name = "GEOFIELD_TRACKS__SPACING_M"
        assert told.value.hint == f"Two underscores follow the section: {name}."
        monkeypatch.delenv(wrong)


def test_a_file_may_begin_with_a_mark_of_its_encoding(tmp_path: Path) -> None:
    path = tmp_path / "windows.toml"
    path.write_text("[tracks]\nspacing_m = 3\n", encoding="utf-8-sig")
    assert load_settings(path).tracks.spacing_m == 3.0


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"tracks": {"spacing": 6}}, "tracks.spacing: .*Did you mean 'spacing_m'"),
        ({"trakcs": {"spacing_m": 6}}, "trakcs: .*Did you mean 'tracks'"),
        ({"spacing_m": 6}, r"spacing_m: .*it belongs to \[tracks\]"),
        ({"tracks": {"spacing_m": -6}}, "tracks.spacing_m: .*greater than 0"),
    ],
)
def test_settings_of_python_are_checked_in_words(said: dict[str, Any], message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        Settings(**said)


def test_any_setting_by_its_name() -> None:
    assert set(Settings.model_fields) == {*MODELS, "machines"}
    names = [name for each in SECTIONS for name in type(getattr(Settings(), each)).model_fields]
    assert len(set(names)) == len(names)
    changed = with_values(Settings(tracks={"step_m": 0.5}), spacing_m=6, route="shortest")
    assert (changed.tracks.spacing_m, changed.tracks.step_m) == (6.0, 0.5)
    assert changed.tracks.route == "shortest"
    with pytest.raises(SettingsError, match="Did you mean 'spacing_m'"):
        with_values(None, spacin_m=6)
    with pytest.raises(SettingsError, match=r"spacing_m: .*greater than 0 \(given: -1\)"):
        with_values(None, spacing_m=-1)


def test_names_are_those_of_the_stages() -> None:
    from geofield.formats import FORMATS
    from geofield.obstacles.detect import STRATEGIES
    from geofield.tracks.direction import METHODS

    strategy = type(Settings().obstacles).model_fields["strategy"]
    assert set(get_args(FormatName)) == set(FORMATS)
    assert set(get_args(DirectionName)) == set(METHODS)
    assert set(get_args(strategy.annotation)) == set(STRATEGIES)


def test_what_a_product_records_opens_no_way() -> None:
    recorded: dict[str, Any] = {"fetch": {"allow": ["https://example.org"]}}
    assert from_mapping(recorded).fetch.allow == ()


def defaults() -> dict[str, list[Any]]:
    """Every setting of a section with its default: "none" is what Python calls None."""
    known: dict[str, list[Any]] = {}
    for section in SECTIONS:
        values = getattr(Settings(), section)
        for name in MODELS[section].model_fields:
            value = getattr(values, name)
            known.setdefault(name, []).append(None if value == "none" else value)
    return known


def test_no_function_has_another_default_than_the_settings() -> None:
    import geofield as gf

    known, met = defaults(), 0
    public: list[Any] = [getattr(gf, name) for name in gf.__all__]
    methods: list[Any] = [gf.Plan.write, gf.Plan.to_graph, gf.Plan.plot, gf.Plan.explore]
    for function in (*filter(inspect.isfunction, public), *methods):
        for name, parameter in inspect.signature(function).parameters.items():
            own = None if parameter.default == "none" else parameter.default
            if name not in known or own is inspect.Parameter.empty:
                continue
            met += 1
            # None where there is another default: as the settings say.
            assert own is None or own in known[name], f"{function.__name__}({name}=)"
    assert met > 40


def every_command() -> Iterator[click.Command]:
    from geofield.cli.main import cli

    waiting: list[click.Command] = [cli]
    for command in waiting:
        if isinstance(command, click.Group):
            context = click.Context(command)
            found = (command.get_command(context, name) for name in command.list_commands(context))
            waiting += [each for each in found if each is not None]
        yield command


def test_no_option_has_a_default_of_its_own() -> None:
    known, met = defaults(), 0
    for command in every_command():
        unsaid = command.make_context("it", [], resilient_parsing=True).params
        for option, value in unsaid.items():
            name = option.rpartition("__")[2]
            if name in known:
                met += 1
                assert value in (None, (), *known[name]), f"{command.name}: {name}"
    assert met > 150


def test_a_refusal_names_the_option_that_stands_for_a_setting() -> None:
    met, sections = 0, {str(section): model for section, model in MODELS.items()}
    for command in every_command():
        for parameter in command.params:
            section, separator, name = str(parameter.name).partition("__")
            if separator:
                met += 1
                field = sections[section].model_fields[name]
                assert option_named(name, field) in parameter.opts, f"{command.name}: {name}"
    assert met > 100


def test_fetching_has_the_defaults_of_the_settings_and_of_the_command() -> None:
    from geofield.cli.main import cli
    from geofield.imagery import FetchOptions, Where

    own, fetch = FetchOptions(), Settings().fetch
    assert (own.threads, own.allow) == (fetch.threads, fetch.allow)
    assert own.cache_max_bytes == fetch.cache_max_mb * 2**20
    assert own.cache_max_age_s == fetch.cache_max_days * 86400
    tiles = cli.get_command(click.Context(cli), "tiles")
    said = tiles.make_context("tiles", [], resilient_parsing=True).params
    for name in ("resolution_m", "missing"):
        stage = inspect.signature(
            Where if name in inspect.signature(Where).parameters else FetchOptions
        )
        assert said[name] == stage.parameters[name].default, name


MACHINES = """
[machines.sprayer]
width_m = 12
overlap_m = 0.5
turning_radius_m = 6
overhang_m = 0.25
[machines.mower]
width_m = 3
[tracks]
spacing_m = 2.5
turning_radius_m = 9
"""


def test_a_machine_says_width_turning_radius_and_clearance() -> None:
    Path("geofield.toml").write_text(MACHINES)
    assert load_settings().tracks.spacing_m == 2.5
    tracks = load_settings(None, {"tracks": {"machine": "sprayer"}}).tracks
    assert (tracks.spacing_m, tracks.turning_radius_m, tracks.clearance_m) == (11.5, 6.0, 6.25)
    # What is said beside the machine wins over it.
    tracks = load_settings(None, {"tracks": {"machine": "sprayer", "spacing_m": 10}}).tracks
    assert (tracks.spacing_m, tracks.width_m, tracks.overlap_m) == (10.0, 12.0, None)
    # So does where the tracks lie, over the machine's offset.
    there = {"machine": {"width_m": 4, "offset_m": 1}, "through_lonlat": (33.0, 35.0)}
    assert with_values(None, **there).tracks.offset_m is None
    line = {"tracks": {"ab_lonlat": (33.0, 35.0, 33.1, 35.0)}}
    Path("geofield.toml").write_text(MACHINES + "offset_m = 1\n")
    assert load_settings(None, line).tracks.offset_m is None
    assert load_settings(None, {"tracks": {"skip": 2}}).tracks.offset_m == 1.0
    earlier = Settings(tracks={"through_lonlat": (33.0, 35.0)})
    again = as_before(Settings(**line), earlier, "tracks").tracks
    assert (again.through_lonlat, again.ab_lonlat) == (None, line["tracks"]["ab_lonlat"])
    # Of another machine nothing stays.
    settings = with_values(load_settings(), machine="sprayer", headland_passes=2)
    assert settings.tracks.headland_m == 23.0
    changed = with_values(settings, machine="mower").tracks
    assert (changed.spacing_m, changed.turning_radius_m, changed.headland_m) == (3.0, None, 6.0)
    assert from_mapping({"tracks": changed.model_dump()}).tracks == changed
    assert with_values(None, machine={"width_m": 4}).tracks.spacing_m == 4.0


def test_the_width_of_a_later_source_wins_over_an_earlier_spacing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    Path("geofield.toml").write_text("[tracks]\nspacing_m = 2.5\n")
    assert load_settings(None, {"tracks": {"width_m": 6}}).tracks.spacing_m == 6.0
    monkeypatch.setenv("GEOFIELD_TRACKS__WIDTH_M", "8")
    assert load_settings(None, {"tracks": {"overlap_m": 1}}).tracks.spacing_m == 7.0
    assert load_settings(None, {"tracks": {"spacing_m": 5}}).tracks.spacing_m == 5.0


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"machine": "spayer"}, "no machine 'spayer'. Did you mean 'sprayer'"),
        ({"overlap_m": 1}, "overlap needs the working width"),
        ({"width_m": 2, "overlap_m": 2}, "overlap is not smaller"),
    ],
)
def test_wrong_machines_are_named(said: dict[str, Any], message: str) -> None:
    Path("geofield.toml").write_text(MACHINES)
    with pytest.raises(SettingsError, match=message):
        load_settings(None, {"tracks": said})
    Path("geofield.toml").write_text("[machines.sprayer]\nwidht_m = 3\n")
    with pytest.raises(SettingsError, match="Did you mean 'width_m'"):
        load_settings()


EARLIER = {"width_m": 6, "headland_passes": 2, "ab_lonlat": (33, 35, 33.001, 35)}


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ({}, {"spacing_m": 6, "headland_m": 12, "ab_lonlat": (33, 35, 33.001, 35)}),
        ({"spacing_m": 5}, {"spacing_m": 5, "headland_m": 10, "width_m": 6}),
        ({"direction": "45"}, {"direction": "45", "ab_lonlat": None, "spacing_m": 6}),
        ({"headland_m": 3}, {"headland_m": 3, "headland_passes": None}),
        ({"machine": {"width_m": 4}}, {"spacing_m": 4, "width_m": 4, "headland_m": 8}),
        ({"width_m": 3, "overlap_m": 0.5}, {"spacing_m": 2.5, "headland_m": 5}),
    ],
)
def test_a_stage_on_a_plan_begins_with_its_settings(
    said: dict[str, Any], expected: dict[str, Any]
) -> None:
    earlier = load_settings(None, {"tracks": EARLIER})
    now = as_before(load_settings(None, {"tracks": said}), earlier, "tracks").tracks
    assert {name: getattr(now, name) for name in expected} == expected


@pytest.mark.parametrize(
    ("earlier", "said", "expected"),
    [
        # What follows is of the plan's spacing and overlap, not of the defaults.
        ({"spacing_m": 6}, {"headland_passes": 2}, {"spacing_m": 6, "headland_m": 12}),
        (
            {"width_m": 6, "overlap_m": 0.5},
            {"width_m": 6, "headland_passes": 2},
            {"spacing_m": 5.5, "overlap_m": 0.5, "headland_m": 11},
        ),
        ({"spacing_m": 6, "headland_m": 5}, {"width_m": 4}, {"spacing_m": 4, "headland_m": 5}),
    ],
)
def test_what_follows_from_what_is_said_is_not_said(
    earlier: dict[str, Any], said: dict[str, Any], expected: dict[str, Any]
) -> None:
    settings = load_settings(None, {"tracks": said})
    assert settings.tracks.model_fields_set == said.keys()
    before = load_settings(None, {"tracks": earlier})
    now = as_before(settings, before, "tracks").tracks
    assert {name: getattr(now, name) for name in expected} == expected


@pytest.mark.parametrize("heading", [30, 30.5])
def test_a_direction_may_be_a_number(tmp_path: Path, heading: float) -> None:
    file = tmp_path / "s.toml"
    file.write_text(f"[tracks]\ndirection = {heading}\n")
    assert load_settings(file).tracks.direction == str(heading)
    with pytest.raises(SettingsError, match="direction"):
        load_settings(None, {"tracks": {"direction": True}})


def test_a_place_to_pass_through_gives_way_to_an_offset() -> None:
    earlier = load_settings(None, {"tracks": {"through_lonlat": (33, 35)}})
    now = as_before(load_settings(None, {"tracks": {"offset_m": 1}}), earlier, "tracks").tracks
    assert (now.offset_m, now.through_lonlat) == (1, None)
    both = as_before(load_settings(None, {"obstacles": {"buffer_m": 3}}), earlier, "obstacles")
    assert (both.obstacles.buffer_m, both.tracks.through_lonlat) == (3, None)
