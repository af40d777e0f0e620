"""Outlines on sites that nothing was learned from: the choice, points, certainty, other pictures.

    python benchmarks/field_unseen.py [--fields N] [--clicks N] [--others N] [--processes 1]

All fields drawn by eye, each judged by the network and the ranking that were learned without its
site (`tools/left_out`); what is shipped has learned from all of them. Further points are put in the
middle of the largest wrong piece. N limits how many fields each part looks at: as it is, an hour of
one core.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import shapely
import shapely.affinity

from common import DATA, machine, overlap, write_page
from field_rivals import felzenszwalb, random_walker
from geofield.errors import GeofieldError
from geofield.field import FieldSearch, extract_field, prepare_field
from geofield.imagery import read_scene
from geofield.simulate import SimulationSettings, simulate_field

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tools"))
from outline_cases import FOLDS, Case, labelled, learned_without, left_out, middle_of_error, other

#: Overlaps that count: a good outline, one that clicks aim at, one to be warned of.
GOOD, AIM, BAD = 0.88, 0.93, 0.8
MOST_CLICKS = 10
#: After how many points overlaps are told; what a point should not cost.
TOLD_POINTS, LOST = (1, 2, 3, 5, MOST_CLICKS), 0.05
#: Turned by so many degrees, enlarged by so much.
RESAMPLED = {
    "3 m": (0.0, 0.2),
    "1.2 m": (0.0, 0.5),
    "0.3 m": (0.0, 2.0),
    "0.1 m": (0.0, 6.0),
    "warped": (1.3, 1.24),
}
#: In the middle of so many chips of other places along a side.
AMONG = {"among 3 x 3 chips": 3, "among 5 x 5 chips": 5}
KINDS = (
    "JPEG 30",
    "JPEG 60",
    "JPEG 85",
    "haze",
    "contrast",
    "16 bit",
    "moved 10 m",
    *RESAMPLED,
    *AMONG,
)
Point = tuple[float, float]
Way = Callable[[Case, list[Point], list[Point]], shapely.Polygon]


@dataclass
class Result:
    """Of one outline: overlap, whether it was warned of, its certainty, processor seconds.

    Of a field that two outlines were drawn of, `nearer` is the overlap with the one more like it.
    `offered` are the overlaps of all outlines that are offered, the one taken among them.
    """

    mark: str
    drawn: str
    overlap: float
    nearer: float | None
    warned: bool
    certainty: float
    seconds: float
    offered: tuple[float, ...] = ()


def found(case: Case) -> Result:
    """The outline of a case."""
    search = searched(case)
    start = time.process_time()
    try:
        lon, lat = case.scene.grid.to_lonlat(case.x_px, case.y_px)
        field = extract_field(case.scene, lat=lat, lon=lon, search=search)
    except GeofieldError:
        seconds = time.process_time() - start
        nothing = None if case.doubtful is None else 0.0
        return Result(case.mark, case.drawn, 0.0, nothing, True, 0.0, seconds)
    seconds = time.process_time() - start
    quality = field.quality
    assert quality is not None
    figures = dict(quality.figures)
    outline = field.polygon_px(case.scene.grid)
    shared = overlap(outline, case.truth)
    nearer = None if case.doubtful is None else max(shared, overlap(outline, case.doubtful))
    certain = figures.get("certainty", 0.0)
    others = [
        replace(field, polygon=one.polygon).polygon_px(case.scene.grid)
        for one in field.alternatives[1:]
    ]
    offered = tuple(overlap(one, case.truth) for one in (outline, *others))
    return Result(
        case.mark, case.drawn, shared, nearer, not quality.trusted, certain, seconds, offered
    )


def searched(case: Case) -> FieldSearch:
    """As `prepare_field`, by what was learned without the site."""
    lonlat = case.scene.grid.to_lonlat(case.x_px, case.y_px)
    return FieldSearch(lonlat, learned_without(case.site))


def of_kind(case: Case, kind: str) -> Result:
    """The outline of a case as another picture."""
    return found(another(case, kind))


def another(case: Case, kind: str) -> Case:
    if kind == "4 bands":
        return case
    if kind == "16 bit":
        # Read through the percentile stretch that 16 bits get: levels shift and clip.
        bands = case.scene.bands.astype(float)
        low, high = np.quantile(bands, [0.01, 0.99])
        spread = np.clip((bands - low) / (high - low) * 255, 0, 255)
        return replace(case, scene=replace(case.scene, bands=np.rint(spread).astype(np.uint8)))
    if kind in RESAMPLED:
        return resampled(case, *RESAMPLED[kind])
    if kind in AMONG:
        return among(case, AMONG[kind])
    if kind == "moved 10 m":
        step = 10.0 / case.scene.grid.ground_resolution_m
        ways = [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)]
        inner = case.truth.buffer(-2)
        for dx, dy in ways:
            if shapely.contains_xy(inner, case.x_px + dx, case.y_px + dy):
                return replace(case, x_px=case.x_px + dx, y_px=case.y_px + dy)
        return case
    return other(case, kind)


def resampled(case: Case, turn_deg: float, scale: float) -> Case:
    """The case in other pixels: of another size, or of another map projection."""
    rows, columns = case.scene.grid.shape
    height, width = round(rows * scale), round(columns * scale)
    onto = cv2.getRotationMatrix2D((0.0, 0.0), turn_deg, scale)
    onto[:, 2] = np.array([width, height]) / 2 - onto[:, :2] @ [columns / 2, rows / 2]
    # OpenCV counts from pixel centres.
    middle = onto[:, 2] + onto[:, :2] @ np.array([0.5, 0.5]) - 0.5
    centred = np.column_stack([onto[:, :2], middle])
    soft = [cv2.GaussianBlur(one, (0, 0), 0.6) if scale < 1 else one for one in case.scene.bands]
    warped = [
        cv2.warpAffine(one, centred, (width, height), borderMode=cv2.BORDER_REPLICATE)
        for one in soft
    ]
    onto_new = [*onto[:, :2].ravel(), *onto[:, 2]]
    truth: Any = shapely.affinity.affine_transform(case.truth, onto_new)
    truth = truth.intersection(shapely.box(0, 0, width, height))
    x, y = onto @ [case.x_px, case.y_px, 1.0]
    grid = case.scene.grid.resized(width, height)
    valid = np.ones((height, width), bool)
    scene = replace(case.scene, grid=grid, bands=np.stack(warped), valid=valid)
    return replace(case, scene=scene, truth=truth, x_px=float(x), y_px=float(y))


def among(case: Case, number: int) -> Case:
    """The case in a wide picture: its chip in the middle of chips of other places."""
    rows, columns = case.scene.grid.shape
    bands = np.tile(case.scene.bands, (1, number, number))
    rng = np.random.default_rng(zlib.crc32(case.name.encode()))
    chips = sorted((DATA / "trees_train").glob("*.tif"))
    middle = number // 2
    for row, column in np.ndindex(number, number):
        if (row, column) != (middle, middle):
            other_chip = read_scene(chips[int(rng.integers(len(chips)))])
            shown = [other_chip.bands[other_chip.roles.index(role)] for role in case.scene.roles]
            fitted = [cv2.resize(band, (columns, rows)) for band in shown]
            top, left = row * rows, column * columns
            bands[:, top : top + rows, left : left + columns] = fitted
    left, top = middle * columns, middle * rows
    grid = case.scene.grid.crop(-left, -top, number * columns, number * rows)
    scene = replace(case.scene, grid=grid, bands=bands, valid=np.ones(grid.shape, bool))
    truth = shapely.affinity.translate(case.truth, left, top)
    return replace(case, scene=scene, truth=truth, x_px=case.x_px + left, y_px=case.y_px + top)


def clicked(case: Case, way: str, most: int = MOST_CLICKS) -> list[float]:
    """Overlaps after the first point, the second, ... until the aim is reached."""
    overlaps: list[float] = []
    for outline in corrected(case, way, most):
        overlaps.append(overlap(outline, case.truth) if outline.area else 0.0)
        if overlaps[-1] >= AIM and len(overlaps) > 2:
            break
    return overlaps


def corrected(case: Case, way: str, most: int = MOST_CLICKS) -> Iterator[shapely.Polygon]:
    """The outlines after the first point, the second, ...: each where most is wrong."""
    include: list[Point] = [(case.x_px, case.y_px)]
    exclude: list[Point] = []
    run = WAYS[way](case)
    for _ in range(most):
        outline = run(include, exclude)
        yield outline
        wrong = middle_of_error(outline, case.truth, case.scene.grid.shape)
        if wrong is None:
            return
        (include if wrong[0] else exclude).append(wrong[1])


def ours(case: Case) -> Callable[[list[Point], list[Point]], shapely.Polygon]:
    grid = case.scene.grid
    search = searched(case)
    lon, lat = grid.to_lonlat(case.x_px, case.y_px)

    def run(include: list[Point], exclude: list[Point]) -> shapely.Polygon:
        places = ([grid.to_lonlat(*one) for one in points] for points in (include[1:], exclude))
        belong, apart = places
        field = extract_field(
            case.scene, lat=lat, lon=lon, include=belong, exclude=apart, search=search
        )
        return field.polygon_px(grid)

    return run


WAYS = {"geofield": ours, "random walker": random_walker, "felzenszwalb": felzenszwalb}


def row(name: str, results: Sequence[Result]) -> str:
    values = np.array([one.overlap for one in results])
    worst = np.sort(values)[: max(1, round(len(values) / 10))].mean()
    seconds = np.median([one.seconds for one in results])
    return (
        f"| {name} | {len(values)} | {values.mean():.3f} | {np.median(values):.3f} | "
        f"{np.mean(values >= GOOD):.0%} | {worst:.2f} | {seconds:.2f} |"
    )


def certainty(results: Sequence[Result]) -> list[str]:
    """How far certainty is to be trusted."""
    right = np.array([one.overlap >= 0.85 for one in results])
    told = np.array([one.certainty for one in results])
    bins = np.clip((told * 5).astype(int), 0, 4)
    lines = ["| certainty | outlines | told | right (.85) |", "|---|---|---|---|"]
    error = 0.0
    for number in range(5):
        at = bins == number
        if at.any():
            error += at.mean() * abs(told[at].mean() - right[at].mean())
            lines.append(
                f"| {number / 5:.1f} to {number / 5 + 0.2:.1f} | {at.sum()} | "
                f"{told[at].mean():.2f} | {right[at].mean():.2f} |"
            )
    bad = [one for one in results if one.overlap < BAD]
    good = [one for one in results if one.overlap >= GOOD]
    caught, false = (sum(one.warned for one in some) for some in (bad, good))
    return [
        *lines,
        "",
        f"Expected calibration error {error:.3f}. Warned of: {caught} of {len(bad)} outlines below "
        f"{BAD}, {false} of {len(good)} from {GOOD} on.",
        "",
    ]


def speed() -> list[str]:
    """Of simulated pictures; the least of several runs."""
    lines = ["| picture | first point | further point |", "|---|---|---|"]
    for side in (256, 640, 4000):
        one = simulate_field(11, SimulationSettings(width_px=side, height_px=side))
        first, further = [], []
        for _ in range(5 if side < 1000 else 2):
            start = time.process_time()
            search = prepare_field(one.scene, lat=one.lat, lon=one.lon)
            extract_field(one.scene, lat=one.lat, lon=one.lon, search=search)
            first.append(time.process_time() - start)
            start = time.process_time()
            beside = [(one.lon + 1e-5, one.lat)]
            extract_field(one.scene, lat=one.lat, lon=one.lon, search=search, include=beside)
            further.append(time.process_time() - start)
        lines.append(f"| {side} x {side} px | {min(first):.2f} | {min(further):.2f} |")
        print(lines[-1], flush=True)
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--fields", type=int, default=10_000)
    parser.add_argument("--clicks", type=int, default=120)
    parser.add_argument("--rivals", type=int, default=24, help="fields of other ways (slow)")
    parser.add_argument("--others", type=int, default=120)
    parser.add_argument("--processes", type=int, default=1)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    for fold in range(FOLDS):
        left_out(fold)  # one that is missing is told before the long work
    every = list(labelled())
    # Spread over the tables, whatever the number.
    order = np.random.default_rng(0).permutation(len(every))
    every = [every[at] for at in order]
    some = every[: options.fields]
    lines = [
        f"{len(some)} fields of {len({one.site for one in some})} sites, drawn by eye. Each is "
        "judged by a network and a ranking that were learned from no outline of its site: of both "
        f"there are {FOLDS}, each without one fold of the sites. (The networks behind which such "
        "a ranking was learned, those of the other folds, have seen it.) What is shipped was "
        "learned in the same way, but from all of these fields, so it cannot be judged on them. "
        "How the search works was chosen looking at some of them, too: other sites may be lower. "
        "Overlap is intersection over union; seconds are processor seconds. Table `further` has "
        "much that is small and in towns. Where nobody could say which of two outlines is meant, "
        "both were drawn; the first one counts, but in the row of the nearer.",
        "",
        "| pictures | fields | mean | median | from .88 on | worst tenth | seconds |",
        "|---" * 7 + "|",
    ]
    with Pool(options.processes) as pool:
        results: dict[str, list[Result]] = {}
        for kind in ("4 bands", "colour", "grey"):
            results[kind] = pool.map(partial(of_kind, kind=kind), some, chunksize=2)
            lines.append(row(kind, results[kind]))
            print(lines[-1], flush=True)
        for mark in dict.fromkeys(one.mark for one in some):
            part = [one for one in results["4 bands"] if one.mark == mark]
            lines.append(row(f"of these, table `{mark}`", part))
        for drawn in ("plain", "fair", "doubtful"):
            part = [one for one in results["4 bands"] if one.drawn == drawn]
            lines.append(row(f"of these, drawn as {drawn}", part))
        two = [one for one in results["4 bands"] if one.nearer is not None]
        lines.append(row("of these, drawn two ways: the first", two))
        nearer = [replace(one, overlap=one.nearer or 0.0) for one in two]
        lines.append(row("of these, drawn two ways: the nearer", nearer))
        best = [replace(one, overlap=max(one.offered, default=0.0)) for one in results["4 bands"]]
        several = [one for one in best if len(one.offered) > 1]
        lines.append(row("the nearest of those offered", best))
        lines.append(row("of these, several are offered", several))
        below = [
            one for one, own in zip(best, results["4 bands"], strict=True) if own.overlap < BAD
        ]
        lines.append(row("of these, the one taken is below .8", below))
        lines += ["", "## Certainty", "", *certainty(results["4 bands"])]
        lines += ["## Further points", ""]
        heads = [f"{number} point{'s' * (number > 1)}" for number in TOLD_POINTS]
        lines.append(f"| way | fields | {' | '.join(heads)} | until {AIM} | lost .05 |")
        lines.append("|---" * (4 + len(heads)) + "|")
        for way in WAYS:
            count = options.clicks if way == "geofield" else options.rivals
            overlaps = pool.map(partial(clicked, way=way), every[:count], chunksize=1)
            at = [np.mean([one[min(k, len(one)) - 1] for one in overlaps]) for k in TOLD_POINTS]
            steps = np.concatenate([np.diff(one) for one in overlaps])
            clicks = [
                next((n for n, value in enumerate(one, 1) if value >= AIM), MOST_CLICKS)
                for one in overlaps
            ]
            lines.append(
                f"| {way} | {len(overlaps)} | {' | '.join(f'{one:.3f}' for one in at)} | "
                f"{np.mean(clicks):.1f} | {np.mean(steps < -LOST):.0%} of points |"
            )
            print(lines[-1], flush=True)
        lines += ["", "## Other pictures of the same fields", ""]
        lines += [
            "| picture | mean | mean change | worse by .1 |",
            "|---|---|---|---|",
        ]
        few = every[: options.others]
        plain = np.array([one.overlap for one in pool.map(found, few, chunksize=2)])
        for kind in KINDS:
            other_results = pool.map(partial(of_kind, kind=kind), few, chunksize=2)
            got = np.array([one.overlap for one in other_results])
            lines.append(
                f"| {kind} | {got.mean():.3f} | {got.mean() - plain.mean():+.3f} | "
                f"{np.sum(got < plain - 0.1)} of {len(got)} |"
            )
            print(lines[-1], flush=True)
    lines += ["", "## Processor seconds of one outline", "", *speed()]
    write_page(
        "field_unseen", "Outlines on unseen sites", [*machine("opencv-python-headless"), "", *lines]
    )


if __name__ == "__main__":
    main()
