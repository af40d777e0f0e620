"""How far a second eye agrees with the labels, and where geofield lies between them.

    python benchmarks/second_eye.py [--clicks 120]

Some of the fields that were drawn by eye were drawn a second time (`field_labels_again.csv`),
and trees in windows of the sites left out marked a second time (`tree_labels_again.csv`), by one
who saw the picture and the point alone: no label, and nothing that software found. No way of
finding things can be told to agree with labels better than a second eye does. As in
`field_unseen.py` each outline is found by what was learned without its site.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import shapely

from common import DATA, machine, write_page
from field_unseen import AIM, GOOD, MOST_CLICKS, another, corrected, ours
from geofield.evaluation import match_points
from geofield.imagery import read_scene
from obstacles_land import BALANCED, KINDS, found_in, with_bands
from obstacles_land import Case as Trees

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tools"))
from outline_cases import Case, labelled, polygon

HERE = Path(__file__).resolve().parent
WINDOW_PX = 128
REACH_PX = (6.0, 10.0)
#: Ground so near to the border that was drawn first is not judged; a pixel is 0.6 m.
BESIDE_PX = (0.0, 1.0, 2.0)
TOLD_POINTS = (1, 2, 3, 5, MOST_CLICKS)


@dataclass
class Twice:
    """A field, the second drawing of it, and that drawing's other outline where one was drawn."""

    case: Case
    second: shapely.Polygon
    other: shapely.Polygon | None


def drawn_twice() -> Iterator[Twice]:
    """The fields that two drawings were made of."""
    table = rows_of("field_labels_again.csv")
    rows = {key(row["image"], row["seed_x_px"], row["seed_y_px"]): row for row in table}
    for case in labelled():
        row = rows.get(key(case.name.split()[1], case.x_px, case.y_px))
        if row:
            other = row["polygon_alt_px"]
            yield Twice(case, polygon(row["polygon_px"]), polygon(other) if other else None)


def rows_of(name: str) -> list[dict[str, str]]:
    """The rows of a table beside this file."""
    with (HERE / name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def key(image: str, x_px: float | str, y_px: float | str) -> tuple[str, float, float]:
    return image, float(x_px), float(y_px)


def shared(one: shapely.Polygon, truth: shapely.Polygon, beside_px: float = 0.0) -> float:
    """Intersection over union of what lies further than so much from the true border."""
    if one.is_empty:
        return 0.0
    unjudged = truth.boundary.buffer(beside_px) if beside_px else shapely.Polygon()
    a, b = (shapely.make_valid(part).difference(unjudged) for part in (one, truth))
    either = a.union(b).area
    return float(a.intersection(b).area / either) if either else 1.0


def found(case: Case, kind: str) -> shapely.Polygon:
    """The outline of a case, by what was learned without its site."""
    shown = another(case, kind)
    return ours(shown)([(case.x_px, case.y_px)], [])


def row(name: str, values: list[float]) -> str:
    some = np.sort(values)
    worst = some[: max(1, round(len(some) / 10))].mean()
    return (
        f"| {name} | {some.mean():.3f} | {np.median(some):.3f} | {np.mean(some >= GOOD):.0%} | "
        f"{np.mean(some >= AIM):.0%} | {worst:.2f} |"
    )


def agreement(twice: list[Twice]) -> list[str]:
    """Lines on how far two drawings agree, and geofield's outlines with each."""
    lines = [
        f"| overlap of {len(twice)} fields | mean | median | from {GOOD} on | from {AIM} on | "
        "worst tenth |",
        "|---" * 6 + "|",
    ]
    for beside in BESIDE_PX:
        told = f", ground within {beside:.0f} px of the first's border aside" if beside else ""
        both = [shared(one.second, one.case.truth, beside) for one in twice]
        lines.append(row(f"second drawing with the first{told}", both))
        if not beside:
            lines.append(row("the nearer, where several were drawn", nearer(twice)))
    for kind in ("4 bands", "colour", "grey"):
        got = [found(one.case, kind) for one in twice]
        pairs = list(zip(got, twice, strict=True))
        for beside in BESIDE_PX if kind == "4 bands" else BESIDE_PX[:1]:
            told = f", within {beside:.0f} px aside" if beside else ""
            with_first = [shared(mine, one.case.truth, beside) for mine, one in pairs]
            lines.append(row(f"geofield, {kind}, with the first{told}", with_first))
        lines.append(
            row(f"geofield, {kind}, with the second", [shared(m, one.second) for m, one in pairs])
        )
    return lines


def nearer(twice: list[Twice]) -> list[float]:
    """Overlaps of the drawings that are most alike."""
    return [
        max(
            shared(mine, theirs)
            for mine in (one.second, one.other)
            for theirs in (one.case.truth, one.case.doubtful)
            if mine is not None and theirs is not None
        )
        for one in twice
    ]


def clicks(cases: list[Case]) -> list[str]:
    """Lines on overlaps after further points, and how many points it takes."""
    results = [
        [
            [shared(one, case.truth, beside) for beside in BESIDE_PX]
            for one in corrected(case, "geofield")
        ]
        for case in cases
    ]
    lines = [
        "| ground left aside | "
        + " | ".join(f"{n} point{'s' * (n > 1)}" for n in TOLD_POINTS)
        + f" | until {AIM} |",
        "|---" * (len(TOLD_POINTS) + 2) + "|",
    ]
    for at, beside in enumerate(BESIDE_PX):
        some = [[step[at] for step in one] for one in results]
        means = [np.mean([one[min(n, len(one)) - 1] for one in some]) for n in TOLD_POINTS]
        needed = [
            next((n for n, value in enumerate(one, 1) if value >= AIM), MOST_CLICKS) for one in some
        ]
        told = f"within {beside:.0f} px of the border" if beside else "none"
        shown = " | ".join(f"{one:.3f}" for one in means)
        lines.append(f"| {told} | {shown} | {np.mean(needed):.1f} |")
    return lines


def trees(windows: list[tuple[Trees, np.ndarray]]) -> list[str]:
    """Lines on how far two eyes agree on trees, and geofield's with each."""
    lines = [
        "| trees | found | of | F1 within 6 px | F1 within 10 px | precision | recall |",
        "|---" * 7 + "|",
        tree_row("second eye, with the labels", [(eye, one.trees) for one, eye in windows]),
    ]
    for name, kind in KINDS.items():
        found_there = [
            found_in(with_bands(one, kind), min_confidence=BALANCED)[0] for one, _ in windows
        ]
        pairs = list(zip(found_there, windows, strict=True))
        with_labels = [(mine, one.trees) for mine, (one, _) in pairs]
        lines.append(tree_row(f"geofield, {name}, with the labels", with_labels))
        with_eye = [(mine, eye) for mine, (_, eye) in pairs]
        lines.append(tree_row(f"geofield, {name}, with the second eye", with_eye))
    return lines


def marked_twice() -> Iterator[tuple[Trees, np.ndarray]]:
    """Windows of the sites left out: their labelled trees, and those of the second eye."""
    folder = DATA / "trees_train"
    labels = pd.read_csv(folder / "trees.csv")
    for row in rows_of("tree_labels_again.csv"):
        left, top = float(row["left_px"]), float(row["top_px"])
        window = shapely.box(left, top, left + WINDOW_PX, top + WINDOW_PX)
        here = labels.loc[labels.image == row["image"], ["x_px", "y_px"]].to_numpy(np.float64) + 0.5
        seen = np.array(json.loads(row["trees_px"]), np.float64).reshape(-1, 2)
        scene = read_scene(folder / f"{row['image']}.tif")
        inside, counted = (xy[shapely.contains_xy(window, *xy.T)] for xy in (here, seen))
        yield Trees(scene, inside, window), counted


def tree_row(name: str, pairs: list[tuple[np.ndarray, np.ndarray]]) -> str:
    """How far trees agree: those found with those that they are held against."""
    got, of = (sum(len(pair[at]) for pair in pairs) for at in (0, 1))
    near, hits = (
        sum(len(match_points(*pair, reach).truth_index) for pair in pairs) for reach in REACH_PX
    )
    return (
        f"| {name} | {got} | {of} | {2 * near / (got + of):.3f} | {2 * hits / (got + of):.3f} | "
        f"{hits / got:.2f} | {hits / of:.2f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clicks", type=int, default=120, help="fields of further points")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    every = list(labelled())
    order = np.random.default_rng(0).permutation(len(every))
    some = [every[at] for at in order[: options.clicks]]
    twice = list(drawn_twice())
    windows = list(marked_twice())
    lines = [
        *machine("opencv-python-headless"),
        "",
        "A second eye drew and marked what it saw in the pictures, without any label or anything "
        "that software found. What geofield and the labels are apart is to be held against what "
        "the second eye and the labels are apart.",
        "",
        "## Outlines",
        "",
        f"{len(twice)} of the fields of `field_unseen.md`, each of another site and taken by "
        "chance. geofield's outlines are found by a network and a ranking that were learned "
        "without the site. Overlap is intersection over union.",
        "",
        *agreement(twice),
        "",
        "## Further points",
        "",
        f"{len(some)} fields; each point lies in the middle of the largest wrong piece. Ground so "
        "near to the border that was drawn is left aside in the overlap, not in where points go.",
        "",
        *clicks(some),
        "",
        "## Trees",
        "",
        f"{len(windows)} windows of 77 m, each of another of the sites left out and taken by "
        "chance. The second eye saw near infrared, too.",
        "",
        *trees(windows),
    ]
    write_page("second_eye", "A second eye on the labels", lines)


if __name__ == "__main__":
    main()
