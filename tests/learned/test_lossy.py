"""Lessons as JPEG: each band is still itself."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "tools"))
from lossy import through_jpeg

COLOURS = 200, 50, 10, 120


@pytest.mark.parametrize("bands", [4, 3, 1])
def test_bands_keep_their_order_and_lose_a_little(bands):
    flat = np.zeros((64, 64, bands), np.uint8) + np.array(COLOURS[:bands], np.uint8)
    assert through_jpeg(flat, 60).shape == flat.shape
    assert np.abs(through_jpeg(flat, 60).mean(axis=(0, 1)) - COLOURS[:bands]).max() < 4
    noisy = np.random.default_rng(0).integers(0, 256, flat.shape).astype(np.uint8)
    little, much = (
        np.abs(through_jpeg(noisy, quality).astype(float) - noisy).mean() for quality in (95, 20)
    )
    assert 0 < little < much


def test_colours_are_stored_as_colours():
    """Red weighs .299 in brightness, which JPEG keeps best, and blue .114."""
    rng = np.random.default_rng(1)
    base = np.full((64, 64, 3), 128, np.uint8)
    lost = []
    for band in (0, 2):
        picture = base.copy()
        picture[..., band] = rng.integers(40, 216, (64, 64))
        lost.append(np.abs(through_jpeg(picture, 50).astype(float) - picture)[..., band].mean())
    assert lost[0] < 0.95 * lost[1]
