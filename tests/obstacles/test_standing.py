"""What stands in a field and is no tree: how far it reaches in the cells of the answer."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from geofield.model.circles import Circles
from geofield.obstacles.crowns import CELL_PX
from geofield.obstacles.standing import StandingMap


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
    # Files round to a centimetre: a cell is 1.2 m.
    cell_m = shapely.transform(thing, lambda xy: np.round(xy / CELL_PX * 1.2, 2))
    assert cell_m.is_valid
    for start in (10, 10 + side):
        middle = shapely.Point(CELL_PX * (start + side / 2), CELL_PX * (start + side / 2))
        assert thing.covers(middle)
