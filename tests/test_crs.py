"""Coordinate reference systems: the authority's axis order."""

from __future__ import annotations

import numpy as np
import pytest
from pyproj import CRS, Transformer

from geofield.crs import northing_first, parse_crs


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
