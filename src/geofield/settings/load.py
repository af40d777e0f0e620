"""Where settings come from: a file, the environment, the caller; the last one wins."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from pydantic import create_model

from geofield.errors import SettingsError, refuse_other
from geofield.settings.explain import in_words
from geofield.settings.machines import MACHINE_VALUES, Machine, machine_named
from geofield.settings.section import Section, nearest
from geofield.settings.sections import HOMES, MODELS, SECTIONS, Stage
from geofield.settings.tracks import said_over
from geofield.settings.whole import Settings

_KNOWN = (*SECTIONS, "machines")
_PREFIX = "GEOFIELD_"
_SAY = 'Load them: gf.load_settings(path), or gf.load_settings(None, {"tracks": {"spacing_m": 6}}).'


def load_settings(
    path: str | Path | None = None, overrides: Mapping[str, Mapping[str, Any]] | None = None
) -> Settings:
    """Settings from a TOML file, the environment and explicit values, the last one winning.

    >>> gf.load_settings(None, {"tracks": {"spacing_m": 6}}).tracks.spacing_m
    6.0

    Parameters
    ----------
    path : path, optional
        A TOML file with a table per section. ``geofield.toml`` in the working folder is read
        when it exists and no path is given.
    overrides : mapping of section to mapping, optional
        Values that win over everything else; None values are passed over.

    Raises
    ------
    SettingsError
        Naming the setting, its value and what would be right.
    """
    refuse_other(overrides, Mapping | None, "overrides", _SAY, SettingsError)
    merged: dict[str, dict[str, Any]] = {section: {} for section in _KNOWN}
    with in_words():
        for source in (_read_toml(path), _from_environment(), overrides or {}):
            _check_sections(source)
            for section, settings in source.items():
                said = {k: v for k, v in settings.items() if v is not None}
                merged[section] = (
                    _tracks_said(merged[section], said, _machines(merged, source))
                    if section == "tracks"
                    else merged[section] | said
                )
        return Settings(**merged)


def _check_sections(source: Mapping[str, Any]) -> None:
    """Refuse what is no section."""
    for section, settings in source.items():
        if section in HOMES:
            raise SettingsError(
                f"{section} stands in no section; it belongs to [{HOMES[section]}].",
                hint=f"Write [{HOMES[section]}] and its settings below.",
            )
        if section not in _KNOWN:
            raise SettingsError(
                f"Unknown section [{section}] in the settings." + nearest(section, _KNOWN),
                hint=f"Sections: {', '.join(_KNOWN)}.",
            )
        if not isinstance(settings, Mapping):
            raise SettingsError(
                f"{section} is a section of the settings, not a value.",
                hint=f"Write [{section}] and its settings below.",
            )


def _machines(*sources: Mapping[str, Any]) -> dict[str, Machine]:
    """The machines that sources describe, the last one winning."""
    described: dict[str, Any] = {}
    for source in sources:
        described |= source.get("machines", {})
    return Settings(machines=described).machines


def _tracks_said(
    earlier: Mapping[str, Any], said: Mapping[str, Any], machines: Mapping[str, Machine]
) -> dict[str, Any]:
    """Settings of the tracks, with what a machine that is named brings along."""
    machine = said.get("machine")
    if isinstance(machine, str):
        said = said_over(machine_named(machine, machines).track_values(), said)
    elif isinstance(machine, Machine | Mapping):
        said = said_over(Machine.model_validate(machine).track_values(), said) | {"machine": None}
    return said_over(earlier if machine is None else _without_machine(earlier), said)


def _without_machine(tracks: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of the tracks without those of a machine, where another one is named."""
    return {name: value for name, value in tracks.items() if name not in MACHINE_VALUES}


def with_values(settings: Settings | None, **values: Any) -> Settings:
    """Settings with some of them changed, each by its own name.

    Parameters
    ----------
    settings : Settings or None
        The defaults when None.
    **values
        Such as ``spacing_m=6, route="shortest"``. A ``machine`` is the name of one of the
        settings, a `Machine`, or a mapping such as ``{"width_m": 12}``.

    Raises
    ------
    SettingsError
        Naming the setting, its value and the nearest name.
    """
    refuse_other(settings, Settings | None, "settings", _SAY, SettingsError)
    settings = settings or Settings()
    changed: dict[Stage, dict[str, Any]] = {}
    for name, value in values.items():
        if name not in HOMES:
            raise SettingsError(f"There is no setting {name!r}.{nearest(name, HOMES)}")
        changed.setdefault(HOMES[name], {})[name] = value
    sections: dict[str, Section] = {}
    with in_words():
        for section, given in changed.items():
            # What nobody said stays unsaid: an earlier plan's may stand there.
            old = _said_in(getattr(settings, section))
            said = (
                _tracks_said(old, given, settings.machines) if section == "tracks" else old | given
            )
            sections[section] = MODELS[section](**said)
    return settings.model_copy(update=sections)


def as_before(
    settings: Settings,
    earlier: Settings | None,
    section: Stage,
    only: Collection[str] | None = None,
) -> Settings:
    """Settings of a stage that runs again on a plan: what nobody says now is as it was then.

    Parameters
    ----------
    settings : Settings
        As they were loaded; what a file, the environment or the caller says holds.
    earlier : Settings or None
        Of the plan.
    section : str
        Of the stage.
    only : collection of str, optional
        Names of the earlier settings that count; all when not given.
    """
    if earlier is None:
        return settings
    now = getattr(settings, section)
    said, known = _said_in(now), dict(getattr(earlier, section))
    if only is not None:
        known = {name: known[name] for name in known if name in only}
    values = known | said
    if section == "tracks":
        values = said_over(known if said.get("machine") is None else _without_machine(known), said)
    with in_words():
        return settings.model_copy(update={section: type(now)(**values)})


def _said_in(section: Section) -> dict[str, Any]:
    """What was said of a section, and does not follow from anything else."""
    return {name: getattr(section, name) for name in section.model_fields_set}


def from_mapping(values: Mapping[str, Any]) -> Settings:
    """Settings as a product recorded them; names that are gone since are passed over."""
    known: dict[str, Any] = {}
    for section in SECTIONS[:-1]:  # what may be reached, a product does not say
        recorded = values.get(section, {})
        if not isinstance(recorded, Mapping):
            raise SettingsError(f"The recorded settings are damaged: {section} is no section.")
        fields = MODELS[section].model_fields
        known[section] = {name: recorded[name] for name in recorded if name in fields}
    return Settings(**known)


def _from_environment() -> dict[str, Any]:
    """What variables such as ``GEOFIELD_TRACKS__SPACING_M`` say, by section."""
    given = {name: text for name, text in os.environ.items() if name.upper().startswith(_PREFIX)}
    if not given:
        return {}
    for name in given:
        after = name.upper().removeprefix(_PREFIX).lower()
        section, separator, _ = after.partition("__")
        first, _, setting = after.partition("_")
        if after in HOMES:
            first, setting = HOMES[after], after
        if not separator and setting and first in _KNOWN:
            raise SettingsError(
                f"{name} in the environment sets nothing.",
                hint="Two underscores follow the section: "
                f"{_PREFIX}{first.upper()}__{setting.upper()}.",
            )
        if separator and section not in _KNOWN and not section.startswith("key_"):
            raise SettingsError(
                f"{name} in the environment names no section of the settings."
                + nearest(section, _KNOWN),
                hint=f"Sections: {', '.join(_KNOWN)}.",
            )
    from pydantic_settings import BaseSettings, EnvSettingsSource, SettingsConfigDict
    from pydantic_settings import SettingsError as UnreadableError

    class Variables(BaseSettings):
        """How the variables are named."""

        model_config = SettingsConfigDict(env_prefix=_PREFIX, env_nested_delimiter="__")

    sections: dict[str, Any] = {
        name: (field.annotation, field.default) for name, field in Settings.model_fields.items()
    }
    # Only its parsing is used.
    Environment = create_model("Environment", __base__=Variables, **sections)
    try:
        return EnvSettingsSource(Environment)()
    except UnreadableError as error:
        text = getattr(error.__cause__, "doc", None)
        # By its name alone: it may hold a key.
        names = [name for name, value in given.items() if value == text]
        raise SettingsError(
            f"{' or '.join(names) or 'A variable GEOFIELD_...'} in the environment cannot be read.",
            hint="""Lists and tables are written as JSON there, such as '["gpkg", "kml"]'.""",
        ) from None


def _read_toml(path: str | Path | None) -> dict[str, Any]:
    file = Path(path) if path is not None else Path("geofield.toml")
    if path is None and not file.is_file():
        return {}
    try:
        return tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise SettingsError(f"The settings file {file} cannot be read: {error.strerror}.") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise SettingsError(
            f"The settings file {file} is not valid TOML: {error}.",
            hint="It is text in UTF-8; paths in it are written with / or in single quotes.",
        ) from None
