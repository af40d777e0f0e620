"""Writing a very large plan in every format: seconds, bytes and peak memory.

    python benchmarks/formats.py [--quick]

The plan: 1500 tracks of 2 m spacing and 2400 m length, 38 000 segments, 36 500 gaps, 10 000
obstacles, 3.6 million track points. Every format is written in a process of its own, so that
the peak memory is its own; the memory of the plan itself, before writing, stands beside it.
As a peer geopandas writes the same tables to a GeoPackage, without styles, project, origin.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import shapely
from affine import Affine
from pyproj import CRS

from common import machine, write_page
from geofield import schema
from geofield.crs import LONLAT, transformer
from geofield.formats import FORMATS, write_dataset
from geofield.grid import Grid
from geofield.model import Dataset, ImagerySource, Provenance, Tracks
from geofield.model.obstacles import circle_polygons

UTM = CRS.from_epsg(32636)
X0, Y0 = 500_000.0, 3_880_000.0
SPACING_M, LENGTH_M = 2.0, 2400.0


def large_plan(tracks: int = 1500, segments: int = 38_000, obstacles: int = 10_000) -> Dataset:
    """A plan of these sizes; every segment but a track's last ends at a gap of 0.5 m."""
    per_track = np.full(tracks, segments // tracks)
    per_track[: segments - per_track.sum()] += 1
    track = np.repeat(np.arange(tracks), per_track)
    number = np.arange(segments) - np.repeat(np.cumsum(per_track) - per_track, per_track)
    piece = LENGTH_M / per_track[track]
    y0 = Y0 + number * piece
    y1 = np.where(number == per_track[track] - 1, Y0 + LENGTH_M, y0 + piece - 0.5)
    x = X0 + (track + 0.5) * SPACING_M
    lines = shapely.linestrings(np.stack([np.column_stack([x, y0]), np.column_stack([x, y1])], 1))
    segment_table = schema.table(
        schema.SEGMENTS,
        {"track_no": track + 1, "segment_no": number + 1, "length_m": y1 - y0},
        lines,
        UTM,
    )
    inner = number < per_track[track] - 1
    a, b = np.column_stack([x, y1])[inner], np.column_stack([x, y1 + 0.5])[inner]
    causes = (np.arange(inner.sum()) % obstacles) + 1
    gap_table = schema.table(
        schema.GAPS,
        {
            "track_no": track[inner] + 1,
            "gap_no": number[inner] + 1,
            "length_m": np.full(inner.sum(), 0.5),
            "cause": [f"obstacle {no}" for no in causes],
            "obstacle_no": causes,
        },
        shapely.linestrings(np.stack([a, b], 1)),
        UTM,
    )
    track_table = schema.table(
        schema.TRACKS,
        {
            "track_no": np.arange(1, tracks + 1),
            "heading_deg": np.full(tracks, 0.0),
            "segment_count": per_track,
            "gap_count": per_track - 1,
            "point_count": per_track * 95,
            "length_m": np.full(tracks, LENGTH_M),
        },
        shapely.multilinestrings(np.asarray(lines), indices=track),
        UTM,
    )
    grid = Grid(6000, 4800, Affine(0.5, 0, X0, 0, -0.5, Y0 + LENGTH_M), UTM)
    rng = np.random.default_rng(7)
    cx = X0 + rng.uniform(0, tracks * SPACING_M, obstacles)
    cy = Y0 + rng.uniform(0, LENGTH_M, obstacles)
    radius = rng.uniform(1, 6, obstacles)
    lon, lat = transformer(UTM, LONLAT).transform(cx, cy)
    x_px, y_px = grid.from_crs(cx, cy, UTM)
    obstacle_table = schema.table(
        schema.OBSTACLES,
        {
            "obstacle_no": np.arange(1, obstacles + 1),
            "kind": ["tree"] * obstacles,
            "status": ["detected"] * obstacles,
            "radius_m": radius,
            "buffer_m": np.full(obstacles, 0.5),
            "confidence": rng.uniform(0, 1, obstacles),
            "x_px": x_px,
            "y_px": y_px,
            "radius_px": radius / 0.5,
            "lat": lat,
            "lon": lon,
        },
        circle_polygons(cx, cy, radius + 0.5, UTM),
        UTM,
    )
    outline = shapely.box(X0, Y0, X0 + tracks * SPACING_M, Y0 + LENGTH_M)
    field_table = schema.table(
        schema.FIELD,
        {"field_id": ["large"], "name": ["Large field"], "area_ha": [outline.area / 1e4]},
        [outline],
        UTM,
    )
    planned = Tracks(track_table, segment_table, gap_table, 0.0, SPACING_M, 1.0, grid)
    return Dataset(
        {
            "field": field_table,
            "obstacles": obstacle_table,
            "tracks": track_table,
            "segments": segment_table,
            "gaps": gap_table,
        },
        UTM,
        "Large field",
        Provenance("geofield", ImagerySource("synthetic", "2024-06-01")),
        grid,
        points=planned.point_chunks,
    )


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def write_peer(dataset: Dataset, folder: Path) -> list[Path]:
    """The same tables through `GeoDataFrame.to_file`."""
    path = folder / "peer.gpkg"
    for name, table in dataset.tables.items():
        table.to_file(path, layer=name, driver="GPKG")
    return [path]


def measure(what: str) -> dict[str, float]:
    """Write one product in this process; run by :func:`main` in a process of its own."""
    warnings.simplefilter("ignore")
    dataset = large_plan()
    before = peak_mb()
    with tempfile.TemporaryDirectory() as folder:
        start, processor = time.perf_counter(), time.process_time()
        if what == "peer":
            files = write_peer(dataset, Path(folder))
        else:
            name, _, points = what.partition(":")
            options = {"points": points != "no points"} if name == "gpkg" else {}
            files = write_dataset(dataset, folder, [name], options=options)
        seconds = time.perf_counter() - start
        processor_s = time.process_time() - processor
        size = sum(file.stat().st_size for file in files)
    return {
        "seconds": seconds,
        "processor_s": processor_s,
        "bytes": size,
        "before_mb": before,
        "peak_mb": peak_mb(),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="one run each, no points")
    parser.add_argument("--measure", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.measure:
        print(json.dumps(measure(given.measure)))
        return
    mine = [name for name in FORMATS if not FORMATS[name].writer.startswith("geofield.formats.rdf")]
    names = ["gpkg:no points", "peer"]
    names += [] if given.quick else [name for name in mine if name != "gpkg"]
    names[2:2] = [] if given.quick else ["gpkg"]
    rows = [
        "| product | seconds (median, span) | processor s | MB written | MB before | peak MB |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    medians: dict[str, float] = {}
    for name in names:
        few = 5 if name in ("gpkg:no points", "peer") else 1
        runs = []
        for _ in range(1 if given.quick else few):
            out = subprocess.run(
                [sys.executable, __file__, "--measure", name],
                capture_output=True,
                text=True,
                check=False,
            )
            if out.returncode:
                print(f"{name}: {out.stderr.strip().splitlines()[-1]}", file=sys.stderr)
                continue
            runs.append(json.loads(out.stdout))
        if not runs:
            rows.append(f"| {name} | refused | | | | |")
            continue
        seconds = [run["seconds"] for run in runs]
        last = runs[-1]
        medians[name] = statistics.median(run["processor_s"] for run in runs)
        spread = f" ({min(seconds):.2f} to {max(seconds):.2f})" if len(seconds) > 1 else ""
        title = {"peer": "geopandas `to_file`, GeoPackage, no points"}.get(name, name)
        rows.append(
            f"| {title} | {statistics.median(seconds):.2f}{spread} "
            f"| {statistics.median(run['processor_s'] for run in runs):.2f} "
            f"| {last['bytes'] / 1e6:.1f} | {last['before_mb']:.0f} | {last['peak_mb']:.0f} |"
        )
        print(rows[-1], file=sys.stderr)
    notes = [
        *machine("geopandas", "pyogrio", "pyarrow"),
        "",
        "Plan: 1500 tracks, 38 000 segments, 36 500 gaps, 10 000 obstacles, 3.6 million points. "
        "One process per run; `MB before` is the memory of the plan before it is written.",
        "",
        *rows,
    ]
    if "gpkg:no points" in medians and "peer" in medians:
        ratio = medians["gpkg:no points"] / medians["peer"]
        notes += [
            "",
            f"GeoPackage without points, with styles, project, origin: {ratio:.2f} times the "
            "processor time of geopandas' `to_file` for the bare tables. Load of the machine at "
            f"the end: {os.getloadavg()[1]:.1f}.",
        ]
    write_page("formats", "Writing a very large plan", notes)


if __name__ == "__main__":
    main()
