"""The same edits made in QGIS and on the review page lead to the same plan."""

from __future__ import annotations

import shutil

import pytest
import shapely
from shapely.affinity import translate
from test_editing_loop import plan_again, plan_file

from geofield.plan import read_plan
from geofield.review.desk import Desk

__all__ = ["plan_file"]


def precisely(shape):
    return shapely.to_wkt(shape, rounding_precision=-1)


def test_statuses_shapes_and_drawings_are_worth_the_same(plan_file, qgis, tmp_path):
    other = tmp_path / "other" / "field.gpkg"
    other.parent.mkdir()
    shutil.copy(plan_file, other)
    before = read_plan(plan_file)
    number = int(before.obstacles["obstacle_no"].iloc[0])
    moved = int(before.obstacles["obstacle_no"].iloc[1])
    shape = before.obstacles.set_index("obstacle_no").geometry[moved]
    x, y = before.field.polygon.representative_point().coords[0]
    drawn = shapely.Polygon([(x - 4, y), (x + 4, y), (x, y + 6)])
    shifted = translate(shape, 2.0, -1.0)
    where, status = "obstacle_no = {}", {"status": "rejected"}
    done = qgis(
        "edit",
        path=str(plan_file),
        changes=[
            {"layer": "obstacles", "where": where.format(number), "values": status},
            {"layer": "obstacles", "where": where.format(moved), "wkt": precisely(shifted)},
            {"layer": "obstacles", "wkt": precisely(drawn)},
        ],
    )
    assert done == {"done": 3}
    plan_again(plan_file)
    desk = Desk(other)
    desk.edit({"do": "tracks", "settings": {"spacing_m": 5.0}})
    desk.edit({"do": "status", "no": number, "status": "rejected"})
    desk.edit({"do": "move", "no": moved, "dx_m": 2.0, "dy_m": -1.0})
    desk.edit({"do": "polygon", "ring": [list(p) for p in drawn.exterior.coords[:-1]]})
    desk.save()
    mine, theirs = read_plan(plan_file), read_plan(other)
    here, there = (plan.obstacles.set_index("obstacle_no") for plan in (mine, theirs))
    assert list(here.index) == list(there.index)
    for column in ("kind", "radius_m", "buffer_m"):
        assert here[column].equals(there[column]), column
    assert here["status"][number] == there["status"][number] == "rejected"
    apart = shapely.hausdorff_distance(here.geometry.to_numpy(), there.geometry.to_numpy())
    assert apart == pytest.approx(0.0, abs=2e-3)
    lengths = [plan.tracks.segments["length_m"].sum() for plan in (mine, theirs)]
    assert lengths[0] == pytest.approx(lengths[1], abs=0.05)
