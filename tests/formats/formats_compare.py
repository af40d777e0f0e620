"""What "the same" means after a way out and back."""

from __future__ import annotations

import numpy as np
import pandas as pd
import shapely


def assert_same_table(
    left, right, *, precision_m, columns=None, number_tolerance=0.0, same_vertices=True
):
    """Same rows, values and shapes; coordinates may move by `precision_m`."""
    assert len(left) == len(right)
    for name in columns if columns is not None else left.columns.drop(left.geometry.name):
        a, b = left[name], right[name]
        assert (a.isna().to_numpy() == b.isna().to_numpy()).all(), name
        a, b = a[a.notna()], b[b.notna()]
        if pd.api.types.is_numeric_dtype(a.dtype):
            np.testing.assert_allclose(
                a.to_numpy(dtype=float), b.to_numpy(dtype=float), rtol=0, atol=number_tolerance
            )
        else:
            assert list(a) == list(b), name
    ours = shapely.normalize(left.geometry.to_numpy())
    theirs = right.geometry.to_numpy()
    for a, b in zip(ours, theirs, strict=True):
        assert a.geom_type == b.geom_type
        if same_vertices:
            assert shapely.get_num_coordinates(a) == shapely.get_num_coordinates(b)
        if precision_m == 0:
            assert shapely.equals_exact(a, shapely.normalize(b))
        else:
            assert shapely.hausdorff_distance(a, b) <= precision_m
            assert abs(a.area - b.area) <= 2 * precision_m * max(a.length, 1.0)
