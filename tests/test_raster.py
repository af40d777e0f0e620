"""One pixel frame: positions count from the corner of the top-left pixel everywhere."""

import numpy as np
import pytest

from geofield.raster import bilinear, block_mean, gaps_filled, is_peak, resample, smoothed, windows


def ramp(rows, cols):
    """A picture whose value is where its pixel's centre lies."""
    y, x = np.mgrid[:rows, :cols] + 0.5
    return (x + 100 * y).astype(np.float32)


@pytest.mark.parametrize("factor", [2, 3, 1.5, 0.5, 0.7])
def test_larger_pixels_show_the_same_places(factor):
    picture = ramp(48, 60)
    coarse = resample(picture, factor)
    y, x = (np.mgrid[: coarse.shape[0], : coarse.shape[1]] + 0.5) * factor
    inner = np.s_[4:-4, 4:-4]
    assert coarse[inner] == pytest.approx((x + 100 * y)[inner], abs=0.02)


def test_sampling_between_pixels_counts_from_the_corner():
    picture = ramp(20, 30)
    x, y = np.array([3.5, 7.25, 20.0]), np.array([2.5, 9.75, 11.0])
    assert bilinear(picture, x, y) == pytest.approx(x + 100 * y, abs=0.01)
    # Beyond the border there is the border.
    assert bilinear(picture, np.array([-5.0]), np.array([0.5])) == pytest.approx(picture[0, 0])
    assert bilinear(picture, np.empty(0), np.empty(0)).shape == (0,)


def test_block_means_repeat_the_last_row():
    picture = ramp(5, 4)
    coarse = block_mean(picture, 2)
    assert coarse.shape == (3, 2)
    assert coarse[0, 0] == pytest.approx(picture[:2, :2].mean())
    assert coarse[2, 1] == pytest.approx(picture[4, 2:].mean())


def test_smoothing_keeps_the_mean_and_moves_nothing():
    picture = np.zeros((41, 41), np.float32)
    picture[20, 20] = 1
    smooth = smoothed(picture, 2.0)
    assert smooth.sum() == pytest.approx(1, abs=1e-5)
    assert np.argwhere(is_peak(smooth) & (smooth > 0.01)).tolist() == [[20, 20]]


@pytest.mark.parametrize("factor", [1.0, 2.0, 0.6])
def test_cores_cover_the_picture_once(factor):
    seen = np.zeros((70, 130), int)
    for window in windows((70, 130), 32, 16, 16, factor):
        x0, y0, x1, y1 = window.core
        yy, xx = np.mgrid[:70, :130] + 0.5
        seen += window.in_core(xx, yy)
        start = window.col / factor / 16
        assert abs(start - round(start)) * 16 * factor <= 0.5
        assert window.col <= x0
        assert window.col + window.width >= min(x1, 130) - 1e-9
        assert window.row <= y0
        assert window.row + window.height >= min(y1, 70) - 1e-9
    assert (seen == 1).all()


def test_gaps_repeat_a_nearest_pixel():
    known = np.random.default_rng(1).random((40, 50)) < 0.03
    number = np.arange(2.0 * known.size).reshape(2, *known.shape)
    filled = gaps_filled(number, known)
    assert np.array_equal(filled[1] - filled[0], np.full(known.shape, float(known.size)))
    taken = np.stack(np.divmod(filled[0].astype(int), known.shape[1]))
    assert known[tuple(taken)].all()
    places, row_column = np.argwhere(known), np.indices(known.shape)
    away = np.hypot(*(row_column[..., None] - places.T[:, None, None])).min(axis=-1)
    assert np.hypot(*(row_column - taken)) == pytest.approx(away, rel=0.03)
