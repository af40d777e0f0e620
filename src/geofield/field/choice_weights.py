"""Weights of the choice of a region, as `benchmarks/field_choice.py` learned them."""

import numpy as np

#: Of what the merges so far show.
TOLL_WEIGHTS = np.array(
    [
        0.2559,
        -0.06432,
        0.01507,
        -0.5661,
        0.06002,
        -0.1247,
        0.04573,
        -0.5069,
        -1.175,
        -0.805,
        -0.1649,
        -0.5107,
        -0.6562,
        0.07556,
    ]
)

#: Of the region's own outline.
OWN_WEIGHTS = np.array(
    [
        7.281,
        1.489,
        3.432,
        -2.793,
        6.415,
        0.02962,
    ]
)
