"""The border moved inwards: whole, whatever the width."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely
from shapely import box
from shapely.affinity import rotate

import geofield as gf
from geofield.tracks.headland import inset


def test_no_width_loses_a_part_of_the_field() -> None:
    lobes, neck = (box(0, 0, 80, 100), box(120, 0, 200, 120)), box(60, 40, 140, 48)
    for turned_deg in (3, 39, 45):
        outline: Any = rotate(shapely.union_all([*lobes, neck]), turned_deg)
        for width_m in np.linspace(4.5, 12.0, 200):
            # GEOS loses a lobe at some of these widths, the other at none.
            both = sum((80 - 2 * width_m) * (long - 2 * width_m) for long in (100, 120))
            assert abs(inset(outline, width_m).area - both) < 1.0


def test_a_hole_in_the_strip_cuts_the_pass_around_the_field() -> None:
    """The pass went along the hole's border instead, half the machine in the hole: 52 m of it."""
    field = box(500_000, 5_500_000, 500_200, 5_500_100)
    hole = box(500_090, 5_500_002, 500_110, 5_500_020)
    holed = shapely.Polygon(field.exterior, [hole.exterior])
    tracks = gf.plan_tracks(holed, crs=32633, spacing_m=8, headland_m=8, direction=90)
    (ring,) = tracks.headland_tracks.geometry
    assert ring.intersection(hole.buffer(0.01)).length < 0.05
    around = gf.plan_tracks(field, crs=32633, spacing_m=8, headland_m=8, direction=90)
    (whole,) = around.headland_tracks.geometry
    assert whole.difference(hole).length == pytest.approx(ring.length, abs=0.01)
