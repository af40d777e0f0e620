"""A later detection joined with what a person said, row by row, without a picture."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import shapely
from affine import Affine
from changed_plans import Frame
from pyproj import CRS
from shapely.affinity import translate

from geofield.errors import FormatWarning
from geofield.grid import Grid
from geofield.model.merge import Changes, merge
from geofield.model.obstacles import from_circles_px
from geofield.model.review import reconcile
from geofield.model.written import Written, free_number

#: On the central meridian a metre is 2 pixels; the picture reaches beyond the field to all sides.
GRID = Grid(500, 300, Affine(0.5, 0, 499_975, 0, -0.5, 5_600_125), CRS(32633))
FIELD = shapely.box(500_000, 5_600_000, 500_200, 5_600_100)
#: Pixels west of the field's middle.
WEST_PX = shapely.box(0, 0, 250, 300)


def found(*circles: tuple[float, float, float], buffer_m: float = 0.0) -> Frame:
    """Detected circles: metres east and north of the field's corner, and the radius, metres."""
    east, north, radius_m = np.array(circles, float).reshape(-1, 3).T
    return from_circles_px(
        (east + 25) * 2, (125 - north) * 2, radius_m * 2, GRID, buffer_m=buffer_m
    )  # fmt: skip


def searched_again(
    before: Frame, edited: Frame, *circles: tuple[float, float, float], **how: float
) -> tuple[Frame, Changes]:
    """The table after a person edited it and a picture showed other circles, and what is told."""
    table, written = reconcile(edited, Written.of(before, np.zeros(len(before), bool)), GRID)
    result, _, changes = merge(found(*circles, **how), table, written, FIELD, GRID)
    return result.set_index("obstacle_no", drop=False), changes


def with_status(table: Frame, *status: str) -> Frame:
    return table.assign(status=list(status))


@pytest.mark.parametrize("status", ["confirmed", "rejected"])
def test_what_hardly_reaches_out_of_a_reviewed_obstacle_is_part_of_it(status: str) -> None:
    before = found((120, 50, 4), (50, 50, 8), (90, 50, 4))
    again = (120, 50, 4), (90, 50, 4), (50.5, 50, 7), (56.5, 50, 2), (50, 57, 3), (170, 50, 3)
    edited = with_status(before, status, status, "detected")
    after, changes = searched_again(before, edited, *again)
    # Of the one before the last more than three tenths lie outside, of the one before it less.
    assert (changes.new, changes.gone, changes.found_again) == ((4, 5), (), 1)
    assert sorted(after.index) == [1, 2, 3, 4, 5]
    assert after["status"].loc[[1, 2, 3, 4, 5]].tolist() == [status, status, *["detected"] * 3]
    assert after.geometry[4].centroid.y == pytest.approx(5_600_057, abs=0.1)


@pytest.mark.parametrize("said", ["confirmed", "rejected", "possible", "deleted"])
def test_a_tree_far_larger_than_what_is_driven_through_is_another(said: str) -> None:
    """A shrub was rejected, and the tree that a later picture shows there was driven into."""
    other = (190, 50, 3)
    before = found((30, 50, 4), (80, 50, 4), (150, 50, 4), other)
    edited = with_status(before, *[said.replace("deleted", "rejected")] * 3, "detected")
    edited = edited[3:] if said == "deleted" else edited
    # Without its margin the first has less than twice the area of what was said, the others more.
    again = found((31, 50, 5.6), (82, 50, 5.7), (150, 50, 9), other, buffer_m=1.5)
    again["status"] = ["detected", "detected", "possible", "detected"]
    table, written = reconcile(edited, Written.of(before, np.zeros(4, bool)), GRID)
    after, _, changes = merge(again, table, written, FIELD, GRID)
    new = () if said == "confirmed" else (5,)
    assert changes.new == new
    assert after["status"][after["obstacle_no"].isin(new)].tolist() == ["detected"] * len(new)
    assert changes.stay_deleted == (2 if said == "deleted" else 0)
    # One of another shape may be anything.
    _, _, changes = merge(again.assign(radius_m=np.nan), table, written, FIELD, GRID)
    assert changes.new == ()


def test_where_all_is_gone_an_empty_table_is_left() -> None:
    before = found((50, 50, 4), (90, 50, 4))
    after, changes = searched_again(before, before)
    assert changes.gone == (1, 2)
    assert len(after) == 0
    assert list(after.columns) == list(before.columns)
    assert after.crs == before.crs


def test_what_stands_outside_the_field_is_not_sought() -> None:
    before = found((50, 50, 4), (-10, 50, 4))
    _, changes = searched_again(before, with_status(before, "confirmed", "confirmed"))
    assert changes.kept == 2
    assert changes.unfound == (1,)


def test_what_nobody_reviewed_stays_unseen_in_the_field_alone() -> None:
    before = found((150, 50, 4), (210, 50, 4), (30, 50, 4))
    table, written = reconcile(before, Written.of(before, np.zeros(3, bool)), GRID)
    result, _, changes = merge(found(), table, written, FIELD, GRID, WEST_PX)
    assert (changes.unseen, changes.gone) == (1, (2, 3))
    assert result["obstacle_no"].tolist() == [1]


def test_only_what_is_driven_through_of_an_avoided_tree_is_told() -> None:
    before = found((30, 50, 2), (60, 50, 2), (90, 50, 4), (120, 50, 2), (160, 50, 2))
    edited = with_status(before, "confirmed", "rejected", "confirmed", "confirmed", "rejected")
    beside = Frame(geometry=[translate(found((120, 50, 6)).geometry[0], 0.5)], crs=edited.crs)
    edited = pd.concat([edited, beside], ignore_index=True)
    # The third is as large as it was, with a wider margin; the fourth grew into what was drawn;
    # the last grew, and is driven through whatever its size.
    again = (30, 50, 4), (60, 50, 4), (90, 50, 4), (120, 50, 4), (160, 50, 2.7)
    _, changes = searched_again(before, edited, *again, buffer_m=3.0)
    assert changes.outgrown == (1,)
    assert "1 of yours smaller than what is found there (1)" in changes.in_words()


def test_where_a_person_drew_nothing_was_found() -> None:
    """What is moved away from such a place leaves no mark that hides a tree there."""
    before = found((30, 50, 3))
    drawn = Frame(geometry=[found((80, 50, 3)).geometry[0]], crs=before.crs)
    both = pd.concat([before, drawn], ignore_index=True)
    table, written = reconcile(both, Written.of(before, np.zeros(1, bool)), GRID)
    shapes = [table.geometry[0], translate(table.geometry[1], 40)]
    table, written = reconcile(table.set_geometry(shapes, crs=table.crs), written, GRID)
    result, _, changes = merge(found((30, 50, 3), (80, 50, 3)), table, written, FIELD, GRID)
    assert (changes.new, changes.stay_deleted) == ((3,), 0)
    assert set(result["status"]) == {"detected", "added"}


def test_a_tree_moved_a_little_hides_none_where_it_stood() -> None:
    before = found((30, 50, 4))
    edited = before.set_geometry([translate(before.geometry[0], 3)], crs=before.crs)
    after, changes = searched_again(before, edited, (33, 50, 4), (28, 50, 1.5))
    assert (changes.new, changes.stay_deleted) == ((2,), 0)
    assert after["status"].tolist() == ["confirmed", "detected"]


def test_a_margin_typed_with_the_shape_that_it_makes_grows_it_once() -> None:
    before = found((30, 50, 4))
    wide = found((31, 50, 4), buffer_m=2.0)
    edited = before.assign(buffer_m=2.0).set_geometry(wide.geometry.to_numpy(), crs=before.crs)
    after, _ = searched_again(before, edited, (30, 50, 4))
    assert after["radius_m"][1] == pytest.approx(before["radius_m"][0])
    assert after.geometry[1].equals_exact(wide.geometry[0], 1e-3)


@pytest.mark.parametrize(
    ("said", "stands"),
    [
        (("rejected", "confirmed"), "confirmed"),
        (("confirmed", "rejected"), "confirmed"),
        (("rejected", "possible"), "rejected"),
        (("possible", "rejected"), "possible"),
    ],
)
def test_of_copies_that_contradict_each_other_one_stands(
    said: tuple[str, str], stands: str
) -> None:
    before = found((30, 50, 4))
    copied = with_status(pd.concat([before, before], ignore_index=True), *said)
    with pytest.warns(FormatWarning, match="contradict each other"):
        table, _ = reconcile(copied, Written.of(before, np.zeros(1, bool)), GRID)
    assert table[["obstacle_no", "status"]].to_numpy().tolist() == [[1, stands]]


def test_the_next_number_is_behind_those_there_and_those_there_were() -> None:
    two = found((30, 50, 4), (60, 50, 4))
    records = None, Written(), Written(last_no=1), Written(last_no=7)
    assert [free_number(None, one) for one in records] == [1, 1, 2, 8]
    assert [free_number(two, one) for one in records] == [3, 3, 3, 8]
