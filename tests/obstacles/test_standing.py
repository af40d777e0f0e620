"""What stands in a field and is no tree: how far it reaches in the cells of the answer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
import shapely

from geofield.model.circles import Circles
from geofield.obstacles.crowns import CELL_PX
from geofield.obstacles.standing import CELL_M, StandingMap

Cells = Sequence[tuple[int, int, int, int]]


def test_a_thing_reaches_as_far_as_half_its_clearest_answer() -> None:
    cells = np.zeros((100, 100), np.uint8)
    cells[40:60, 40:60] = 60
    cells[45:55, 45:55] = 240
    standing = StandingMap(cells, np.zeros_like(cells), 10, 20)
    field = shapely.box(*(CELL_PX * np.array([10, 20, 110, 120])))
    (thing,), (probability,) = standing.things(field, Circles(), least=0.4)
    assert probability == pytest.approx(240 / 255)
    core = shapely.box(*(CELL_PX * np.array([55, 65, 65, 75])))
    assert thing.symmetric_difference(core).area < 0.05 * core.area


@pytest.mark.parametrize("side", [1, 2, 5])
def test_cells_that_meet_at_a_corner_alone_are_one_valid_polygon(side: int) -> None:
    cells = np.zeros((40, 40), np.uint8)
    cells[10 : 10 + side, 10 : 10 + side] = 240
    cells[10 + side : 10 + 2 * side, 10 + side : 10 + 2 * side] = 240
    standing = StandingMap(cells, np.zeros_like(cells), 0, 0)
    (thing,), _ = standing.things(shapely.box(0, 0, 80, 80), Circles(), least=0.4)
    assert isinstance(thing, shapely.Polygon)
    assert thing.is_valid
    # Files round to a centimetre.
    rounded_m = shapely.transform(thing, lambda xy: np.round(xy / CELL_PX * CELL_M, 2))
    assert rounded_m.is_valid
    for start in (10, 10 + side):
        middle = shapely.Point(CELL_PX * (start + side / 2), CELL_PX * (start + side / 2))
        assert thing.covers(middle)


def found_in(cells: Cells, trees: Circles | None = None, canopy: Cells = ()) -> int:
    """How many things stand in a field of 100 x 100 cells of 0.72 m; boxes of cells are given."""
    standing = StandingMap(np.zeros((100, 100), np.uint8), np.zeros((100, 100), np.uint8), 0, 0)
    for layer, boxes in ((standing.cells, cells), (standing.canopy, canopy)):
        for left, top, right, bottom in boxes:
            layer[top:bottom, left:right] = 240
    field = shapely.box(0, 0, 100 * CELL_PX, 100 * CELL_PX)
    return len(standing.things(field, trees or Circles(), least=0.4)[0])


def tree(x: float, y: float, radius: float) -> Circles:
    """One tree, in cells."""
    return Circles(*(np.array([CELL_PX * each]) for each in (x, y, radius)))


def test_a_wall_along_the_border_is_the_border_unless_it_reaches_into_the_field() -> None:
    assert found_in([(20, 1, 60, 12)]) == 0
    assert found_in([(20, 1, 60, 14)]) == 1, "10 m deep"
    assert found_in([(20, 3, 60, 7)]) == 0
    assert found_in([(20, 4, 60, 7)]) == 1, "it begins 3.6 m inside"


def test_what_a_tree_explains_is_no_thing_of_its_own() -> None:
    hut = [(45, 45, 55, 55)]
    assert found_in(hut) == 1
    assert found_in(hut, tree(50, 50, 7)) == 0
    assert found_in(hut, tree(56, 50, 5)) == 1, "a third of it is that tree's"
    assert found_in(hut, tree(55, 50, 5)) == 0, "more than half of it"


def test_canopy_beyond_all_trees_is_a_hedge_from_four_cells_on() -> None:
    assert found_in([], canopy=[(40, 40, 44, 41)]) == 1
    assert found_in([], canopy=[(40, 40, 43, 41)]) == 0
    assert found_in([], tree(42, 40.5, 4), canopy=[(40, 40, 44, 41)]) == 0
    assert found_in([], tree(50, 50, 10), canopy=[(60, 47, 63, 53)]) == 1, "it begins at a crown"


def test_a_field_too_large_for_memory_has_no_map() -> None:
    assert StandingMap.over(0.0, 0.0, 1e5 * CELL_PX, 1e4 * CELL_PX) is None
    small = StandingMap.over(3.5 * CELL_PX, 0.0, 9.5 * CELL_PX, 4.5 * CELL_PX)
    assert small is not None
    assert (small.cells.shape, small.col, small.row) == ((5, 7), 3, 0)
