"""Nothing that a user may say is left without words: arguments, options, settings, parameters."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any

import click
import pytest
from pydantic import BaseModel

import geofield as gf
from geofield.cli.main import cli
from geofield.settings import SECTIONS, Settings


def commands(command: click.Command, name: str) -> Iterator[tuple[str, click.Command]]:
    """A command and all below it."""
    yield name, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for each in command.list_commands(context):
            child = command.get_command(context, each)
            assert child is not None
            yield from commands(child, f"{name} {each}")


COMMANDS = dict(commands(cli, "geofield"))


@pytest.mark.parametrize("name", COMMANDS)
def test_arguments_and_options_are_described(name: str) -> None:
    command = COMMANDS[name]
    context = click.Context(command)
    silent = []
    for one in command.get_params(context):
        if isinstance(one, click.Option):
            if not one.hidden and not (one.help or "").strip():
                silent.append(one.opts[0])
        else:
            words = re.findall(r"[A-Z][A-Z_]+", one.make_metavar(context))
            if not any(re.search(rf"\b{word}\b", command.help or "") for word in words):
                silent.append(" ".join(words))
    assert not silent


def test_settings_are_described() -> None:
    for section in SECTIONS:
        model: Any = Settings.model_fields[section].annotation
        assert len(inspect.getdoc(model)) > 10
        for name, field in model.model_fields.items():
            assert field.description, f"{section}.{name}"


def undescribed(function: Callable[..., Any], *words: str) -> list[str]:
    """Parameters that stand neither under `Parameters` nor in backticks in any of the texts."""
    listed = "\n".join(text.partition("Parameters\n-----")[2] for text in words)
    missing = []
    for name in inspect.signature(function).parameters:
        if name in ("self", "cls") or name.startswith("_"):
            continue
        under = re.search(rf"^[\w, *]*\b{name}\b[\w, *]*(:|$)", listed, re.MULTILINE)
        if not under and not any(f"`{name}`" in text for text in words):
            missing.append(name)
    return missing


PUBLIC = [name for name in gf.__all__ if name != "__version__"]


@pytest.mark.parametrize("name", PUBLIC)
def test_public_parameters_are_described(name: str) -> None:
    one = getattr(gf, name)
    words = inspect.getdoc(one) or ""
    silent = []
    if not inspect.isclass(one):
        silent += undescribed(one, words)
    elif not issubclass(one, BaseModel | Exception):
        if not hasattr(one, "__dataclass_fields__"):
            silent += undescribed(one, words)
        for method, value in vars(one).items():
            inner = getattr(value, "__func__", value)
            if method.startswith("_"):
                continue
            if inspect.isfunction(inner):
                own = inspect.getdoc(inner) or ""
                silent += [f"{method}({each})" for each in undescribed(inner, own, words)]
            elif isinstance(value, property):
                silent += [] if inspect.getdoc(value) else [method]
    assert not silent
    for field in getattr(one, "__dataclass_fields__", {}):
        assert field.startswith("_") or re.search(rf"\b{field}\b", words), field


def test_a_silent_parameter_is_noticed() -> None:
    def plan(spacing_m: float, heading_deg: float) -> None:
        """Plan.

        Parameters
        ----------
        spacing_m : float
        """

    assert undescribed(plan, inspect.getdoc(plan)) == ["heading_deg"]
