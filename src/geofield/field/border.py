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

from geofield.field.frame import Frame
from geofield.field.median import median
from geofield.field.straight import ring
from geofield.field.surface import Surface
from geofield.raster import bilinear

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


def measure(surface: Surface, outline: Polygon, inside: BoolArray) -> dict[str, float] | None:
    """The figures of an outline by name; None for a mere scrap.

    Parameters
    ----------
    surface : Surface
    outline : Polygon
        Pixel coordinates of the surface, no holes.
    inside : bool array (superpixels,)
        The superpixels in it, see `Surface.members`.
    """
    vertices = ring(outline)
    side = np.concatenate([vertices[1:], vertices[:1]]) - vertices
    length = np.hypot(*side.T)
    places, outward, framed = _places(vertices, side, length, surface.frame)
    if len(places) < 12 or inside.sum() < 5:
        return None
    means = surface.means[:, inside]
    usual = median(means)
    along = _along(surface, places, outward, usual)
    interior = _interior(surface, inside, means, usual)
    interior["rough_outside_above_inside"] = along.pop("rough_outside") - interior["rough_inside"]
    for share in (50, 25):
        above = along[f"strength_{share}"] - interior["interior_80"]
        interior[f"strength_{share}_above_interior"] = above
    return along | _shape(outline, side, length, framed, surface.frame.area_px) | interior


def _places(
    vertices: FloatArray, side: FloatArray, length: FloatArray, frame: Frame
) -> tuple[FloatArray, FloatArray, float]:
    """Points along an outline, a pixel apart, with outward directions; share on the frame."""
    steps = np.maximum(np.rint(length).astype(int), (length > 1e-6).astype(int))
    index = np.repeat(np.arange(len(vertices)), steps)
    number = np.arange(len(index)) - np.repeat(np.cumsum(steps) - steps, steps)
    places = vertices[index] + ((number + 0.5) / steps[index])[:, None] * side[index]
    outward = (side[:, ::-1] * [1, -1] / np.maximum(length, 1e-9)[:, None])[index]
    kept = ~frame.near(places, 2.0)
    framed = 1.0 - _share(kept)
    places, outward = places[kept], outward[kept]
    if len(places) > _MOST_PLACES:
        chosen = np.linspace(0, len(places) - 1, _MOST_PLACES).astype(int)
        places, outward = places[chosen], outward[chosen]
    return places, outward, framed


def _look(
    surface: Surface, places: FloatArray, outward: FloatArray, away_px: list[float]
) -> NDArray[np.float32]:
    """The layers at distances outward of places, (distances, places, layers)."""
    away = np.array(away_px)[:, None]
    x, y = (place + away * out for place, out in zip(places.T, outward.T, strict=True))
    return bilinear(surface.layers, x, y)


def _along(
    surface: Surface, places: FloatArray, outward: FloatArray, usual_inside: FloatArray
) -> dict[str, float]:
    """Strength at the outline, inside and outside it; strips beside it against the interior."""
    offsets = [*_AT_PX, *_INSIDE_PX, *_OUTSIDE_PX]
    away = [offset + across for across in (-_ACROSS_PX, 0.0, _ACROSS_PX) for offset in offsets]
    strips = [*(-one for one in _STRIP_PX), *_STRIP_PX]
    layers = _look(surface, places, outward, [*away, *strips, *_ROUGH_PX])
    across, beside, beyond = np.split(layers, [len(away), len(away) + len(strips)])
    low, middle, high = across.reshape(3, len(offsets), *across.shape[1:])
    steps = np.stack([high - low, middle - 0.5 * (low + high)])
    strength = _norm(_smoothed(steps, _ALONG_PX)[..., :-1]).max(axis=0)
    own, within, outside = (
        strength[part].max(axis=0) for part in (slice(0, 3), slice(3, 5), slice(5, 7))
    )
    noise = max(float(median(strength[3:5].ravel())), 0.4)
    own_log, base = np.log(own + 0.3), math.log(noise + 0.3)
    mean, quantiles = float(own_log.mean()), _ranked(own_log, [0.1, 0.25, 0.5])
    inner = _ranked(np.log(within + 0.3), [0.8, 0.95]) - mean
    longest = _longest(own < _FAINT)
    # The field's rim, and what is around it.
    strip = _smoothed(beside.reshape(2, -1, *beside.shape[1:]).mean(axis=1), _STRIP_ALONG_PX)
    step = strip[1] - strip[0]
    step_beside = np.log(_ranked(_norm(step[:, :-1]), [0.1, 0.25, 0.5]) + 0.3)
    texture = np.log(_ranked(np.abs(step[:, -1]), [0.25, 0.5]) + 0.1)
    rim_strange, strange = _norm(strip[..., :-1] - usual_inside)
    return {
        "strength_mean": mean,
        **_named("strength", (10, 25, 50), quantiles),
        "strength_mean_above_inside": mean - base,
        **_named("strength", (10, 25, 50), quantiles - base, "_above_inside"),
        "inside_strength": base,
        "share_like_inside": _share(own < 1.5 * noise),
        "share_faint": _share(own < _FAINT),
        "share_stronger_inside": _share(within > own),
        "share_stronger_outside": _share(outside > own),
        **_named("inside", (80, 95), inner, "_above_border"),
        "outside_above_border": float(np.log(outside + 0.3).mean()) - mean,
        "longest_faint_share": longest / len(places),
        "longest_faint_px": math.log1p(longest),
        **_named("strips", (10, 25, 50), step_beside),
        "strips_whole": math.log(float(np.linalg.norm(step[:, :-1].mean(axis=0))) + 0.3),
        **_named("rim_strange", (50, 80, 95), np.log(_ranked(rim_strange, [0.5, 0.8, 0.95]) + 0.3)),
        **_named("around_strange", (10, 25, 50), np.log(_ranked(strange, [0.1, 0.25, 0.5]) + 0.3)),
        "share_around_like_rim": _share(strange < rim_strange + 0.5),
        **_named("texture_step", (25, 50), texture),
        "texture_step_whole": float(step[:, -1].mean()),
        "rough_outside": math.log(float(median(beyond[..., -1].ravel())) + 0.3),
    }


def _shape(
    outline: Polygon,
    side: FloatArray,
    length: FloatArray,
    framed: float,
    picture_px: float,
) -> dict[str, float]:
    """How plain the outline is."""
    around, area = float(length.sum()), outline.area
    turn = np.exp(4j * np.arctan2(side[:, 1], side[:, 0]))
    return {
        "compactness": math.log(4 * math.pi * area / around**2),
        "area_share": math.log(area / picture_px),
        "frame_share": framed,
        "vertices": math.log(len(side)),
        "convexity": area / shapely.convex_hull(outline).area,
        "long_sides_share": float(length[length >= 0.15 * math.sqrt(area)].sum()) / around,
        "short_sides_share": _share(length < _SHORT_PX),
        "area_px": math.log(area),
        "right_angles": float(abs(length @ turn)) / around,
    }


def _interior(
    surface: Surface,
    inside: BoolArray,
    means: FloatArray,
    usual: FloatArray,
) -> dict[str, float]:
    """Borders within the outline, how uneven and how rough the ground is."""
    first, second, strength = surface.neighbours
    within = strength[inside[first] & inside[second]]
    at = (np.array([0.5, 0.8, 0.95, 0.99]) * len(within)).astype(int)
    inner = np.log(within[at] + 0.3) if len(within) > 5 else np.zeros(4)
    distance = np.linalg.norm(means - usual[:, None], axis=0)
    uneven = np.log(_ranked(distance, [0.5, 0.8, 0.95]) + 0.3)
    rows, columns = surface.centres
    rough = float(median(surface.layers[rows[inside], columns[inside], -1]))
    return {
        **_named("interior", (50, 80, 95, 99), inner),
        **_named("uneven", (50, 80, 95), uneven),
        "strange_share": _share(distance > 6.0),
        "rough_inside": math.log(rough + 0.3),
    }


def _named(
    name: str, shares: tuple[int, ...], values: NDArray[np.floating], more: str = ""
) -> dict[str, float]:
    """Quantiles by name and share in per cent."""
    return {
        f"{name}_{share}{more}": float(value) for share, value in zip(shares, values, strict=True)
    }


def _smoothed(values: NDArray[np.float32], width: int) -> NDArray[np.float32]:
    """Running means along the places, the axis before the last; shorter ones at the ends."""
    import cv2

    count = values.shape[-2]
    half = min(width, count) // 2
    at = np.arange(count)
    held = np.minimum(at, half) + np.minimum(at[::-1], half) + 1
    total = cv2.boxFilter(
        values.reshape(-1, *values.shape[-2:]),
        cv2.CV_64F,
        (2 * half + 1, 1),
        normalize=False,
        borderType=cv2.BORDER_CONSTANT,
    )
    return np.asarray(total.reshape(values.shape) / held[:, None], np.float32)


def _norm(values: NDArray[np.floating]) -> NDArray[np.float32]:
    return np.asarray(np.sqrt(np.einsum("...c,...c->...", values, values)))


def _share(flags: BoolArray) -> float:
    return np.count_nonzero(flags) / len(flags)


def _ranked(values: NDArray[np.floating], shares: list[float]) -> NDArray[np.float64]:
    """The values below which these shares of all lie; quicker than interpolating."""
    ordered = np.sort(values)
    at = (np.array(shares) * len(ordered)).astype(int)
    return np.asarray(ordered[at], float)


def _longest(flags: BoolArray) -> int:
    """Length of the longest run."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return int(np.max(edges[1::2] - edges[::2])) if len(edges) else 0
