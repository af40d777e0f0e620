"""``geofield settings``: every setting and every command's parameters, as data."""

from __future__ import annotations

import re
from typing import Any

import click

from geofield.cli.console import echo_json
from geofield.cli.options import SEPARATOR, option_of
from geofield.settings import MODELS, Machine


@click.command(
    epilog="""\b
Example:
  geofield settings --json
"""
)
@click.option("--json", "as_json", is_flag=True, help="Print all as JSON on stdout.")
@click.pass_context
def settings(context: click.Context, as_json: bool) -> None:
    """List the settings: their names in a settings file, what they mean, their defaults.

    With --json a program gets all it needs to ask a person: type, choices, limits, defaults
    and options of every setting, and the parameters of every command.
    """
    rows = all_settings()
    if as_json:
        echo_json({"settings": rows, "commands": all_commands(context)})
        return
    for row in rows:
        default = "" if row["default"] in (None, [], {}) else f"  [default: {row['default']}]"
        click.echo(f"{row['section']}.{row['name']}: {row['description']}{default}")
    for name, field in Machine.model_fields.items():
        click.echo(f"machines.NAME.{name}: {field.description}")


def all_settings() -> list[dict[str, Any]]:
    """Each setting of `geofield.settings`, plain JSON values."""
    rows = []
    for section, model in MODELS.items():
        schema = model.model_json_schema()["properties"]
        for name, field in model.model_fields.items():
            names, arguments = option_of(section, name, field)
            option = click.Option(names, **arguments)
            value = field.get_default()
            rows.append(
                {
                    "section": section,
                    "name": name,
                    "description": field.description or "",
                    "default": list(value) if isinstance(value, tuple) else value,
                    "option": option.opts[0],
                    **_kind(option),
                    **_limits(schema[name]),
                }
            )
    return rows


def all_commands(context: click.Context) -> dict[str, Any]:
    """Each command with its parameters; a setting's own name is in its parameter's name."""
    group = context.find_root().command
    if not isinstance(group, click.Group):
        return {}
    found = {}
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if command is not None:
            found[name] = {
                "help": (command.help or "").strip(),
                "parameters": [
                    _parameter(each, command.help or "")
                    for each in command.params
                    if each.name not in ("help", "progress", "log_file", "verbose")
                ],
            }
    return found


def _parameter(parameter: click.Parameter, command_help: str) -> dict[str, Any]:
    section, separator, name = (parameter.name or "").partition(SEPARATOR)
    if separator:
        return {"setting": f"{section}.{name}"}
    default = parameter.default
    plain = default if isinstance(default, str | int | float | bool) else None
    return {
        "name": parameter.name,
        "option": parameter.opts[0] if isinstance(parameter, click.Option) else "",
        "description": _described(parameter, command_help),
        "required": parameter.required,
        "default": plain,
        **_kind(parameter),
    }


def _described(parameter: click.Parameter, command_help: str) -> str:
    """What a parameter is; an argument has no help of its own, but a sentence of its command's."""
    if isinstance(parameter, click.Option):
        return parameter.help or ""
    called = (parameter.metavar or str(parameter.name).upper()).strip("[]").split()[0].rstrip(".")
    sentences = re.split(r"(?<=\.)\s+|\n\n", command_help)
    about = [
        " ".join(one.split()) for one in sentences if re.search(rf"\b{re.escape(called)}\b", one)
    ]
    return min(about, key=lambda one: not one.startswith(called), default="")


def _kind(parameter: click.Parameter) -> dict[str, Any]:
    """What a value looks like: type, choices, how many."""
    kind = parameter.type
    is_flag = isinstance(parameter, click.Option) and parameter.is_flag
    row: dict[str, Any] = {"type": "flag" if is_flag else kind.name, "multiple": False}
    if isinstance(kind, click.Choice):
        row |= {"type": "choice", "choices": [str(each) for each in kind.choices]}
    if isinstance(kind, click.FloatRange | click.IntRange):
        row["type"] = "integer" if isinstance(kind, click.IntRange) else "float"
        limits = {"above" if kind.min_open else "minimum": kind.min, "maximum": kind.max}
        row |= {name: limit for name, limit in limits.items() if limit is not None}
    if isinstance(kind, click.types.CompositeParamType):
        row |= {"type": "numbers", "count": kind.arity}
    if is_flag and isinstance(parameter, click.Option) and parameter.secondary_opts:
        row["off"] = parameter.secondary_opts[0]
    if getattr(parameter, "multiple", False) or parameter.nargs == -1:
        row["multiple"] = True
    return row


def _limits(schema: dict[str, Any]) -> dict[str, Any]:
    """Smallest and largest value of a number, where it has any."""
    number = next((each for each in schema.get("anyOf", ()) if each.get("type") != "null"), schema)
    words = {"minimum": "minimum", "exclusiveMinimum": "above", "maximum": "maximum"}
    return {ours: number[theirs] for theirs, ours in words.items() if theirs in number}
