"""Help of the command line: in groups, and one meaning per option."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from geofield.cli.main import COMMANDS, cli
from geofield_command import run_geofield


@pytest.mark.parametrize("name", ["run", "field", "obstacles", "tracks", "batch"])
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
    # No row is a bare name.
    assert not re.findall(r"^  \[?[A-Z][A-Za-z.]*\]?$", text, re.MULTILINE)
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
            kind = "flag" if option.is_flag else type(option.type).__name__
            # Both are numbers with a point; they refuse more than click's own.
            kind = kind.replace("Degrees", "Float").replace("Number", "Float")
            for word in option.opts:
                # A folder may also be an address of an object store, written as a text.
                plain = kind.replace("Range", "").replace("ParamType", "")
                plain = plain.replace("NamedPath", "String").replace("Path", "String")
                kinds[word][plain].append(name)
    several = {word: dict(kind) for word, kind in kinds.items() if len(kind) > 1}
    assert not several


_FIRST = {"the first one ": 1, "the first two ": 2, "the first three ": 3}


def examples_on_the_sample(name: str) -> list[str]:
    """The command lines of a command's help that are said to run on the project's own sample."""
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    found = re.search(
        r"Examples? \(((?:the first \w+ )?)on the project's own sample\):\n((?:  .*\n)+)",
        command.epilog or "",
    )
    if not found:
        return []
    lines = [line.strip() for line in found[2].replace("\\\n", "").splitlines()]
    return lines[: _FIRST.get(found[1])]


def as_typed(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a line of the help, in a shell where only one understands it."""
    if not set("|<>&;*?$") & set(line):
        return run_geofield(*shlex.split(line)[1:], folder=folder)
    command = f"{sys.executable} -m {line}"
    return subprocess.run(
        command, shell=True, cwd=folder, capture_output=True, text=True, check=False
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in COMMANDS if examples_on_the_sample(name)])
def test_examples_run_one_after_the_other(name: str, tmp_path: Path) -> None:
    shutil.copytree(Path(__file__).parents[1] / "sample_data", tmp_path / "sample_data")
    before = (tmp_path / "sample_data" / "field_1.gpkg").read_bytes()
    for line in examples_on_the_sample(name):
        assert line.startswith("geofield ")
        done = as_typed(line, tmp_path)
        assert done.returncode == 0, (line, done.stderr)
    assert (tmp_path / "sample_data" / "field_1.gpkg").read_bytes() == before
