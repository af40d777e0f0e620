"""Damaged and hostile files through every reader: what they cost, and what comes back.

python benchmarks/fuzz.py [--files 2000] [--seed 7]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import warnings
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.fuzz.corpus import make_corpus
from tests.fuzz.hostile import hostile
from tests.fuzz.run import Outcome, fuzz, read

import geofield.cli.main  # noqa: F401  (the children inherit what is imported)
from common import machine, write_page


def main() -> None:
    """Run and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=7)
    given = parser.parse_args()
    outcomes: list[Outcome] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with warnings.catch_warnings(action="ignore"):
            samples, point = make_corpus(folder / _made(folder / "corpus"))
        for outcome in fuzz(
            samples, point, _made(folder / "damaged"), seed=given.seed, files=given.files
        ):
            _tell(outcome)
            outcomes.append(outcome)
        for number, sample in enumerate(hostile(_made(folder / "hostile"))):
            for n, command in enumerate(sample.commands):
                place = _made(folder / f"h{number}_{n}")
                target = place / sample.path.name
                target.write_bytes(sample.path.read_bytes())
                outcome = read("hostile", sample.kind, target, command, point)
                _tell(outcome)
                outcomes.append(outcome)
    by_kind: dict[str, list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        by_kind[outcome.kind].append(outcome)
    lines = [
        f"{given.files} damaged files (seed {given.seed}) and all hostile ones, each read by one "
        "of its commands. A fault is a traceback, another exit code than 0, 1 or 2, silence, "
        "something written beside a failure, more than 20 s or more than 1 GB.",
        "",
        "| kind | read | still sound | refused | slowest, s | most memory, MB | faults |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for kind, each in sorted(by_kind.items()):
        sound = sum(one.code == 0 for one in each)
        lines.append(
            f"| {kind} | {len(each)} | {sound} | {len(each) - sound} | "
            f"{max(one.seconds for one in each):.1f} | {max(one.megabytes for one in each):.0f} | "
            f"{sum(bool(one.faults) for one in each)} |"
        )
    write_page("fuzz", "Damaged and hostile files", [*lines, "", *machine("pyogrio", "fiona")])


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _tell(outcome: Outcome) -> None:
    if outcome.faults:
        print(
            outcome.kind, "|", outcome.what, "|", outcome.command, "|", outcome.faults, flush=True
        )


if __name__ == "__main__":
    main()
