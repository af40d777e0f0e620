"""Help of the command line: in groups, and one meaning per option."""

from __future__ import annotations

import re
from collections import defaultdict

import click
import pytest
from click.testing import CliRunner

from geofield.cli.main import COMMANDS, cli


@pytest.mark.parametrize("name", ["run", "field", "obstacles", "tracks"])
def test_what_everyone_uses_comes_first_and_the_study_last(name: str) -> None:
    text = CliRunner().invoke(cli, [name, "--help"]).output
    groups = re.findall(r"^([A-Z][\w' ]+):$", text, re.MULTILINE)
    groups = [group for group in groups if not group.startswith("Example")]
    assert groups[0] == "Used by everyone"
    if name != "tracks":
        assert groups[-1] == "The study's method"
    # Every option is listed, once.
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    listed = re.findall(r"^  (-[-\w]+)", text, re.MULTILINE)
    assert len(listed) == len(set(listed))
    options = [each for each in command.params if isinstance(each, click.Option)]
    assert {each.opts[0] for each in options} <= set(listed)


def test_an_option_has_the_same_kind_of_value_in_every_command() -> None:
    kinds: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for name in COMMANDS:
        command = cli.get_command(click.Context(cli), name)
        assert command is not None
        for option in command.params:
            if not isinstance(option, click.Option):
                continue
            kind = (
                "flag" if option.is_flag else type(option.type).__name__.replace("Degrees", "Float")
            )
            for word in option.opts:
                # A folder may also be an address of an object store, written as a text.
                plain = kind.replace("Range", "").replace("ParamType", "").replace("Path", "String")
                kinds[word][plain].append(name)
    several = {word: dict(kind) for word, kind in kinds.items() if len(kind) > 1}
    assert not several
