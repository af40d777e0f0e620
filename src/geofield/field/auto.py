"""Auto: the field around a point from colour, near infrared and edges at several scales."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from geofield.errors import FieldError
from geofield.field.choice import SMALLEST_SHARE, Candidate, candidates, certainty, scores
from geofield.field.evidence import channels, gradient, whiten
from geofield.field.hierarchy import MergeTree, merge
from geofield.field.refine import enlarge, snap
from geofield.field.segmentation import Segmentation
from geofield.field.superpixels import borders, superpixels
from geofield.model import Scene

#: The hierarchy works on a picture reduced to at most this many pixels a side.
COARSE_PX = 400
#: Side of a superpixel's cell, pixels.
STEP_PX = 5
#: How far from the seed open ground is looked for, pixels.
_STRAY_PX = 20
#: A border weaker than this, in units of what the field has inside, is none.
_WEAK = 1.6


def segment(scene: Scene, x_px: float, y_px: float) -> Segmentation:
    """The field around a pixel position.

    Parameters
    ----------
    scene : Scene
    x_px, y_px : float
        The seed, pixel coordinates.
    """
    rows, columns = scene.grid.shape
    factor = max(1, math.ceil(max(rows, columns) / COARSE_PX))
    seed = (x_px / factor, y_px / factor)
    raw = channels(scene, factor)
    stack = whiten(raw, seed)
    labels = superpixels(gradient(stack), STEP_PX)
    count = int(labels.max()) + 1
    lines = borders(labels, stack)
    if not len(lines.first):
        raise FieldError("The picture is too small to find a field in.")
    pairs = lines.pairs(count)
    sizes = np.bincount(labels.ravel(), minlength=count).astype(float)
    tree = merge(sizes, *pairs)
    ground = footing(labels, tree, seed)
    found = candidates(labels, tree, lines, pairs, ground)
    if not found:
        # Nothing stands out of anything: one surface fills the picture.
        return Segmentation(scene.valid, ("no border was found anywhere",), (("certainty", 0.0),))
    score = scores(found)
    best = int(np.argmax(score))
    chosen = found[best]
    mask = _finer(scene, chosen, stack, factor, ground)
    notes, figures = _evidence(chosen, certainty(found, score, best))
    if ground != seed:
        notes = ("the point lies on something small (a tree, a hut, a track?)", *notes)
    return Segmentation(mask & scene.valid, notes, figures)


def footing(
    labels: NDArray[np.int32], tree: MergeTree, seed: tuple[float, float]
) -> tuple[float, float]:
    """The seed, or the nearest place on open ground where it is on a crown or the like."""
    x, y = int(seed[0]), int(seed[1])
    smallest = max(200.0, SMALLEST_SHARE * labels.size)
    if not tree.is_speck(int(labels[y, x]), smallest):
        return seed
    top, left = max(y - _STRAY_PX, 0), max(x - _STRAY_PX, 0)
    near = labels[top : y + _STRAY_PX + 1, left : x + _STRAY_PX + 1]
    row, column = np.indices(near.shape)
    distance = np.hypot(row + top - y, column + left - x).ravel()
    order = np.argsort(distance, kind="stable")
    specks: dict[int, bool] = {}
    for place in order:
        leaf = int(near.ravel()[place])
        if leaf not in specks:
            specks[leaf] = tree.is_speck(leaf, smallest)
        if not specks[leaf]:
            down, right = divmod(int(place), near.shape[1])
            return (left + right + 0.5, top + down + 0.5)
    return seed


def _finer(
    scene: Scene,
    chosen: Candidate,
    coarse: NDArray[np.float32],
    factor: int,
    seed: tuple[float, float],
) -> NDArray[np.bool_]:
    """The chosen mask at the picture's own pixels, in steps of at most four."""
    mask, holes = snap(chosen.mask, coarse, 2.5), chosen.holes
    size = factor
    while size > 1:
        finer = 1 if size <= 4 else math.ceil(size / 4)
        fine = channels(scene, finer)
        shape = fine.shape[1:]
        mask = _resize(mask, size / finer, shape)
        holes = _resize(holes, size / finer, shape)
        mask = snap(
            mask,
            whiten(fine, (seed[0] * factor / finer, seed[1] * factor / finer)),
            1.5 * size / finer,
        )
        size = finer
    return mask & ~holes


def _resize(mask: NDArray[np.bool_], ratio: float, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    if ratio == int(ratio):
        return enlarge(mask, int(ratio), (shape[0], shape[1]))
    row = np.minimum(((np.arange(shape[0]) + 0.5) / ratio).astype(int), mask.shape[0] - 1)
    column = np.minimum(((np.arange(shape[1]) + 0.5) / ratio).astype(int), mask.shape[1] - 1)
    return mask[np.ix_(row, column)]


def _evidence(
    chosen: Candidate, certain: float
) -> tuple[tuple[str, ...], tuple[tuple[str, float], ...]]:
    f = chosen.figures
    contrast = f["outline50"] / f["i50"]
    weakest = f["outline20"] / f["i50"]
    notes = []
    if contrast < _WEAK:
        notes.append("its border hardly differs from what lies inside")
    elif weakest < _WEAK:
        notes.append("a fifth of its border or more is weak")
    if certain < 0.5:
        notes.append(f"other outlines are as likely (certainty {certain:.0%})")
    return tuple(notes), (
        ("certainty", certain),
        ("border_contrast", contrast),
        ("weakest_fifth", weakest),
        ("straightness", f["straight"]),
    )
