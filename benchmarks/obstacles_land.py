"""Obstacle detection judged by what a driver loses, and on any picture, in one run.

    python benchmarks/obstacles_land.py [--part sites|areas|pictures|all] [--every 1]

Prints Markdown tables: the sites left out of the training data, the areas of open land that nothing
was chosen on, tracks planned around what was found there, and the same areas as other cameras and
files show them. A whole run writes ``benchmarks/results/obstacles_land.md``; ``--every 3`` takes
every third picture.
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from scipy import ndimage

import geofield as gf
from common import DATA, machine, write_page
from geofield.errors import ObstacleWarning, TrackWarning
from geofield.evaluation import Driving, driving, match_points, reliability
from geofield.imagery import read_scene
from geofield.learned import network
from geofield.model.scene import GREY_WEIGHTS, Scene

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tools"))
from lossy import through_jpeg

KINDS = {"4 bands": "nir", "colour": "rgb", "grey": "grey"}
SPACING_M = 3.0
OPEN_PX, OPEN_TREES = 96, 5
"""Open land: at most five labelled trees in the 58 m around."""
EVEN, CALM = 0.3, 7.0
"""Even land: three tenths of the ground around has no edges (grey levels within 5 m)."""


GROUND = {
    "claremont_75": "grass",
    "riverside_89": "grass",
    "riverside_88": "grass",
    "long_beach_33": "grass",
    "claremont_45": "scrub",
    "claremont_11": "scrub",
    "palm_springs_65": "sand",
    "chico_77": "car park",
    "riverside_2": "car park",
}
"""Of the areas, by eye; none is tilled."""
FALSE_PER_HA = 2.0
CUT_EVERY_PX, CUT_PX = 64, 2.0


@dataclass(frozen=True)
class Case:
    """A picture, its labelled trees (pixels from the corner) and the area that is judged."""

    scene: Scene
    trees: np.ndarray
    area: shapely.Polygon
    ground: str = ""


def areas(every: int) -> Iterator[Case]:
    labels = pd.read_csv(DATA / "trees/trees.csv")
    for row in list(pd.read_csv(DATA / "trees/areas.csv").itertuples())[::every]:
        scene = read_scene(DATA / "trees" / f"{row.image}.tif")
        xy = labels.loc[labels.image == row.image, ["x_px", "y_px"]].to_numpy(float) + 0.5
        yield Case(scene, xy, shapely.Polygon(json.loads(str(row.area_px))), GROUND[str(row.site)])


def sites_left_out(every: int) -> Iterator[Case]:
    folder = DATA / "trees_train"
    labels = pd.read_csv(folder / "trees.csv")
    judges = set(network("crowns").facts["left_out_sites"])
    paths = [p for p in sorted(folder.glob("*.tif")) if site_of(p) in judges]
    for path in paths[::every]:
        xy = labels.loc[labels.image == path.stem, ["x_px", "y_px"]].to_numpy(float) + 0.5
        scene = read_scene(path)
        yield Case(scene, xy, shapely.box(0, 0, scene.grid.width_px, scene.grid.height_px))


def site_of(path: Path) -> str:
    *city, _, number = path.stem.split("_")
    return "_".join([*city, number])


def with_bands(case: Case, kind: str) -> Case:
    """Return the case with four bands, three, or their brightness."""
    scene = case.scene
    if kind == "nir":
        return case
    pixels, roles = scene.bands[:3], scene.roles[:3]
    if kind == "grey":
        grey = np.tensordot(GREY_WEIGHTS, pixels.astype(float), 1)
        pixels, roles = np.clip(np.rint(grey), 0, 255).astype(np.uint8)[None], ("grey",)
    return replace(case, scene=replace(scene, bands=np.ascontiguousarray(pixels), roles=roles))


def found_in(case: Case, **options: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centres, confidences and statuses of the trees found in a case's area."""
    table = gf.detect_obstacles(case.scene, **options)
    table = table[table["kind"] == "tree"]
    xy = table[["x_px", "y_px"]].to_numpy(float)
    keep = shapely.contains_xy(case.area, *xy.T)
    confidence = table["confidence"].to_numpy(float)
    return xy[keep], confidence[keep], table["status"].to_numpy(str)[keep]


def trees_of(case: Case) -> np.ndarray:
    return case.trees[shapely.contains_xy(case.area, *case.trees.T)]


def best_f1(cases: list[Case]) -> tuple[float, float]:
    """F1 at 6 and 10 px at the confidence that the sites left out have the best F1 at."""
    hits, counted = np.zeros(2), 0
    for case in cases:
        xy = found_in(case, min_confidence=BALANCED)[0]
        true = trees_of(case)
        counted += len(xy) + len(true)
        hits += [len(match_points(xy, true, reach).truth_index) for reach in (6, 10)]
    six, ten = 2 * hits / counted
    return float(six), float(ten)


BALANCED = 0.25
"""Confidence at which misses and false alarms weigh alike."""


def accuracy_rows(cases: list[Case]) -> list[str]:
    rows = ["| bands | F1 at 6 px | F1 at 10 px |", "| --- | --- | --- |"]
    for name, kind in KINDS.items():
        six, ten = best_f1([with_bands(case, kind) for case in cases])
        rows.append(f"| {name} | {six:.3f} | {ten:.3f} |")
        print(rows[-1], flush=True)
    return rows


def is_open(case: Case, xy: np.ndarray) -> np.ndarray:
    """Return which places have few labelled trees and enough even ground around them."""
    count = np.zeros(case.scene.grid.shape)
    at = np.clip(case.trees.astype(int), 0, np.array(count.shape[::-1]) - 1)
    np.add.at(count, (at[:, 1], at[:, 0]), 1)
    around = ndimage.uniform_filter(count, OPEN_PX, mode="constant") * OPEN_PX**2
    grey = case.scene.bands[:3].mean(axis=0).astype(np.float32)
    mean = ndimage.uniform_filter(grey, 9)
    spread = np.sqrt(np.maximum(ndimage.uniform_filter(grey * grey, 9) - mean * mean, 0))
    even = ndimage.uniform_filter((spread < CALM).astype(np.float32), OPEN_PX, mode="nearest")
    col, row = np.clip(xy.astype(int), 0, np.array(count.shape[::-1]) - 1).T
    return (np.rint(around[row, col]) <= OPEN_TREES) & (even[row, col] >= EVEN)


def calibration_rows(cases: list[Case]) -> list[str]:
    rows = ["| bands | calibration error | trees and false alarms |", "| --- | --- | --- |"]
    for name, kind in KINDS.items():
        p, good = [], []
        for case in cases:
            xy, confidence, _ = found_in(with_bands(case, kind), min_confidence=0.05)
            match = match_points(xy, case.trees, 10)
            land = is_open(case, xy)
            p.append(confidence[land])
            good.append(np.isin(np.arange(len(xy)), match.detected_index)[land])
        error = reliability(np.concatenate(p), np.concatenate(good))[3]
        rows.append(f"| {name} | {error:.3f} | {sum(map(len, p))} |")
        print(rows[-1], flush=True)
    return rows


def field_of(polygon_px: shapely.Polygon, scene: Scene) -> gf.Field:
    grid = scene.grid
    return gf.Field(shapely.transform(polygon_px, grid.to_metric_array), grid.metric_crs)


def driven(case: Case, **options: Any) -> tuple[Driving, int, int]:
    """What a driver loses in a case's area; trees seen at all, and false alarms."""
    grid = case.scene.grid
    field = field_of(case.area, case.scene)
    polygon = field.polygon
    found = gf.detect_obstacles(case.scene, field, **options)
    tracks = gf.plan_tracks(polygon, found, crs=grid.metric_crs, spacing_m=SPACING_M)
    true = trees_of(case)
    points = shapely.points(grid.to_metric_array(case.trees))
    truth = gpd.GeoDataFrame(geometry=points, crs=grid.metric_crs)
    lost = driving(tracks.segments, found, truth, polygon)
    xy = found.loc[found["kind"] == "tree", ["x_px", "y_px"]].to_numpy(float)
    xy = xy[shapely.contains_xy(case.area, *xy.T)]
    match = match_points(xy, true, 10)
    return lost, len(match.truth_index), len(xy) - len(match.truth_index)


def same(case: Case) -> Case:
    return case


def driving_rows(cases: list[Case]) -> list[str]:
    rows = [
        "| bands, options | trees driven through | metres | ground lost | recall with possible "
        "| false per ha with possible | expected unseen per ha |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    options: dict[str, tuple[str, dict[str, object], Callable[[Case], Case]]] = {
        "4 bands": ("nir", {}, same),
        "4 bands, careful": ("nir", {"careful": True}, same),
        "4 bands, cost 10": ("nir", {"cost_missed": 10}, same),
        "4 bands, cost 100": ("nir", {"cost_missed": 100}, same),
        "colour": ("rgb", {}, same),
        "colour, JPEG 85": ("rgb", {}, pixels(jpeg(85))),
        "colour, JPEG 60": ("rgb", {}, pixels(jpeg(60))),
        "grey": ("grey", {}, same),
    }
    for told, (kind, option, change) in options.items():
        total, seen, false = Driving(), 0, 0
        for case in cases:
            lost, hits, wrong = driven(change(with_bands(case, kind)), **option)
            total, seen, false = total + lost, seen + hits, false + wrong
        rows.append(
            f"| {told} | {total.driven_through} of {total.things} "
            f"({total.share_driven_through:.0%}) | {total.driven_through_m:.0f} of "
            f"{total.driven_m:.0f} | {total.share_lost:.1%} | {seen / total.things:.2f} | "
            f"{false / total.field_m2 * 1e4:.1f} | {total.expected_unseen_per_ha:.2f} |"
        )
        print(rows[-1], flush=True)
    return rows


def ground_rows(cases: list[Case]) -> list[str]:
    """Trees seen at all, by ground, and the most of them at so many false alarms per ha."""
    rows = [
        "| bands, ground | trees | ha | recall with possible | false per ha with possible "
        f"| recall at {FALSE_PER_HA:g} false per ha |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, kind in KINDS.items():
        for ground in dict.fromkeys(case.ground for case in cases):
            there = [case for case in cases if case.ground == ground]
            pixel_m = np.array([case.scene.grid.ground_resolution_m for case in there])
            hectares = float(pixel_m**2 @ [case.area.area for case in there]) / 1e4
            count = sum(len(trees_of(case)) for case in there)
            p, hit = [], []
            for case in there:
                xy, confidence, _ = found_in(with_bands(case, kind))
                match = match_points(xy, trees_of(case), 10)
                p.append(confidence)
                hit.append(np.isin(np.arange(len(xy)), match.detected_index))
            order = np.argsort(-np.concatenate(p), kind="stable")
            hits = np.cumsum(np.concatenate(hit)[order])
            false = np.arange(1, len(hits) + 1) - hits
            few = hits[false <= FALSE_PER_HA * hectares]
            seen, wrong = (int(v[-1]) if len(v) else 0 for v in (hits, false))
            rows.append(
                f"| {name}, {ground} | {count} | {hectares:.1f} | {seen / count:.2f} | "
                f"{wrong / hectares:.1f} | {few.max(initial=0) / count:.2f} |"
            )
            print(rows[-1], flush=True)
    return rows


def cut_rows(cases: list[Case]) -> list[str]:
    """Trees at the end of a picture that is cut where labels go on, and what is found there."""
    rows = [
        "| bands | trees within 1.2 m of the cut | detected | found there | of them right |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, kind in KINDS.items():
        trees = seen = found = right = 0
        for case in cases:
            scene = with_bands(case, kind).scene
            for end in range(CUT_EVERY_PX, scene.grid.width_px, CUT_EVERY_PX):
                part = scene.crop(0, 0, end, scene.grid.height_px)
                frame = shapely.box(0, 0, end, scene.grid.height_px)
                table = gf.detect_obstacles(part, field_of(frame, part))
                table = table[(table["kind"] == "tree") & (table["status"] == "detected")]
                xy = table[["x_px", "y_px"]].to_numpy(float)
                match = match_points(xy, case.trees, 10)
                there = np.abs(case.trees[:, 0] - end) <= CUT_PX
                trees += int(there.sum())
                seen += int(there[match.truth_index].sum())
                there = xy[:, 0] > end - CUT_PX
                found += int(there.sum())
                right += int(there[match.detected_index].sum())
        rows.append(f"| {name} | {trees} | {seen / trees:.0%} | {found} | {right / found:.0%} |")
        print(rows[-1], flush=True)
    return rows


def pixels(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Case], Case]:
    """A change of the bands (bands, rows, cols) as floats."""

    def changed(case: Case) -> Case:
        values = np.clip(np.rint(change(case.scene.bands.astype(float))), 0, 255)
        return replace(case, scene=replace(case.scene, bands=values.astype(np.uint8)))

    return changed


def jpeg(quality: int) -> Callable[[np.ndarray], np.ndarray]:
    """Bands as JPEG leaves them."""

    def stored(bands: np.ndarray) -> np.ndarray:
        eight = bands.astype(np.uint8).transpose(1, 2, 0)
        return through_jpeg(eight, quality).transpose(2, 0, 1).astype(float)

    return stored


def turned(case: Case) -> Case:
    """The picture turned by a quarter: shadows fall elsewhere."""
    size = case.scene.grid.width_px
    bands = np.ascontiguousarray(np.rot90(case.scene.bands, 1, (1, 2)))

    def turn(c: np.ndarray) -> np.ndarray:
        return np.column_stack([c[:, 1], size - c[:, 0]])

    scene = replace(case.scene, bands=bands)
    return Case(scene, turn(case.trees), shapely.transform(case.area, turn))


def resampled(metres: float) -> Callable[[Case], Case]:
    """The ground in other pixels; figures stay those of 6 and 10 of the chip's pixels."""

    def changed(case: Case) -> Case:
        grid = case.scene.grid
        size = tuple(round(n * grid.ground_resolution_m / metres) for n in grid.shape)
        how = cv2.INTER_CUBIC if size[0] > grid.height_px else cv2.INTER_AREA
        bands = np.stack([cv2.resize(b, size[::-1], interpolation=how) for b in case.scene.bands])
        scene = replace(
            case.scene,
            grid=grid.resized(size[1], size[0]),
            bands=bands,
            valid=np.ones(size, bool),
        )
        return replace(case, scene=scene)

    return changed


def scored(cases: list[Case], change: Callable[[Case], Case]) -> float:
    """F1 at 10 px of the chips' own pixels after a change of the pictures."""
    hits = counted = 0.0
    for case in cases:
        other = change(case)
        scale = other.scene.grid.width_px / case.scene.grid.width_px
        wide = replace(other, area=shapely.transform(other.area, partial(np.multiply, scale)))
        xy, _, _ = found_in(wide, min_confidence=BALANCED)
        true = other.trees[shapely.contains_xy(other.area, *other.trees.T)]
        counted += len(xy) + len(true)
        hits += len(match_points(xy / scale, true, 10).truth_index)
    return 2 * hits / counted


def sixteen(bands: np.ndarray) -> np.ndarray:
    """What a reader makes of 16 bits: the share of the values in use, stretched."""
    raw = bands * 37.0 + 900
    low, high = np.percentile(raw, [0.5, 99.5])
    return (raw - low) / (high - low) * 255


DISTURBANCES: dict[str, Callable[[Case], Case]] = {
    "as it is": same,
    "contrast x 0.5": pixels(lambda b: 0.5 * b + 64),
    "haze 40 %": pixels(lambda b: 0.6 * b + 0.4 * 200),
    "brightness x 0.6": pixels(lambda b: 0.6 * b),
    "brightness x 1.4": pixels(lambda b: 1.4 * b),
    "JPEG 90": pixels(jpeg(90)),
    "JPEG 60": pixels(jpeg(60)),
    "JPEG 30": pixels(jpeg(30)),
    "blur 1 px": pixels(lambda b: ndimage.gaussian_filter(b, (0, 1, 1))),
    "red cast": pixels(lambda b: b * np.array([1.2, 1, 0.85, 1])[: len(b), None, None]),
    "16 bit": pixels(sixteen),
    "turned": turned,
    "0.3 m": resampled(0.3),
    "1 m": resampled(1.0),
    "2 m": resampled(2.0),
}


def disturbance_rows(cases: list[Case]) -> list[str]:
    rows = ["| picture | 4 bands | colour | grey |", "| --- | --- | --- | --- |"]
    for name, change in DISTURBANCES.items():
        cells = [
            f"{scored([with_bands(case, kind) for case in cases], change):.3f}"
            for kind in KINDS.values()
        ]
        rows.append(f"| {name} | {' | '.join(cells)} |")
        print(rows[-1], flush=True)
    equal = scored([with_bands(case, "grey") for case in cases], three_equal)
    rows.append(f"| grey as three equal bands | | | {equal:.3f} |")
    return rows


def three_equal(case: Case) -> Case:
    bands = np.repeat(case.scene.bands, 3, axis=0)
    return replace(case, scene=replace(case.scene, bands=bands, roles=("red", "green", "blue")))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", choices=("sites", "areas", "pictures", "all"), default="all")
    parser.add_argument("--every", type=int, default=1)
    given = parser.parse_args()
    warnings.simplefilter("ignore", ObstacleWarning)
    warnings.simplefilter("ignore", TrackWarning)
    lines = machine("opencv-python-headless")
    if given.part in ("sites", "all"):
        cases = list(sites_left_out(given.every))
        lines += ["", f"## Sites left out of the training data ({len(cases)} chips)", ""]
        lines += accuracy_rows(cases)
        lines += [
            "",
            "On open, even land there (at most five labelled trees in the 58 m around, and three",
        ]
        lines += [
            "tenths of that ground without edges); the shipped curves were fitted on these sites,",
            "and curves that had not seen the sites they judge err by what `crowns.json` says:",
            "",
        ]
        lines += calibration_rows(cases)
    cases = list(areas(given.every))
    if given.part in ("areas", "all"):
        lines += ["", f"## Areas of open land ({len(cases)} chips, 9 sites; for scoring only)", ""]
        lines += accuracy_rows(cases)
        lines += ["", f"Tracks {SPACING_M:g} m apart, planned in the areas around what was found;"]
        lines += ["a tree counts as driven through when a track comes within 2 m of its label.", ""]
        lines += driving_rows(cases)
        lines += ["", "By ground:", "", *ground_rows(cases)]
        lines += ["", "Pictures cut at every 38 m, a field up to the cut; labels go on beyond it:"]
        lines += ["", *cut_rows(cases)]
    if given.part in ("pictures", "all"):
        lines += ["", "## The same areas as other cameras and files show them: F1 at 10 px", ""]
        lines += disturbance_rows(cases)
    title = "Obstacle detection: open land, drivers, any picture"
    if (given.part, given.every) == ("all", 1):
        write_page("obstacles_land", title, lines)
    else:
        print("\n".join([f"# {title}", "", *lines]))


if __name__ == "__main__":
    main()
