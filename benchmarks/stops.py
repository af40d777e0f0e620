"""Stops at random moments: whether products are ever mixed, half-written or left over.

python benchmarks/stops.py [--stops 200] [--seed 7]
"""

from __future__ import annotations

import argparse
import random
import shutil
import signal
import sys
import tempfile
from collections import Counter, defaultdict
from contextlib import suppress
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.stops.moments import STOPS, Stop, make_works, stop

import geofield.cli.main  # noqa: F401  (the children inherit what is imported)
from common import machine, write_page
from geofield.imagery import write_scene
from geofield.simulate import SimulationSettings, simulate_field


def main() -> None:
    """Run and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stops", type=int, default=200)
    parser.add_argument("--seed", type=int, default=7)
    given = parser.parse_args()
    # A shell's background work ignores SIGINT, and so would the commands that it starts.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    dice = random.Random(given.seed)
    found: list[Stop] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = simulate_field(5, SimulationSettings(width_px=160, height_px=160, obstacles=3))
        write_scene(made.scene, folder / "picture.tif")
        point = ["--lat", str(made.lat), "--lon", str(made.lon)]
        works = make_works(folder, folder / "picture.tif", point)
        with suppress(KeyboardInterrupt):  # Ctrl+C: the page tells of those that were
            for number in range(given.stops):
                work = works[number % len(works)]
                kind = STOPS[number // len(works) % len(STOPS)]
                # A fifth while files are moved: few moments of chance fall into that.
                aimed = number // len(works) % 5 == 4 and len(work.written) > 1
                out = folder / str(number)
                found.append(stop(work, kind, dice, out, aimed=aimed))
                shutil.rmtree(out)
                if found[-1].faults:
                    print(found[-1], flush=True)
    write_page("stops", "Stops at random moments", _page(found, given.seed))


def _page(found: list[Stop], seed: int) -> list[str]:
    groups: dict[tuple[str, str], list[Stop]] = defaultdict(list)
    for each in found:
        groups[each.work, each.kind].append(each)
    aimed = sum(each.moment == "while moving" for each in found)
    cut = [each for each in found if each.work != "batch" and each.at_once not in ("old", "new")]
    lines = [
        f"{len(found)} stops (seed {seed}) of commands that replace earlier products: "
        f"{len(found) - aimed} at moments drawn evenly over the command's life, {aimed} as soon as "
        "its files begin to move into place. After each, another command works in the folder, and "
        "rasterio, fiona, pyogrio, rdflib, Pillow, pyarrow and SQLite read every product.",
        "",
        "A fault is a mixture of old and new files, one that cannot be read, a hidden folder that "
        "stays, a traceback, or an exit code other than 1 with a word (0 where the work was done; "
        "the signal's own where it met Python before the command had begun). A farm (`batch`) goes "
        "on where it was stopped: after each stop the same command is given again, and a file "
        "whose bytes are not those of an undisturbed run is a fault.",
        "",
        "| command | stop | stops | products before | products of the stopped one | exit codes | "
        "faults |",
        "| --- | --- | ---: | ---: | ---: | --- | ---: |",
    ]
    for (work, kind), stops in groups.items():
        products = Counter(one.products for one in stops)
        codes = Counter(one.code for one in stops)
        told = ", ".join(f"{code}: {count}" for code, count in sorted(codes.items()))
        lines.append(
            f"| {work} | {kind} | {len(stops)} | {products['old']} | {products['new']} | {told} | "
            f"{sum(bool(one.faults) for one in stops)} |"
        )
    lines += [
        "",
        f"Of the kills, {len(cut)} fell between two moves; until the next command came, which "
        "finished them, old and new files lay side by side.",
    ]
    return [*lines, "", *machine("pyogrio", "fiona", "rdflib")]


if __name__ == "__main__":
    main()
