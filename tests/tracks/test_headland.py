"""The border moved inwards: whole, whatever the width."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from shapely import box
from shapely.affinity import rotate

from geofield.tracks.headland import inset


def test_no_width_loses_a_part_of_the_field() -> None:
    lobes, neck = (box(0, 0, 80, 100), box(120, 0, 200, 120)), box(60, 40, 140, 48)
    for turned_deg in (3, 39, 45):
        outline: Any = rotate(shapely.union_all([*lobes, neck]), turned_deg)
        for width_m in np.linspace(4.5, 12.0, 200):
            # GEOS loses a lobe at some of these widths, the other at none.
            both = sum((80 - 2 * width_m) * (long - 2 * width_m) for long in (100, 120))
            assert abs(inset(outline, width_m).area - both) < 1.0
