"""Crowns that the end of the data cuts, at the picture's frame or inside it.

Half a crown is none to the network: of trees within 1.2 m of a cut it told a third. Beside its
mirror image it is whole, so where a field comes near to the end of the data that ground is looked
at once more, mirrored. Where such a tree stands, before the end or behind it, no picture tells: it
is placed where it is seen. All is in working pixels.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from geofield.model.circles import Circles, inside
from geofield.obstacles.crowns import OVERLAP_PX
from geofield.obstacles.picture import WHOLE_PX
from geofield.raster import Image

Mask = NDArray[np.bool_]
Bands = dict[str, Image | float]


def cut_crowns(
    bands: Bands, valid: Mask, region: Mask, near: Mask, look: Callable[[Bands], Circles]
) -> Circles:
    """Return the crowns of a window that the end of the data cuts.

    Parameters
    ----------
    bands : dict
        Of the network, by name; masks are of the same shape (rows, cols).
    valid, region, near : bool array
        Where data are, where the field is, and what is `near_the_end`.
    look : callable
        Returns the crowns in bands.
    """
    row, col = np.nonzero(near & region)
    if not len(row):
        return Circles()
    top, left = (max(v.min() - OVERLAP_PX, 0) // WHOLE_PX * WHOLE_PX for v in (row, col))
    part = np.s_[top : row.max() + 1 + OVERLAP_PX, left : col.max() + 1 + OVERLAP_PX]
    shown = _mirror(valid[part])
    wide = {
        name: band if isinstance(band, float) else band[part][*shown]
        for name, band in bands.items()
    }
    found = _folded(look(wide), shown, valid[part]).scaled(1.0, left, top)
    return found.take(inside(found, near))


def with_cut(crowns: Circles, cut: Circles, share: float, least_px: float) -> Circles:
    """Return crowns and those seen beside their mirror image.

    A crown that was seen as it is keeps its place, which is better known, and takes the strength
    that is greater. How near is the same crown is what `once_each` says.
    """
    if not len(crowns) or not len(cut):
        return crowns.joined(cut)
    tree = cKDTree(np.column_stack([crowns.x_px, crowns.y_px]))
    apart, which = tree.query(np.column_stack([cut.x_px, cut.y_px]))
    larger = np.maximum(cut.radius_px, crowns.radius_px[which])
    same = apart < np.maximum(share * larger, least_px)
    strength = crowns.strength.copy()
    np.maximum.at(strength, which[same], cut.strength[same])
    seen = Circles(crowns.x_px, crowns.y_px, crowns.radius_px, strength)
    return seen.joined(cut.take(~same))


def near_the_end(valid: Mask, ends: tuple[bool, bool, bool, bool], near_px: float) -> Mask:
    """Return the pixels with data that lie near to where data end.

    Parameters
    ----------
    valid : bool array (rows, cols)
    ends : (bool, bool, bool, bool)
        Whether data end at the left, upper, right and lower side, too.
    near_px : float
    """
    none = np.pad(~valid, 1)
    none[:, 0], none[0], none[:, -1], none[-1] = ends
    if not none.any():
        return np.zeros_like(valid)
    side = 2 * int(np.ceil(near_px)) + 1
    around = cv2.boxFilter(
        none.astype(np.float32), -1, (side, side), normalize=False, borderType=cv2.BORDER_REPLICATE
    )
    return np.asarray((around[1:-1, 1:-1] > 0.5) & valid)


def _mirror(valid: Mask) -> NDArray[np.intp]:
    """Return the row and column that each pixel shows, `WHOLE_PX` wider on all sides.

    Where there are data, itself; elsewhere what lies as far on the other side of their end.
    """
    size = np.array(valid.shape)[:, None, None]
    known = np.pad(valid, WHOLE_PX)
    own = np.indices(known.shape)
    nearest = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    away = nearest - own
    # Of a mirror between two pixels one sees the other.
    image = nearest + away - np.sign(away) - WHOLE_PX
    nearest -= WHOLE_PX
    image = np.where(((image >= 0) & (image < size)).all(axis=0), image, nearest)
    return np.asarray(np.where(valid[*image], image, nearest), dtype=np.intp)


def _folded(crowns: Circles, shown: NDArray[np.intp], valid: Mask) -> Circles:
    """Return the crowns that reach to where data end; those of the mirror image in its original."""
    rows, cols = (n - 1 for n in shown.shape[1:])
    row = np.clip(np.floor(crowns.y_px).astype(np.intp), 0, rows)
    col = np.clip(np.floor(crowns.x_px).astype(np.intp), 0, cols)
    known = np.pad(valid, WHOLE_PX)
    reach = ndimage.distance_transform_edt(known)[row, col] < crowns.radius_px
    there = known[row, col]
    y, x = shown[:, row, col] + 0.5
    x = np.where(there, crowns.x_px - WHOLE_PX, x)
    y = np.where(there, crowns.y_px - WHOLE_PX, y)
    return Circles(x, y, crowns.radius_px, crowns.strength).take(reach)
