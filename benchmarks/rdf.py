"""Linked data at scale: seconds, size and peak memory of each writer, rdflib beside it.

    python benchmarks/rdf.py [--quick]

The plans: 46 027 track points (the largest of the source study) and 1 million, streamed from
their segments. Every measurement runs in a process of its own, so that the peak memory is its
own. Seconds are those of a clock; CPU seconds stand beside them, because other work on the
machine moves the one and hardly the other. rdflib serialises the same graph, loaded before its
time is taken.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from common import machine, write_page

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "rdf"))

STUDY_POINTS = 46_027
NOTE = (
    "Medians of three runs; the million points and rdflib once. MB is the size of what was written "
    "(for the reading and the rdflib rows, of their input and output together). "
    "Where other work keeps the cores busy, compare CPU seconds and ratios."
)
#: Name, points, profile.
CASES = (
    ("write_rdfxml", STUDY_POINTS, "geosparql"),
    ("write_rdfxml without points", STUDY_POINTS, "geosparql"),
    ("write_ntriples", 1_000_000, "geosparql"),
    ("rdflib xml", STUDY_POINTS, "geosparql"),
    ("write_rdfxml", STUDY_POINTS, "study"),
    ("write_turtle", STUDY_POINTS, "geosparql"),
    ("write_jsonld", STUDY_POINTS, "geosparql"),
    ("write_ntriples", STUDY_POINTS, "geosparql"),
    ("write_jsonld", STUDY_POINTS, "study"),
    ("read rdfxml", STUDY_POINTS, "geosparql"),
    ("read rdfxml", STUDY_POINTS, "study"),
    ("read turtle", STUDY_POINTS, "geosparql"),
    ("read jsonld", STUDY_POINTS, "geosparql"),
    ("read ntriples", STUDY_POINTS, "geosparql"),
    ("rdflib nt", STUDY_POINTS, "geosparql"),
    ("rdflib parse", STUDY_POINTS, "geosparql"),
)


def measure(name: str, points: int, profile: str, folder: Path) -> dict[str, float]:
    """One case, in this process."""
    from rdf_plans import long_plan

    from geofield.formats.rdf import write

    options = {"rdf_profile": profile, "points": "without points" not in name}
    plan = long_plan(points)
    work: Any
    if name.startswith("write_"):
        writer = getattr(write, name.split(maxsplit=1)[0])

        def work() -> None:
            writer(plan, folder, options=options)
    else:
        syntax = name.split()[1] if name.startswith("read") else "rdfxml"
        paths = getattr(write, f"write_{syntax}")(plan, folder, options=options)
        work = _other(name, paths)
    before = _peak()
    start, cpu = time.perf_counter(), time.process_time()
    work()
    seconds, cpu_seconds = time.perf_counter() - start, time.process_time() - cpu
    size = sum(path.stat().st_size for path in folder.iterdir()) / 1e6
    return {"s": seconds, "cpu_s": cpu_seconds, "MB": size, "before": before, "peak": _peak()}


def _other(name: str, paths: list[Path]) -> Any:
    if name.startswith("read"):
        from geofield.formats.rdf.read import read

        return lambda: read(paths[0])
    import rdflib

    graph = rdflib.Graph()
    if name == "rdflib parse":
        return lambda: [graph.parse(path) for path in paths]
    import pyoxigraph as ox

    # Loaded with a quick parser: only the serialiser is measured.
    text = b"".join(
        ox.serialize((q.triple for q in ox.parse(path=path)), format=ox.RdfFormat.N_TRIPLES) or b""
        for path in paths
    )
    graph.parse(data=text, format="nt")
    syntax = name.split()[1]
    target = paths[0].with_suffix(".out")
    return lambda: graph.serialize(target, format=syntax)


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="one run each, without rdflib")
    parser.add_argument("--case", nargs=3, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.case:
        name, points, profile = arguments.case
        with tempfile.TemporaryDirectory() as folder:
            print(json.dumps(measure(name, int(points), profile, Path(folder))))
        return
    lines = [
        *machine("pyarrow", "rdflib", "pyoxigraph"),
        "",
        "| what | points | profile | s | CPU s | MB | peak memory MB | of it before |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, points, profile in CASES:
        if arguments.quick and name.startswith("rdflib"):
            continue
        large = points > STUDY_POINTS or name.startswith("rdflib")
        runs = [_run(name, points, profile) for _ in range(1 if arguments.quick or large else 3)]
        median = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
        lines.append(
            f"| {name} | {points} | {profile} | {median['s']:.2f} | {median['cpu_s']:.2f} | "
            f"{median['MB']:.1f} | {median['peak']:.0f} | {median['before']:.0f} |"
        )
        # Written after every row, so that a long run that is broken off leaves its figures.
        write_page("rdf", "Linked data", [*lines, "", NOTE])


def _run(name: str, points: int, profile: str) -> dict[str, float]:
    command = [sys.executable, __file__, "--case", name, str(points), profile]
    result = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(result.stdout.splitlines()[-1])


if __name__ == "__main__":
    main()
