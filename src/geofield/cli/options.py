"""Options that commands share, and options made from a section of the settings.

A setting is described once, in `geofield.settings`; :func:`stage_options` turns a
section into click options with the same types, defaults and help.
"""

from __future__ import annotations

import functools
import math
import re
import types
import typing
from collections.abc import Callable, Mapping
from typing import Any, Literal

import click
from pydantic.fields import FieldInfo

from geofield.cli.console import say, say_note
from geofield.cli.degrees import Degrees
from geofield.cli.files import Command
from geofield.errors import SettingsError
from geofield.settings import (
    MODELS,
    LonLat,
    Settings,
    Stage,
    as_before,
    idle,
    load_settings,
    option_named,
)
from geofield.wording import nearest

SEPARATOR = "__"

acknowledge_option = click.option(
    "--acknowledge-terms",
    is_flag=True,
    help="You have permission to derive geodata, though the source's terms forbid it.",
)
defaults_option = click.option(
    "--defaults",
    is_flag=True,
    help="Begin with the default settings, not with those that the plan was made with.",
)


def without_blanks(
    _context: click.Context, _option: click.Parameter, text: str | None
) -> str | None:
    """A text without blanks around it; None where there is no other."""
    return (text or "").strip() or None


name_option = click.option(
    "--name", callback=without_blanks, help="The field's name; its place when not given."
)


class Number(click.FloatRange):
    """A number between two others, which not a number and what has no end are not."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number as a float."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a finite number.", param, ctx)
        return number


class NearestChoice(click.Choice[str]):
    """A choice whose refusal names the nearest one."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The choice as it is spelt."""
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            near = nearest(str(value).lower(), self.choices, cutoff=0.5)
            raise click.BadParameter(error.message + near, ctx, param) from None


def point_or_parcel_options(command: Command) -> Command:
    """Add ``--lat`` and ``--lon``, which a parcel of the user's own may stand for."""
    for name, what, letters, such in (
        ("lon", "Longitude", "EW", "33.5311 or '33 31.866 E'"),
        ("lat", "Latitude", "NS", "35.0754 or '35 4.524 N'"),
    ):
        command = click.option(
            f"--{name}",
            type=Degrees(letters),
            help=f"{what} of a point in the field, such as {such}; not needed for the only parcel "
            "of --boundary, or one named.",
        )(command)
    return command


def settings_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--settings FILE``; the command takes `settings`, with what its options say of them.

    They are loaded before the command imports what is large: a typo is told at once.
    """

    @functools.wraps(command)
    def with_settings(*, settings_file: str | None, **values: Any) -> Any:
        said = section_values(values)
        try:
            settings = load_settings(settings_file, said)
        except SettingsError as error:
            raise SettingsError(_by_option(error.message, said), hint=error.hint) from None
        own = {name: value for name, value in values.items() if SEPARATOR not in name}
        return command(settings=settings, **own)

    return click.option(
        "--settings",
        "settings_file",
        type=click.Path(exists=True, dir_okay=False),
        help="TOML file with a table per stage; geofield.toml here is read by itself.",
    )(with_settings)


def stage_options(
    *sections: Stage, imagery: bool = True
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add ``--settings FILE``, ``--allow`` where pictures are read, and all settings of stages.

    ``tracks.spacing_m`` becomes ``--spacing``, parameter ``tracks__spacing_m``; it is None when not
    given, so that file and environment keep their say.
    """

    def add(command: Callable[..., Any]) -> Callable[..., Any]:
        for section in reversed(("fetch", *sections) if imagery else sections):
            for name, field in reversed(MODELS[section].model_fields.items()):
                if section != "fetch" or name == "allow":
                    names, arguments = option_of(section, name, field)
                    command = click.option(*names, **arguments)(command)
        return settings_option(command)

    return add


def continued(settings: Settings, earlier: Settings | None, section: Stage) -> Settings:
    """Settings of a stage that runs again on a plan (`as_before`); tells what holds from then."""
    settings, said = as_before(settings, earlier, section), getattr(settings, section)
    now = getattr(settings, section)
    # What follows from another setting is not told beside it.
    follows = (
        {"spacing_m": now.width_m, "headland_m": now.headland_passes} if section == "tracks" else {}
    )
    told = [
        f"{option_named(name, field)} {_as_typed(value)}".removesuffix(" True")
        for name, field in type(now).model_fields.items()
        if name not in said.model_fields_set
        and (value := getattr(now, name)) != field.get_default()
        and follows.get(name) is None
    ]
    if told:
        say(f"As the plan was made: {', '.join(told)}")
    return settings


def tell_idle(
    settings: Settings, *, parcel: bool = False, unused: Mapping[Stage, str] | None = None
) -> None:
    """Tell which options that were given change nothing, as the way they belong to is not taken.

    With a `parcel` of the user's own those are all options of the outline; so are those of stages
    that are `unused`, for the reason that stands there.
    """
    said = section_values(click.get_current_context().params)
    reasons: dict[Stage, str] = {**(unused or {})}
    if parcel:
        reasons["field"] = "beside --boundary, whose parcel is taken as it is"
    for section, why in reasons.items():
        fields = MODELS[section].model_fields
        for name in said.pop(section, {}):
            say_note(f"{option_named(name, fields[name])} changes nothing {why}.")
    for sentence in idle(settings, said):
        say_note(sentence)


def _by_option(message: str, said: Mapping[str, Mapping[str, Any]]) -> str:
    """A message in which settings that were said as options have the names of these."""
    for section, values in said.items():
        fields = MODELS[section].model_fields
        for name in values:
            option = option_named(name, fields[name])
            message = re.sub(rf"\b{section}\.{name}\b(\.\d+)*", option, message)
        # What it says of another one of the section, that one is to be typed, too.
        for name in fields:
            message = message.replace(f"({name})", f"({option_named(name, fields[name])})")
    return message


def _as_typed(value: Any) -> str:
    parts = value if isinstance(value, tuple) else (value,)
    return ",".join(f"{part:g}" if type(part) is float else str(part) for part in parts)


def section_values(values: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The values of settings' options, by section; those not given are left out."""
    sections: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        section, separator, name = key.partition(SEPARATOR)
        if separator and value is not None and value != ():
            sections.setdefault(section, {})[name] = value
    return sections


def option_of(section: str, name: str, field: FieldInfo) -> tuple[list[str], dict[str, Any]]:
    """Names and arguments of the option that stands for a setting, as click takes them."""
    flag = option_named(name, field)
    arguments: dict[str, Any] = {"help": _help(field), **_click_type(field.annotation)}
    if arguments.pop("is_flag", False):
        flag = f"{flag}/--no-{flag[2:]}"
    return [flag, f"{section}{SEPARATOR}{name}"], {"default": None, **arguments}


def _help(field: FieldInfo) -> str:
    default = field.get_default()
    if default is None or default == ():
        return field.description or ""
    if isinstance(default, tuple):
        default = " ".join(str(part) for part in default)
    elif isinstance(default, bool):
        default = "on" if default else "off"
    elif isinstance(default, float):
        default = f"{default:g}"
    return f"{field.description}  [default: {default}]"


def _click_type(annotation: Any) -> dict[str, Any]:
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if annotation == LonLat:
        return {"type": str, "metavar": "LON,LAT"}
    if origin is typing.Annotated:
        return _click_type(arguments[0])
    if origin in (types.UnionType, typing.Union):
        plain = [each for each in arguments if each is not type(None)]
        return _click_type(plain[0]) if len(plain) == 1 else {"type": str}
    if origin is Literal:
        return {"type": NearestChoice([str(each) for each in arguments])}
    if origin is tuple:
        inner = _click_type(arguments[0])
        if len(arguments) == 2 and arguments[1] is Ellipsis:
            return {**inner, "multiple": True}
        return {"type": tuple(_click_type(each).get("type", str) for each in arguments)}
    if annotation is bool:
        return {"is_flag": True}
    return {"type": annotation if annotation in (int, float, str) else str}
