"""Obstacles that another program merged or dissolved: none becomes less of one silently."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import shapely
from changed_plans import Frame, at, geofield, plan_in, rewritten, rows
from shapely.affinity import translate

import geofield as gf
from geofield.errors import FormatWarning
from geofield.model.obstacles import active
from geofield.model.review import reconcile


def understood(file: Path) -> tuple[Frame, str]:
    """The obstacles of an edited plan, as a re-run takes them, and what is told."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        plan = gf.read_plan(file)
        assert plan.obstacles is not None
        table = reconcile(plan.obstacles, plan.evidence.written, plan.grid)[0]
    assert all(issubclass(each.category, FormatWarning) for each in told)
    words = " ".join(str(each.message) for each in told)
    return table.set_index("obstacle_no", drop=False), words


def merged(before: Frame, numbers: list[int], shape: Any, **said: Any) -> Frame:
    """A table in which some rows are one, with the cells of the first and what is said."""
    table = before.reset_index(drop=True).astype({"obstacle_no": "float64"})
    row = table[at(table, numbers[0])].set_geometry([shape], crs=table.crs).assign(**said)
    return pd.concat([row, table[~table["obstacle_no"].isin(numbers)]])


def joined(before: Frame, *numbers: int) -> shapely.Geometry:
    """Their shapes with what connects them."""
    shapes = before.geometry[list(numbers)]
    path = shapely.LineString(list(shapes.centroid)).buffer(0.5)
    return shapely.union_all([*shapes, path])


def write(file: Path, table: Frame) -> None:
    rewritten(file, "obstacles", lambda _: table)


def test_a_word_on_one_obstacle_is_none_on_those_merged_with_it(folder: Path) -> None:
    """Rows dissolved into one that was rejected: all were driven through, without a word."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    a, b = (before.geometry[number] for number in (1, 2))
    whole = shapely.union_all([a, b, shapely.LineString([a.centroid, b.centroid]).buffer(0.5)])
    for others, shape, words in (
        (before.index != 1, shapely.MultiPolygon(list(before.geometry)), "counts as it was"),
        (before.index == 2, whole, "all of it is driven around"),
    ):
        merged = folder / f"{words}.gpkg"
        merged.write_bytes(file.read_bytes())

        table = before.reset_index(drop=True)
        table.loc[at(table, 1), ["status", "geometry"]] = ["rejected", shape]
        rewritten(merged, "obstacles", lambda _, rest=table[~others]: rest)
        assert words in geofield("tracks", merged, "-o", merged)
        after = rows(gf.read_plan(merged))
        driven = after.geometry[after["status"] != "rejected"].union_all()
        assert driven.buffer(0.01).covers(before.geometry[others].union_all())


@pytest.mark.parametrize("number", [None, 66, 2.5])
@pytest.mark.parametrize("status", ["rejected", "possible", "confirmed"])
def test_a_row_that_lost_its_number_says_nothing_of_what_was_dissolved_into_it(
    folder: Path, number: float | None, status: str
) -> None:
    """All trees counted as rejected without a word: as one of them was, or a program summed up."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    write(
        file,
        merged(
            before,
            list(before.index),
            before.geometry.union_all(),
            obstacle_no=number,
            status=status,
        ),
    )
    after, told = understood(file)
    assert re.search(r"merged into another row .* as it was written", told), told
    assert after["status"].equals(before["status"])
    assert after.geometry.hausdorff_distance(before.geometry).max() < 1e-3
    assert after["radius_m"].to_numpy() == pytest.approx(before["radius_m"], abs=1e-6)


def test_the_column_of_numbers_was_dropped_by_a_dissolve(folder: Path) -> None:
    """As `ST_Union(geom), status` of SQL leaves it, for a part of the trees."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    table = merged(before, [1, 2, 3], before.geometry[[1, 2, 3]].union_all(), status="rejected")
    write(file, table[["status", "geometry"]])
    told = geofield("tracks", file, "-o", file)
    assert "Obstacles merged into another row (1, 2, 3): each counts as it was written" in told
    after = rows(plan_in(folder))
    assert after["status"].equals(before["status"])
    assert "merged" not in geofield("tracks", file, "-o", file)


@pytest.mark.parametrize("number", [None, 66, 1])
def test_what_became_one_shape_is_driven_around(folder: Path, number: int | None) -> None:
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    whole = joined(before, 1, 2)
    write(file, merged(before, [1, 2], whole, status="rejected", obstacle_no=number))
    after, told = understood(file)
    assert re.search(r"merged .*all of it is driven around", told), told
    driven = active(after).geometry
    assert len(after) == len(before) - 1
    assert driven.hausdorff_distance(whole).min() < 0.01


@pytest.mark.parametrize("radius_m", [0.5, 3.0])
@pytest.mark.parametrize("number", [None, 1])
def test_a_mean_of_the_sizes_makes_no_merged_obstacle_smaller(
    folder: Path, number: int | None, radius_m: float
) -> None:
    """It was one circle between the trees, which were driven through without a word."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    whole = joined(before, 1, 2)
    said = {"obstacle_no": number, "radius_m": radius_m, "buffer_m": 0.1}
    write(file, merged(before, [1, 2], whole, **said))
    after, told = understood(file)
    assert re.search(r"the shape counts, and not radius_m", told), told
    assert bool(re.search(r"Obstacle 1, which took in others, keeps buffer_m", told)) == bool(
        number
    )
    assert active(after).geometry.hausdorff_distance(whole).min() < 0.01


def test_a_radius_typed_for_a_merged_row_that_holds_all_of_it_counts(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    write(file, merged(before, [1, 2], joined(before, 1, 2), radius_m=90.0))
    after, told = understood(file)
    assert not told
    assert after["radius_m"][1] == 90.0
    assert after.geometry[1].covers(before.geometry[2])


def test_what_a_row_says_of_itself_is_told_where_others_were_dissolved_into_it(
    folder: Path,
) -> None:
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    every = before.geometry.union_all()
    write(file, merged(before, list(before.index), every, status="rejected"))
    after, told = understood(file)
    assert re.search(r"Obstacle 1, which took in others, is now rejected", told), told
    assert after["status"][1] == "rejected"
    write(file, merged(before, list(before.index), every, radius_m=0.2))
    after, told = understood(file)
    assert re.search(r"Obstacle 1, which took in others, keeps radius_m", told), told
    assert after.geometry.hausdorff_distance(before.geometry).max() < 1e-3


def test_what_nobody_wrote_is_what_its_row_says_and_that_is_told(folder: Path) -> None:
    """Of two trees drawn and merged with a rejected one before anything ran."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    new = [translate(before.geometry[1], x, 40) for x in (0, 30)]
    write(
        file,
        merged(before, [1], shapely.MultiPolygon([before.geometry[1], *new]), status="rejected"),
    )
    after, told = understood(file)
    assert re.search(r"that are rejected: 2 further parts of them are, too", told), told
    assert (after["status"] == "rejected").sum() == 3


def test_a_tree_without_a_number_may_be_rejected_and_drawn_larger(folder: Path) -> None:
    """Merged with nothing, it is what its row says."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    table = before.reset_index(drop=True)
    table.loc[at(table, 2), "status"] = "rejected"
    table.loc[at(table, 2), "geometry"] = before.geometry[2].buffer(1)
    write(file, table[["status", "geometry"]])
    after, told = understood(file)
    assert re.search(r"has no column obstacle_no", told), told
    assert after["status"][2] == "rejected"
    assert np.isclose(after.geometry[2].area, before.geometry[2].buffer(1).area, rtol=1e-3)
