"""Damaged and hostile files: a message and exit code 1 or 2, in bounds, nothing written.

This is the short run; `benchmarks/fuzz.py` damages 2 000 files.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import pytest

import geofield.cli.main  # noqa: F401  (the children inherit what is imported)

from .corpus import Sample, make_corpus
from .hostile import hostile
from .run import fuzz, read

pytestmark = [
    pytest.mark.filterwarnings("ignore:This process.*fork:DeprecationWarning"),
    pytest.mark.skipif(not hasattr(__import__("os"), "fork"), reason="needs fork"),
]


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Sample], str]:
    with warnings.catch_warnings(action="ignore"):
        return make_corpus(tmp_path_factory.mktemp("corpus"))


def test_sound_files_are_read(corpus: tuple[list[Sample], str], tmp_path: Path) -> None:
    samples, point = corpus
    assert len({sample.kind for sample in samples}) >= 15
    of_each_kind = {sample.kind: sample for sample in reversed(samples)}
    for number, sample in enumerate(of_each_kind.values()):
        if sample.kind == "capabilities":
            continue
        place = tmp_path / str(number)
        place.mkdir()
        (place / sample.path.name).symlink_to(sample.path)
        outcome = read(sample.kind, "sound", place / sample.path.name, sample.commands[0], point)
        assert outcome.code == 0, (sample, outcome.said)


def test_damaged_files(corpus: tuple[list[Sample], str], tmp_path: Path) -> None:
    samples, point = corpus
    outcomes = list(fuzz(samples, point, tmp_path, seed=1, files=70))
    assert sum(outcome.code > 0 for outcome in outcomes) > 25
    assert not [(each, each.faults) for each in outcomes if each.faults]


def test_hostile_files(corpus: tuple[list[Sample], str], tmp_path: Path) -> None:
    _, point = corpus
    found = []
    for number, sample in enumerate(hostile(tmp_path / "made")):
        for command in sample.commands[:1]:
            place = tmp_path / f"{number}"
            place.mkdir()
            (place / sample.path.name).write_bytes(sample.path.read_bytes())
            outcome = read(sample.kind, "hostile", place / sample.path.name, command, point)
            if outcome.faults:
                found.append((sample.kind, command, outcome.faults))
    assert not found
    assert not list(tmp_path.rglob("escaped.txt"))


def test_memory_is_the_commands_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither does what other tests left here count, nor is what the command takes overlooked."""

    def greedy(words: list[str]) -> None:
        assert len(bytearray(b"x") * (int(words[0]) << 20))

    monkeypatch.setattr(sys.modules["geofield.cli.main"], "main", greedy)
    left = bytearray(b"x") * (1100 << 20)
    outcomes = []
    for megabytes in (10, 1100):
        place = tmp_path / str(megabytes)
        place.mkdir()
        outcomes.append(read("", "", place / "file", str(megabytes), ""))
    assert len(left) == 1100 << 20
    little, much = outcomes
    assert not [fault for fault in little.faults if fault.endswith(" MB")]
    assert much.code == 0
    assert [fault for fault in much.faults if fault.endswith(" MB")]
