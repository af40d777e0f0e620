"""Time against size: is there a step that grows worse than n log n.

python benchmarks/cliffs.py [--quick]

Processor time of one process, so that other work on the machine does not count.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path

import geopandas as gpd
import numpy as np
import shapely

from common import machine, write_page
from geofield.model import Tracks
from geofield.tracks import plan_route, plan_tracks

CRS = 32633
ORIGIN = np.array([500_000.0, 5_600_000.0])


def processor_s(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def star(vertices: int) -> shapely.Polygon:
    """A field of five lobes, 400 m in radius, with a wobble like that of a digitised border."""
    angle = np.linspace(0.0, 2.0 * np.pi, vertices, endpoint=False)
    wobble = np.random.default_rng(1).uniform(-0.3, 0.3, vertices) * min(1.0, 300.0 / vertices)
    reach = 400.0 * (1.0 + 0.1 * np.sin(5.0 * angle)) + wobble
    ring = np.column_stack((reach * np.cos(angle), reach * np.sin(angle)))
    return shapely.Polygon(ring + ORIGIN)


def orchard(trees: int) -> tuple[shapely.Polygon, list[shapely.Point], float]:
    """A square field with trees 12 m apart on average."""
    side = max(400.0, 12.0 * np.sqrt(trees))
    places = np.random.default_rng(1).uniform(0.0, side, (trees, 2)) + ORIGIN
    return shapely.box(*ORIGIN, *(ORIGIN + side)), list(shapely.points(places)), side


def steep(lines: list[str]) -> list[str]:
    """Names the steps of a table of times that are steeper than n log n, and take a second."""
    names = [name.strip() for name in lines[0].strip("|").split("|")]
    rows = [
        [float(cell) if cell.strip() != "-" else np.nan for cell in line.strip("|").split("|")]
        for line in lines[2:]
    ]
    found = []
    for before, after in pairwise(rows):
        size, larger = before[0], after[0]
        allowed = 1.5 * larger * np.log(larger + 1) / (size * np.log(size + 1))
        found += [
            f"{name}: {b / a:.0f} times from {size:.0f} to {larger:.0f}"
            for name, a, b in zip(names, before, after, strict=True)
            if name not in ("segments", "wall s", "per field") and b > 1.0 and b > allowed * a
        ]
    told = "; ".join(found) or "none"
    return [*lines, "", f"Steps of a second or more that are steeper than n log n: {told}."]


def outlines(sizes: list[int]) -> list[str]:
    lines = ["| vertices | dominant | hough | fewest | with headland | statistics |"]
    lines.append("| ---: | ---: | ---: | ---: | ---: | ---: |")
    for size in sizes:
        field = star(size)
        cells = []
        for options in ({}, {"direction": "hough"}, {"direction": "fewest"}, {"headland_m": 8.0}):
            plan = partial(plan_tracks, field, crs=CRS, spacing_m=4.0, **options)
            cells.append(processor_s(plan))
        tracks = plan_tracks(field, crs=CRS, spacing_m=4.0)
        cells.append(processor_s(partial(getattr, tracks, "statistics")))
        lines.append(f"| {size} | " + " | ".join(f"{cell:.3f}" for cell in cells) + " |")
    return lines


def obstacles(sizes: list[int], most_for_route: int) -> list[str]:
    lines = ["| obstacles | segments | tracks | with headland | statistics | points | route |"]
    lines.append("| ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    for size in sizes:
        field, trees, _ = orchard(size)
        made: list[Tracks] = []

        def plan(headland_m: float, field=field, trees=trees, made=made) -> None:
            made.append(
                plan_tracks(
                    field, trees, crs=CRS, spacing_m=4.0, clearance_m=3.0, headland_m=headland_m
                )
            )

        cells = [processor_s(partial(plan, 0.0)), processor_s(partial(plan, 8.0))]
        tracks = made[0]
        cells.append(processor_s(partial(getattr, tracks, "statistics")))
        cells.append(processor_s(partial(getattr, tracks, "points")))
        route = "-"
        if size <= most_for_route:
            route = f"{processor_s(partial(plan_route, tracks, turning_radius_m=5.0)):.3f}"
        figures = " | ".join(f"{cell:.3f}" for cell in cells)
        lines.append(f"| {size} | {len(tracks.segments)} | {figures} | {route} |")
    return lines


def spacings(widths_m: list[float]) -> list[str]:
    field, trees, _ = orchard(50)
    lines = ["| spacing | pieces | seconds |", "| ---: | ---: | ---: |"]
    for width_m in widths_m:
        found: list[Tracks] = []

        def plan(width_m: float, found: list[Tracks]) -> None:
            found.append(plan_tracks(field, trees, crs=CRS, spacing_m=width_m, clearance_m=3.0))

        seconds = processor_s(partial(plan, width_m, found))
        lines.append(f"| {width_m:g} m | {len(found[0].segments)} | {seconds:.3f} |")
    return lines


def fields(sizes: list[int], out: str) -> list[str]:
    """`geofield tracks` on so many parcels: wall and processor time of the command."""
    import resource

    lines = ["| fields | processor s | per field | wall s |", "| ---: | ---: | ---: | ---: |"]
    for size in sizes:
        with tempfile.TemporaryDirectory() as folder:
            row, column = np.divmod(np.arange(size), 100)
            x, y = 300.0 * column + ORIGIN[0], 300.0 * row + ORIGIN[1]
            parcels = gpd.GeoDataFrame(geometry=shapely.box(x, y, x + 200.0, y + 80.0), crs=CRS)
            parcels.to_file(Path(folder, "parcels.gpkg"), layer="parcels")
            command = ["tracks", "parcels.gpkg", "--spacing", "4", "-o", *out.split()]
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            start = time.perf_counter()
            subprocess.run(
                [sys.executable, "-m", "geofield", *command],
                cwd=folder,
                check=True,
                capture_output=True,
            )
            wall = time.perf_counter() - start
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        lines.append(f"| {size} | {used:.1f} | {used / size:.3f} | {wall:.1f} |")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="Leave out what takes minutes.")
    quick = parser.parse_args().quick
    warnings.simplefilter("ignore")
    plan_tracks(star(100), crs=CRS, spacing_m=4.0)
    lines = [
        *machine("shapely", "numpy", "geopandas"),
        "",
        "Processor seconds. A step is called steep where it grows 1.5 times faster than n log n.",
        "",
        "## Vertices of the outline",
        "",
        *steep(outlines([100, 1000, 10_000, 100_000] if quick else [10**k for k in range(2, 7)])),
        "",
        "## Obstacles",
        "",
        "Trees 12 m apart on average; a route with turning radius is planned up to 1000.",
        "",
        *steep(obstacles([1, 10, 100, 1000, 10_000, 50_000], 100 if quick else 1000)),
        "",
        "## Spacing",
        "",
        "A field of 400 by 400 m with 50 trees. More than ten million pieces are refused at once.",
        "",
        *spacings([10.0, 1.0, 0.1, 0.01]),
        "",
        "## Many fields in one command",
        "",
        "All into one GeoPackage with styles and a QGIS project:",
        "",
        *steep(fields([1, 10, 100] if quick else [10**k for k in range(5)], "plans.gpkg")),
        "",
        "Each into one of its own (`--each`):",
        "",
        *steep(fields([1, 10, 100] if quick else [1, 10, 100, 1000], "plans/ --each")),
    ]
    write_page("cliffs", "Time against size", lines)


if __name__ == "__main__":
    main()
