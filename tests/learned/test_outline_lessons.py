"""Lessons of the outlines: pictures as they are kept, fields in other light, further points."""

import sys
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tools"))
from outline_pictures import GROUND, SIMULATION, Picture, kinds, read, write
from outline_samples import correction, lesson

SIDE = 256
FIELD, AROUND = (220, 180, 200, 190), (40, 30, 60, 50)


def picture(mark="own", fields=1):
    bands = np.zeros((4, SIDE, SIDE), np.uint8)
    bands[:] = np.array(AROUND, np.uint8)[:, None, None]
    mask = np.zeros((SIDE, SIDE), np.uint8)
    mask[80:180, 60:200] = 255
    bands[:, mask > 0] = np.array(FIELD, np.uint8)[:, None]
    return Picture(mark, f"{mark} 1", bands, [mask] * fields, (130.0, 130.0))


def test_pictures_are_kept_as_they_are(tmp_path):
    given = [picture(fields=2), picture(SIMULATION), picture(GROUND, 0)]
    assert write(tmp_path / "some.npz", given) == 3
    got = read(tmp_path / "some.npz")
    for one, other in zip(got, given, strict=True):
        assert (one.mark, one.site, one.seed_px) == (other.mark, other.site, other.seed_px)
        # Bands in their order, but for what JPEG loses beside the field's border.
        assert np.median(np.abs(one.bands.astype(int) - other.bands), axis=(1, 2)).max() <= 2
    assert [len(one.masks) for one in got] == [2, 1, 1]
    assert np.array_equal(got[0].masks[1], given[0].masks[1])
    assert (got[2].masks[0] == 255).all()
    drawn, made, grounds = kinds(got)
    assert [[one.mark for one in some] for some in (drawn, made, grounds)] == [
        ["own"],
        [SIMULATION],
        ["own", GROUND],
    ]


def test_a_lesson_shows_the_field_where_it_says():
    rng = np.random.default_rng(0)
    for ground in (None, picture(GROUND)):
        for _ in range(8):
            one = lesson(picture(), rng, ground)
            small = np.stack([cv2.resize(b.astype(np.float32), (64, 64)) for b in one["bands"]])
            inside, outside = one["target"] > 0.99, (one["target"] == 0) & (one["counts"] == 1)
            within, without = (small[:3, where].mean() for where in (inside, outside))
            assert within - without > 2 * small[:3, inside].std()


def test_a_point_corrects_the_largest_wrong_piece():
    target = np.zeros((64, 64), np.float32)
    target[10:50, 10:50] = 1
    odds = np.where(target > 0, 5.0, -5.0).astype(np.float32)
    rng = np.random.default_rng(0)
    assert correction(odds, target, rng) is None
    odds[12:22, 12:22] = -5.0
    odds[55:60, 55:60] = 5.0
    belongs, (x, y) = correction(odds, target, rng)
    assert belongs
    assert 48 < x < 88
    assert 48 < y < 88
    odds[12:22, 12:22] = 5.0
    belongs, (x, y) = correction(odds, target, rng)
    assert not belongs
    assert 220 < min(x, y) <= max(x, y) < 240
