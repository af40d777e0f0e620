"""Peaks by their dynamics, against morphological reconstruction."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import ndimage
from skimage.morphology import reconstruction

from geofield.study.peaks import plateau_labels

EIGHT = np.ones((3, 3))


def by_reconstruction(height, h):
    """Regional maxima of the h-maxima transform, and only those that rise by h."""
    flat = reconstruction(height - h, height, footprint=EIGHT)
    # Heights are whole numbers: half a step separates a plateau from what is below it.
    lower = reconstruction(flat - 0.5, flat, footprint=EIGHT)
    return flat - lower > 0.25


@given(
    arrays(np.int64, st.tuples(st.integers(3, 14), st.integers(3, 14)), elements=st.integers(0, 9))
)
@settings(max_examples=60)
def test_plateaus_are_those_of_the_h_maxima_transform(levels):
    # A frame of zeros: in the voting accumulator everything outside is ground, too.
    height = np.pad(levels, 1).astype(float)
    h = 2.5
    labels, count = plateau_labels(height, h)
    expected = by_reconstruction(height, h)
    if height.max() <= h:
        assert count == 0
        return
    assert np.array_equal(labels > 0, expected)
    assert count == ndimage.label(expected, structure=EIGHT)[1]


def test_flat_ground_has_no_peak():
    assert plateau_labels(np.full((8, 9), 3.0), 4.0)[1] == 0
    assert plateau_labels(np.zeros((0, 5)), 1.0)[1] == 0


def test_of_two_peaks_with_a_shallow_pass_the_higher_stays():
    height = np.array([[0, 5, 4, 6, 0, 5, 0]], float)
    labels, count = plateau_labels(np.pad(height, 1), 2.0)
    assert count == 2
    assert labels[1].tolist() == [0, 0, 1, 1, 1, 0, 2, 2, 0][:9] or labels[1, 4] == 1
