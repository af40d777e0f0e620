"""Things that stand in fields, painted into pictures: posts, walls, barns, trucks, heaps, ponds.

No labelled pictures of them exist; their outlines and shadows are simple enough to draw. Each
stands clear of the labelled trees, throws a shadow where it has height, and is as bright or dark
as chance has it. What only lies on the ground (wheel marks, wet spots, bare patches, plots) is
drawn as often and counts as nothing.
"""

from __future__ import annotations

import cv2
import numpy as np

CLEAR_PX, APART_PX = 11.0, 15.0
"""Between a thing and a tree's or another's middle, and what the smaller ones add to it."""
LARGEST = {"pond": 6.5, "barn": 1.3, "heap": 2.5, "bush": 2.0, "hut": 2.0, "yard": 1.8}
"""Half of the things (ponds and barns: all) are up to so much larger, others 1.3 times: a network
sees sizes it learned."""
KINDS = (*("post", "wall", "yard", "hut", "truck", "heap"), *3 * ("bush",), *2 * ("pond", "barn"))
TRIES = 4
Thing = tuple[list[np.ndarray], float, str]
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def place_things(
    rng: np.random.Generator, image: np.ndarray, trees: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the picture (rows, cols, 4; 0..255) with things, what they cover, what changed."""
    side = image.shape[0]
    cover = np.zeros((side, side), np.float32)
    sun = rng.uniform(0, 2 * np.pi)
    before, image = image, image.copy()
    taken = [(x, y, APART_PX) for x, y in trees[:, :2]]
    things = [None if rng.random() < 0.45 else outline(rng) for _ in range(rng.integers(3, 14))]
    # What needs most room looks for it first.
    for thing in sorted(things, key=reach_of, reverse=True):
        reach = reach_of(thing)
        for at in rng.uniform(10, side - 10, (TRIES, 2)):
            apart = (np.hypot(at[0] - x, at[1] - y) - max(reach, r) for x, y, r in taken)
            if free[int(at[1]), int(at[0])] and min(apart, default=np.inf) >= CLEAR_PX:
                break
        else:
            continue
        taken.append((*at, reach))
        local = image[int(at[1]) - 6 : int(at[1]) + 7, int(at[0]) - 6 : int(at[0]) + 7]
        ground = local.mean(axis=(0, 1))
        if thing is None:
            mark(rng, image, at)
        else:
            shapes, height, kind = thing
            placed = [shape + at for shape in shapes], height, kind
            stand(rng, image, cover, at, placed, colours(rng, ground, kind), sun)
    changed = (np.abs(image - before).max(axis=2) > 2).astype(np.float32)
    return image, cover, np.maximum(cv2.dilate(changed, np.ones((9, 9))), cover)


def reach_of(thing: Thing | None) -> float:
    """Return how far a thing reaches from its middle, pixels; a mark on the ground is small."""
    if thing is None:
        return APART_PX
    return max(APART_PX, *(float(np.hypot(*shape.T).max()) for shape in thing[0]))


def drawn(side: int, polygons: list[np.ndarray], blur: float) -> np.ndarray:
    """Return the share of each pixel inside polygons, softened."""
    mask = np.zeros((side, side), np.uint8)
    for polygon in polygons:
        cv2.fillPoly(mask, [np.rint(polygon * 16).astype(np.int32)], 255, cv2.LINE_AA, 4)
    soft = mask.astype(np.float32) / 255
    return cv2.GaussianBlur(soft, (0, 0), blur) if blur > 0.2 else soft


def outline(rng: np.random.Generator) -> Thing:
    """Return a thing's outline around zero, in parts, its height in pixels and its kind."""
    kind = str(rng.choice(KINDS))
    turn = rng.uniform(0, np.pi)
    if kind == "post":
        half, height = (rng.uniform(0.5, 1.3),) * 2, rng.uniform(4, 16)
    elif kind == "wall":
        half, height = (rng.uniform(8, 35), rng.uniform(0.5, 1.4)), rng.uniform(1.2, 4)
    elif kind == "yard":
        half, height = (rng.uniform(4, 14), rng.uniform(4, 10)), rng.uniform(1.5, 5)
    elif kind == "hut":
        half, height = (rng.uniform(3, 11), rng.uniform(3, 8)), rng.uniform(3, 8)
    elif kind == "barn":
        # As often large as small, for inside a large one nothing tells of its edge.
        size = rng.uniform(1.0, 2.4)
        half = (rng.uniform(8, 26) * size, rng.uniform(5, 15) * size)
        height = rng.uniform(5, 16)
    elif kind == "truck":
        half, height = (rng.uniform(3.5, 9), rng.uniform(1.6, 2.4)), rng.uniform(3, 6)
    else:
        half, height = (rng.uniform(1.5, 8), rng.uniform(1.5, 6)), rng.uniform(1, 4)
    larger = rng.uniform(0, np.log(LARGEST.get(kind, 1.3)))
    larger *= kind in ("pond", "barn") or rng.random() < 0.5
    half = (half[0] * np.exp(larger), half[1] * (1 if kind == "wall" else np.exp(larger)))
    parts = [blob(rng) * half]
    if kind in ("post", "wall", "hut", "truck", "barn"):
        parts = [SQUARE * half]
    elif kind == "yard":
        parts = walls(half, rng.uniform(0.5, 1.2), int(rng.integers(2, 5)))
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return [p @ rotation.T for p in parts], 0.0 if kind == "pond" else height, kind


def walls(half: tuple[float, ...], thick: float, count: int) -> list[np.ndarray]:
    """Return some of the four walls around a yard or of a ruin."""
    a, b = half
    sides = [
        ((a, thick), (0, b)),
        ((thick, b), (a, 0)),
        ((a, thick), (0, -b)),
        ((thick, b), (-a, 0)),
    ]
    return [SQUARE * size + np.array(place) for size, place in sides[:count]]


def blob(rng: np.random.Generator) -> np.ndarray:
    """Return a round outline with a few soft bulges, about one in radius."""
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    radius = np.ones(24)
    for k in (2, 3, 4):
        radius += rng.normal(0, 0.12) * np.cos(k * angle + rng.uniform(0, 6))
    return np.column_stack([np.cos(angle), np.sin(angle)]) * radius[:, None]


def stand(
    rng: np.random.Generator,
    image: np.ndarray,
    cover: np.ndarray,
    at: np.ndarray,
    thing: Thing,
    colour: np.ndarray,
    sun: float,
) -> None:
    """Draw a thing that stands, its shadow first."""
    side = image.shape[0]
    shapes, height, kind = thing
    blur = rng.uniform(0.3, 0.9)
    if height > 0 and rng.random() < 0.9:
        length = height * rng.uniform(0.4, 1.3)
        step = np.array([np.cos(sun), np.sin(sun)])
        along = np.linspace(0, length, max(int(length * 2), 2))
        parts = [shape + step * d for shape in shapes for d in along]
        dark = drawn(side, parts, blur)
        image *= (1 - dark * rng.uniform(0.35, 0.7))[..., None]
    body = drawn(side, shapes, blur)
    relief = np.ones((side, side), np.float32)
    if kind in ("heap", "bush"):
        y, x = np.mgrid[:side, :side].astype(np.float32)
        slope = (x - at[0]) * np.cos(sun) + (y - at[1]) * np.sin(sun)
        relief -= np.clip(slope * rng.uniform(0.02, 0.08), -0.35, 0.35)
        rough = cv2.GaussianBlur(rng.standard_normal((side, side), dtype=np.float32), (0, 0), 0.8)
        relief += rough * rng.uniform(0.05, 0.3)
    elif kind in ("hut", "truck") and rng.random() < 0.6:
        # Half a roof lies in shade; a truck's cab has a colour of its own.
        a, b, c, d = shapes[0]
        cut = 0.5 if kind == "hut" else rng.uniform(0.2, 0.4)
        ends = [b + (a - b) * cut, b, c, c + (d - c) * cut]
        half = drawn(side, [np.vstack(ends)], 0.3)
        relief -= half * rng.uniform(0.1, 0.35) * (1 if kind == "hut" else rng.choice([-2, 1]))
    elif kind == "barn":
        relief *= roof(rng, side, shapes[0])
    image += (colour * relief[..., None] - image) * body[..., None]
    np.clip(image, 0, 255, out=image)
    np.maximum(cover, (body > 0.35).astype(np.float32), out=cover)


def roof(rng: np.random.Generator, side: int, corners: np.ndarray) -> np.ndarray:
    """Return how bright a roof is: one slope in shade, sheets, skylights, dirt, a part built on."""
    a, b, c, d = corners
    relief = np.ones((side, side), np.float32)
    if rng.random() < 0.7:
        ridge = rng.uniform(0.35, 0.65)
        shaded = drawn(side, [np.vstack([a, b, b + (c - b) * ridge, a + (d - a) * ridge])], 0.3)
        relief -= shaded * rng.uniform(0.03, 0.35)
    way, length = (b - a) / max(np.hypot(*(b - a)), 1e-6), float(np.hypot(*(b - a)))
    y, x = np.mgrid[:side, :side].astype(np.float32)
    along = (x - a[0]) * way[0] + (y - a[1]) * way[1]
    if rng.random() < 0.5:
        sheet = rng.uniform(2.5, 9)
        relief *= 1 + rng.uniform(0, 0.08) * np.sign(np.sin(2 * np.pi * along / sheet))
    if rng.random() < 0.4:
        # A part with a roof of its own.
        relief *= 1 + (along < length * rng.uniform(0.2, 0.8)) * rng.uniform(-0.3, 0.3)
    for _ in range(rng.integers(0, 6) if rng.random() < 0.5 else 0):
        u, v = rng.uniform(0.1, 0.9, 2)
        spot = SQUARE * rng.uniform(0.6, 2.5, 2) + a + (b - a) * u + (d - a) * v
        relief *= 1 + drawn(side, [spot], 0.4) * rng.uniform(-0.6, 0.8)
    dirt = cv2.GaussianBlur(
        rng.standard_normal((side, side), dtype=np.float32), (0, 0), rng.choice([0.7, 2.5, 8])
    )
    strength = float(rng.uniform(0, 0.05)) / max(float(dirt.std()), 1e-6)
    return np.clip(relief * (1 + dirt * strength), 0.3, 2)


def colours(rng: np.random.Generator, ground: np.ndarray, kind: str) -> np.ndarray:
    """Return a colour (red, green, blue, near infrared) that differs from the ground's."""
    bright = ground[:3].mean()
    if kind == "bush":
        base = bright * rng.uniform(0.35, 0.75)
        colour = base * np.array(
            [rng.uniform(0.8, 1.05), 1.05, rng.uniform(0.7, 0.95), rng.uniform(1.2, 2.2)]
        )
    elif kind == "pond":
        base = rng.uniform(15, 90) if rng.random() < 0.8 else rng.uniform(150, 240)
        colour = base * np.array([0.85, 1.0, rng.uniform(0.9, 1.2), rng.uniform(0.2, 0.6)])
    else:
        base = bright
        # A roof has its shape and its shadow, too.
        while abs(base - bright) < (12 if kind == "barn" else 28):
            base = rng.uniform(25, 250)
        cast = np.exp(rng.normal(0, 0.3 if kind == "barn" and rng.random() < 0.5 else 0.15, 4))
        colour = base * cast
    return np.clip(colour, 0, 255).astype(np.float32)


def mark(rng: np.random.Generator, image: np.ndarray, at: np.ndarray) -> None:
    """Draw what only lies on the ground: wheel marks, plots, wet spots, bare patches."""
    side = image.shape[0]
    kind = rng.random()
    if kind < 0.4:
        turn, bend = rng.uniform(0, np.pi), rng.normal(0, 0.004)
        along = np.linspace(-120, 120, 40)
        line = np.column_stack([along, bend * along**2])
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        soft = np.zeros((side, side), np.float32)
        width = rng.uniform(0.4, 0.9)
        for gap in (0, rng.uniform(2.5, 4)):
            path = (line + np.array([0, gap])) @ rotation.T + at
            half = np.array([0, width])
            both = np.vstack([path + half, path[::-1] - half])
            soft = np.maximum(soft, drawn(side, [both], 0.6))
        strength = rng.uniform(0.05, 0.22)
    elif kind < 0.6:
        # A plot of another crop or of turned soil: as straight as a roof, and flat.
        turn = rng.uniform(0, np.pi)
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        half = np.exp(rng.uniform(np.log(6), np.log(60), 2))
        soft = drawn(side, [SQUARE * half @ rotation.T + at], rng.uniform(0.4, 1.5))
        strength = rng.uniform(0.08, 0.35)
    else:
        larger = np.exp(rng.uniform(0, np.log(3)))
        shape = blob(rng) * rng.uniform(3, 16, 2) * larger + at
        soft = drawn(side, [shape], rng.uniform(1.5, 5) * larger)
        if rng.random() < 0.5:
            # Weeds, litter and washed soil have no one edge.
            grains = cv2.GaussianBlur(
                rng.standard_normal((side, side), dtype=np.float32), (0, 0), rng.uniform(1, 6)
            )
            soft *= np.clip(0.5 + grains / max(float(grains.std()), 1e-6) * 0.5, 0, 1.5)
        strength = rng.uniform(0.08, 0.3)
    change = strength * rng.choice([-1, 1]) * np.exp(rng.normal(0, 0.25, 4))
    image *= 1 + (soft[..., None] * change).astype(np.float32)
    np.clip(image, 0, 255, out=image)
