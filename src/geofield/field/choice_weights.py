"""Weights of the choice of a region, as `benchmarks/field_choice.py` learned them."""

import numpy as np

#: Of what the merges so far show.
TOLL_WEIGHTS = np.array(
    [
        0.139,
        -0.05109,
        -0.004417,
        -0.4861,
        -0.05236,
        -0.07378,
        0.01769,
        -0.3043,
        -0.7491,
        -0.5933,
        -0.1045,
        -0.3904,
        -0.4018,
        0.03765,
    ]
)

#: Of what the next merge would show.
NEXT_WEIGHTS = np.array(
    [
        -1.314,
        0.07002,
        0.5692,
        0.6285,
        2.653,
        0.9039,
        -1.046,
        -0.2054,
        0.8608,
        0.1272,
        -0.06162,
        -3.637,
        -0.6267,
        -0.4654,
    ]
)

#: Of the region's own outline.
OWN_WEIGHTS = np.array(
    [
        6.133,
        0.9269,
        1.514,
        -1.354,
        5.085,
        -0.2706,
    ]
)
