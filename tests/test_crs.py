"""Coordinate reference systems: the authority's axis order."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from pyproj import CRS, Transformer

from geofield.crs import GEOD, ground_areas_m2, ground_lengths_m, northing_first, parse_crs


@pytest.mark.parametrize(
    ("code", "lon", "lat"),
    [
        (4326, 33.5, 35.1), (3857, 33.5, 35.1), (25832, 9.5, 48.1), (3044, 9.5, 48.1),
        (31468, 12.1, 48.0), (2056, 8.2, 46.9), (2193, 173.1, -41.2), (3035, 10.5, 52.3),
        (27700, -1.5, 52.1), (5513, 15.5, 49.9), (3031, 2.5, -72.0), (3413, -38.5, 72.6),
        (5041, 10.3, 83.5), (5042, 10.3, -83.5), (32661, 10.3, 83.5), (32761, 10.3, -83.5),
    ],
)  # fmt: skip
def test_the_axis_order_is_projs(code, lon, lat):
    crs = CRS.from_epsg(code)
    xy = Transformer.from_crs("OGC:CRS84", crs, always_xy=True).transform(lon, lat)
    authority = Transformer.from_crs("OGC:CRS84", crs).transform(lon, lat)
    assert np.allclose(authority, xy[::-1] if northing_first(crs) else xy)
    assert not np.isclose(*xy)


def test_a_code_out_of_a_table_is_one_too():
    assert parse_crs(np.str_("EPSG:32633")) == parse_crs(np.int64(32633)) == parse_crs(32633)


@pytest.mark.parametrize("side_m", [0.3, 1.0, 200.0])
def test_small_and_large_shapes_are_measured_on_the_ground(side_m):
    """A zone's edge: its metres are a thousandth longer than those of the ground."""
    crs = CRS.from_epsg(32636)
    square = shapely.box(830_000, 900_000, 830_000 + side_m, 900_000 + side_m)
    back = Transformer.from_crs(crs, "OGC:CRS84", always_xy=True)
    ring = shapely.transform(square, lambda xy: np.column_stack(back.transform(*xy.T)))
    area_m2, border_m = map(abs, GEOD.geometry_area_perimeter(ring))
    assert border_m < 4 * side_m / 1.0008
    assert ground_areas_m2([square], crs) == pytest.approx([area_m2], rel=1e-5)
    assert ground_lengths_m([square], crs) == pytest.approx([border_m], rel=1e-5)
