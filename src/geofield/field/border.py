"""Border: what a picture shows along an outline, and on either side of it, in numbers.

A field's border is strong against what the field has inside, all along it; inside the field
is even, and the outline is plain. All figures are shares, angles or logarithms of strengths
in units of the surface's own variation (see `whiten`), so that they carry over to other
pictures.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from geofield.field.straight import on_frame, ring
from geofield.field.surface import Surface

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: The border is looked for this far from the outline, pixels; and elsewhere for comparison:
#: what stands on the inside and on the outside.
_AT_PX, _INSIDE_PX, _OUTSIDE_PX = (-2.0, 0.0, 2.0), (-7.0, -11.0), (7.0, 11.0)
#: What is compared across a border stands this far from it, pixels.
_ACROSS_PX = 2.5
#: The same for strips beside it.
_STRIP_PX = (4.0, 6.0, 9.0, 12.0)
#: Roughness outside is looked at this far from it, pixels.
_ROUGH_PX = (6.0, 10.0)
#: Steps across a border are averaged along so much of it, pixels; strips along more.
_ALONG_PX, _STRIP_ALONG_PX = 15, 31
#: Most places along an outline that are looked at.
_MOST_PLACES = 800
#: Sides below this length are short, pixels.
_SHORT_PX = 12.0
#: A border below this strength is none that an eye would see.
_FAINT = 2.0

FIGURES = (
    "strength_mean",
    "strength_10",
    "strength_25",
    "strength_50",
    "strength_mean_above_inside",
    "strength_10_above_inside",
    "strength_25_above_inside",
    "strength_50_above_inside",
    "inside_strength",
    "share_like_inside",
    "share_faint",
    "share_stronger_inside",
    "share_stronger_outside",
    "inside_80_above_border",
    "inside_95_above_border",
    "outside_above_border",
    "longest_faint_share",
    "longest_faint_px",
    "strips_10",
    "strips_25",
    "strips_50",
    "strips_whole",
    "rim_strange_50",
    "rim_strange_80",
    "rim_strange_95",
    "around_strange_10",
    "around_strange_25",
    "around_strange_50",
    "share_around_like_rim",
    "texture_step_25",
    "texture_step_50",
    "texture_step_whole",
    "compactness",
    "area_share",
    "frame_share",
    "vertices",
    "convexity",
    "long_sides_share",
    "short_sides_share",
    "area_px",
    "right_angles",
    "interior_50",
    "interior_80",
    "interior_95",
    "interior_99",
    "strength_50_above_interior",
    "strength_25_above_interior",
    "uneven_50",
    "uneven_80",
    "uneven_95",
    "strange_share",
    "rough_inside",
    "rough_outside_above_inside",
)
"""Names of the figures of `measure`, in their order."""


def measure(surface: Surface, outline: Polygon, inside: BoolArray) -> FloatArray | None:
    """The figures of an outline, in the order of `FIGURES`; None for a mere scrap.

    Parameters
    ----------
    surface : Surface
    outline : Polygon
        Pixel coordinates of the surface, no holes.
    inside : bool array (superpixels,)
        The superpixels in it, see `Surface.members`.
    """
    vertices = ring(outline)
    places, outward, frame = _places(vertices, surface.shape)
    if len(places) < 12 or inside.sum() < 5:
        return None
    means = surface.means[:, inside]
    usual = np.array([_median(one) for one in means])
    along, outside_rough = _along(surface, places, outward, usual)
    interior = _interior(surface, inside, means, usual, outside_rough)
    above = [along[at] - interior[1] for at in (3, 2)]
    shape = _shape(outline, vertices, frame, surface.shape)
    return np.array([*along, *shape, *interior[:4], *above, *interior[4:]])


def _places(vertices: FloatArray, shape: tuple[int, int]) -> tuple[FloatArray, FloatArray, float]:
    """Points along an outline, a pixel apart, with outward directions; share on the frame."""
    side = np.roll(vertices, -1, axis=0) - vertices
    length = np.hypot(*side.T)
    steps = np.maximum(np.rint(length).astype(int), (length > 1e-6).astype(int))
    index = np.repeat(np.arange(len(vertices)), steps)
    number = np.arange(len(index)) - np.repeat(np.cumsum(steps) - steps, steps)
    places = vertices[index] + ((number + 0.5) / steps[index])[:, None] * side[index]
    outward = (side[:, ::-1] * [1, -1] / np.maximum(length, 1e-9)[:, None])[index]
    kept = ~on_frame(places, shape, 2.0)
    frame = 1.0 - float(kept.mean())
    places, outward = places[kept], outward[kept]
    if len(places) > _MOST_PLACES:
        chosen = np.linspace(0, len(places) - 1, _MOST_PLACES).astype(int)
        places, outward = places[chosen], outward[chosen]
    return places, outward, frame


def _look(
    surface: Surface, places: FloatArray, outward: FloatArray, away_px: list[float]
) -> NDArray[np.float32]:
    """The layers at distances outward of places, (distances, places, layers)."""
    import cv2

    at = (places + np.array(away_px)[:, None, None] * outward - 0.5).astype(np.float32)
    seen = cv2.remap(
        surface.layers, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(seen, np.float32).reshape(len(away_px), len(places), -1)


def _along(
    surface: Surface, places: FloatArray, outward: FloatArray, usual_inside: FloatArray
) -> tuple[list[float], float]:
    """Strength at the outline, inside and outside it; strips beside it against the interior.

    Also how rough the ground outside is.
    """
    offsets = [*_AT_PX, *_INSIDE_PX, *_OUTSIDE_PX]
    away = [offset + across for across in (-_ACROSS_PX, 0.0, _ACROSS_PX) for offset in offsets]
    strips = [*(-one for one in _STRIP_PX), *_STRIP_PX]
    layers = _look(surface, places, outward, [*away, *strips, *_ROUGH_PX])
    beyond = layers[-len(_ROUGH_PX) :, :, -1]
    seen, count = layers[..., :-1], len(offsets)
    low, middle, high = seen[:count], seen[count : 2 * count], seen[2 * count : 3 * count]
    step, ridge = high - low, middle - 0.5 * (low + high)
    strength = np.maximum(*(_norm(_smoothed(one, _ALONG_PX)) for one in (step, ridge)))
    own, within, outside = (
        strength[part].max(axis=0) for part in (slice(0, 3), slice(3, 5), slice(5, 7))
    )
    noise = max(_median(strength[3:5]), 0.4)
    own_log, base = np.log(own + 0.3), math.log(noise + 0.3)
    mean, quantiles = float(own_log.mean()), _ranked(own_log, [0.1, 0.25, 0.5])
    inner = _ranked(np.log(within + 0.3), [0.8, 0.95]) - mean
    longest = _longest(own < _FAINT)
    half = 3 * count + len(_STRIP_PX)
    rim, around = (
        _smoothed(part.mean(axis=0), _STRIP_ALONG_PX)
        for part in (layers[3 * count : half], layers[half : half + len(_STRIP_PX)])
    )
    step_beside = around - rim
    beside = np.log(_ranked(_norm(step_beside[:, :-1]), [0.1, 0.25, 0.5]) + 0.3)
    texture = np.log(_ranked(np.abs(step_beside[:, -1]), [0.25, 0.5]) + 0.1)
    rim_strange, strange = (_norm(part[:, :-1] - usual_inside) for part in (rim, around))
    return [
        mean,
        *quantiles,
        mean - base,
        *(quantiles - base),
        base,
        float(np.mean(own < 1.5 * noise)),
        float(np.mean(own < _FAINT)),
        float(np.mean(within > own)),
        float(np.mean(outside > own)),
        *inner,
        float(np.log(outside + 0.3).mean()) - mean,
        longest / len(places),
        math.log1p(longest),
        *beside,
        math.log(float(np.linalg.norm(step_beside[:, :-1].mean(axis=0))) + 0.3),
        *np.log(_ranked(rim_strange, [0.5, 0.8, 0.95]) + 0.3),
        *np.log(_ranked(strange, [0.1, 0.25, 0.5]) + 0.3),
        float(np.mean(strange < rim_strange + 0.5)),
        *texture,
        float(step_beside[:, -1].mean()),
    ], _median(beyond)


def _shape(
    outline: Polygon, vertices: FloatArray, frame: float, shape: tuple[int, int]
) -> list[float]:
    """How plain the outline is."""
    side = np.roll(vertices, -1, axis=0) - vertices
    length = np.hypot(*side.T)
    around, area = float(length.sum()), outline.area
    turn = np.exp(4j * np.arctan2(side[:, 1], side[:, 0]))
    return [
        math.log(4 * math.pi * area / around**2),
        math.log(area / (shape[0] * shape[1])),
        frame,
        math.log(len(vertices)),
        area / shapely.convex_hull(outline).area,
        float(length[length >= 0.15 * math.sqrt(area)].sum()) / around,
        float(np.mean(length < _SHORT_PX)),
        math.log(area),
        float(abs(length @ turn)) / around,
    ]


def _interior(
    surface: Surface,
    inside: BoolArray,
    means: FloatArray,
    usual: FloatArray,
    outside_rough: float,
) -> list[float]:
    """Borders within the outline, how uneven and how rough the ground is."""
    first, second, strength = surface.neighbours
    within = strength[inside[first] & inside[second]]
    at = (np.array([0.5, 0.8, 0.95, 0.99]) * len(within)).astype(int)
    inner = np.log(within[at] + 0.3) if len(within) > 5 else np.zeros(4)
    distance = np.linalg.norm(means - usual[:, None], axis=0)
    uneven = np.log(_ranked(distance, [0.5, 0.8, 0.95]) + 0.3)
    rows, columns = surface.centres
    rough = _median(surface.layers[rows[inside], columns[inside], -1])
    return [
        *inner,
        *uneven,
        float(np.mean(distance > 6.0)),
        math.log(rough + 0.3),
        math.log(outside_rough + 0.3) - math.log(rough + 0.3),
    ]


def _smoothed(values: NDArray[np.float32], width: int) -> NDArray[np.float32]:
    """Running means along the places, the axis before the last."""
    count = values.shape[-2]
    at = np.arange(count)
    half = min(width, count) // 2
    low, high = np.maximum(at - half, 0), np.minimum(at + half + 1, count)
    total = np.cumsum(values, axis=-2, dtype=np.float64)
    total = np.concatenate([np.zeros_like(total[..., :1, :]), total], axis=-2)
    mean = (total[..., high, :] - total[..., low, :]) / (high - low)[:, None]
    return np.asarray(mean, np.float32)


def _norm(values: NDArray[np.floating]) -> NDArray[np.float32]:
    return np.asarray(np.sqrt(np.einsum("...c,...c->...", values, values)))


def _ranked(values: NDArray[np.floating], shares: list[float]) -> NDArray[np.float64]:
    """The values below which these shares of all lie; quicker than interpolating."""
    ordered = np.sort(values)
    at = (np.array(shares) * len(ordered)).astype(int)
    return np.asarray(ordered[at], float)


def _median(values: NDArray[np.floating]) -> float:
    """The same as NumPy's, without its care for what these arrays never hold."""
    ordered = np.sort(values, axis=None)
    return float(ordered[(len(ordered) - 1) // 2 : len(ordered) // 2 + 1].mean())


def _longest(flags: BoolArray) -> int:
    """Length of the longest run."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return int(np.max(edges[1::2] - edges[::2])) if len(edges) else 0
