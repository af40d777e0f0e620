"""The same picture in files that run another way."""

import dataclasses

from affine import Affine

import geofield as gf

TURNS = {
    "south-up": lambda a, t, w, h: (a[..., ::-1, :], t @ Affine(1, 0, 0, 0, -1, h)),
    "west": lambda a, t, w, h: (a[..., ::-1], t @ Affine(-1, 0, w, 0, 1, 0)),
    "half": lambda a, t, w, h: (a[..., ::-1, ::-1], t @ Affine(-1, 0, w, 0, -1, h)),
    "quarter": lambda a, t, w, h: (
        a.swapaxes(-1, -2)[..., ::-1],
        t @ Affine(0, 1, 0, 1, 0, 0) @ Affine(-1, 0, h, 0, 1, 0),
    ),
    "exchanged": lambda a, t, w, h: (a.swapaxes(-1, -2), t @ Affine(0, 1, 0, 1, 0, 0)),
}


def turned(scene, turn):
    """The same picture in a file that runs another way."""
    grid = scene.grid
    size = grid.width_px, grid.height_px
    bands, transform = TURNS[turn](scene.bands, grid.transform, *size)
    valid, _ = TURNS[turn](scene.valid, grid.transform, *size)
    other = gf.Grid(bands.shape[2], bands.shape[1], transform, grid.crs)
    return dataclasses.replace(scene, grid=other, bands=bands.copy(), valid=valid.copy())
