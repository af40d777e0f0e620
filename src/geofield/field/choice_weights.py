"""Weights of the choice of a region, as `benchmarks/field_choice.py` learned them."""

import numpy as np

#: Of what the merges so far show.
TOLL_WEIGHTS = np.array(
    [
        0.2529,
        -0.07422,
        -0.01447,
        -0.6651,
        0.281,
        -0.3835,
        -0.01886,
        -0.6044,
        -0.5446,
        -1.012,
        -0.2582,
        0.02161,
        -0.4667,
        0.07114,
    ]
)

#: Of what the next merge would show.
NEXT_WEIGHTS = np.array(
    [
        -0.6651,
        -0.1923,
        0.4429,
        0.643,
        -1.027,
        -1.922,
        -2.856,
        -1.144,
        2.284,
        -0.441,
        0.1693,
        -0.2562,
        0.2824,
        -0.5339,
    ]
)

#: Of the region's own outline.
OWN_WEIGHTS = np.array(
    [
        -1.4,
        1.543,
        4.898,
        -4.566,
        8.616,
        -0.1278,
    ]
)
