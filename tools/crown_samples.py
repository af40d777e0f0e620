"""Training samples: crops of the pictures, turned, scaled, spoiled, and their labels.

Coordinates are pixels from the corner of the top-left pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from crown_pictures import site_of
from crown_targets import targets
from fine_pictures import RESOLUTION_M
from lossy import through_jpeg
from scipy.spatial.distance import cdist
from standing_things import place_things

from geofield.obstacles.picture import WORKING_RESOLUTION_M

INPUTS = ("red", "green", "blue", "nir", "has_nir")
OUTPUTS = ("centre", "dx", "dy", "log_radius", "cover", "other")
CHIP_RESOLUTION_M = 0.6
CROP_PX = 192
ENLARGED = 1.05 * CHIP_RESOLUTION_M / WORKING_RESOLUTION_M
"""Lessons show chips so much larger on average: a little more than the working grid does."""
PAINTED = 0.5
"""Share of the samples of open land that things are painted into."""
CALM, HARD, ROOF_PX = 7.0, 14.0, 9000
"""Grey differs by less on calm ground, by more at hard edges; so many pixels may be a roof."""
SPOILED = 0.65
"""Share of the samples that are of another camera, light or file than the chips."""
FINE_SHARE = 0.2
"""Share of the samples that are of fine pictures."""
BORDER_PX = 2.0
"""Crowns on the picture's border may be cut off, their centres outside."""
UNMEASURED_PX, SHADED = 8.0, 0.72
"""The radius of a tree without one; a shadow is darker than so much of the ground."""
SAME_PX, UNSURE_PX = 10.0, 6
"""Nearer labels of two years are one tree; so far around one that is lacking nothing counts."""


@dataclass
class Pictures:
    """All pictures in memory."""

    names: np.ndarray
    left_out: np.ndarray
    bands: np.ndarray
    regions: np.ndarray
    trees: list[np.ndarray]

    @classmethod
    def read(cls, path: Path) -> Pictures:
        with np.load(path) as data:
            number, trees = data["trees"][:, 0].astype(int), data["trees"][:, 1:]
            bands = np.ascontiguousarray(data["bands"].transpose(0, 2, 3, 1))
            of_each = [trees[number == i] for i in range(len(bands))]
            regions = np.unpackbits(data["regions"], axis=-1)
            elsewhen = labelled_elsewhen(data["names"], of_each)
            for region, lacking in zip(regions, elsewhen, strict=True):
                for x, y in lacking:
                    cv2.circle(region, (int(x), int(y)), UNSURE_PX, 0, -1)
            return cls(data["names"], data["left_out"], bands, regions, of_each)

    @property
    def simulated(self) -> np.ndarray:
        return np.char.startswith(self.names, "simulated")

    @property
    def fine(self) -> np.ndarray:
        return np.char.startswith(self.names, "fine")

    def weights(self) -> np.ndarray:
        """Return how often each picture is drawn: open and green land more often."""
        count = np.array([len(t) for t in self.trees])
        weight = np.where(count < 40, 1.6, 1.0)
        green = zip(self.bands, self.trees, strict=True)
        weight += 2 * np.array([green_ground(bands, trees) for bands, trees in green])
        weight[self.simulated] = 2.0
        weight[self.left_out] = 0
        if self.fine.any():
            others = weight[~self.fine].sum()
            # Parts of one picture are much alike.
            names = [str(name).rsplit("_", 2)[0] for name in self.names[self.fine]]
            rare = np.array([3.0 if names.count(name) == 1 else 1.0 for name in names])
            weight[self.fine] = others * FINE_SHARE / (1 - FINE_SHARE) * rare / rare.sum()
        return weight / weight.sum()


def labelled_elsewhen(names: np.ndarray, trees: list[np.ndarray]) -> list[np.ndarray]:
    """Return where each picture lacks a tree that other years of its place are labelled with.

    One label in nine lies nowhere near one of another year: trees come and go, but more often one
    was overlooked.
    """
    places = [site_of(str(name)) for name in names]
    out = []
    for number, place in enumerate(places):
        years = [] if place.startswith(("simulated", "fine")) else places
        others = [trees[i][:, :2] for i, one in enumerate(years) if one == place and i != number]
        xy = np.concatenate([np.empty((0, 2)), *others])
        here = trees[number][:, :2]
        near = cdist(xy, here).min(axis=1, initial=np.inf) if len(xy) else np.empty(0)
        out.append(xy[near > SAME_PX])
    return out


def green_ground(bands: np.ndarray, trees: np.ndarray) -> float:
    """Return the share of a picture that is green and no crown: lawn, pasture, crop."""
    red, nir = bands[..., 0].astype(np.float32), bands[..., 3].astype(np.float32)
    free = np.ones(red.shape, np.uint8)
    for x, y, _ in trees:
        cv2.circle(free, (int(x), int(y)), 9, 0, -1)
    return float(((nir - red > 0.15 * (nir + red)) & (free > 0)).mean())


def spread(image: np.ndarray) -> np.ndarray:
    """Return how much grey differs within a few pixels."""
    grey = image[..., :3].mean(axis=2)
    mean = cv2.blur(grey, (9, 9))
    return np.sqrt(np.maximum(cv2.blur(grey * grey, (9, 9)) - mean * mean, 0))


def calm(image: np.ndarray) -> np.ndarray:
    """Return where hardly anything can stand: no edges within a few pixels."""
    return spread(image) < CALM


def ground(image: np.ndarray) -> np.ndarray:
    """Return calm pixels without small pieces of them that have hard edges: those may be roofs."""
    edges = spread(image)
    _, parts, found, _ = cv2.connectedComponentsWithStats((edges < CALM).astype(np.uint8))
    around = np.where(parts > 0, 0, cv2.dilate(parts.astype(np.float32), np.ones((7, 7))))
    around = around.astype(np.intp).ravel()
    hard = np.bincount(around, edges.ravel(), len(found)) > HARD * np.bincount(
        around, minlength=len(found)
    )
    roofs = hard & (found[:, cv2.CC_STAT_AREA] < ROOF_PX)
    roofs[0] = True
    return ~roofs[parts]


def water(image: np.ndarray) -> np.ndarray:
    """Return what may be water: darker in near infrared than in green. It is calm, too."""
    return image[..., 3] <= 0.8 * image[..., 1]


def shadows(image: np.ndarray, trees: np.ndarray) -> np.ndarray:
    """Return what hangs together with a tree on even ground and is darker: its shadow, no thing."""
    grey = np.ascontiguousarray(image[..., :3].mean(axis=2))
    even = calm(image)
    found = np.zeros(grey.shape, bool)
    for x, y, radius in trees:
        reach = radius if np.isfinite(radius) else UNMEASURED_PX
        wide, near, crown = (
            cv2.circle(np.zeros(grey.shape, np.uint8), (int(x), int(y)), int(k * reach), 1, -1) > 0
            for k in (4, 3, 1)
        )
        ground = wide & ~near
        if not ground.any() or even[ground].mean() < 0.5:
            continue
        dark = near & (grey < SHADED * np.median(grey[ground]))
        parts = cv2.connectedComponents((dark | crown).astype(np.uint8))[1]
        own = (parts == parts[crown].max()) & ~crown if crown.any() else crown
        if own.sum() < 0.35 * (near & ~crown).sum():
            found |= own
    return found


def normalised(image: np.ndarray, low: float, high: float) -> np.ndarray:
    """Bring bands to about -1..1 by one gain and offset for all of them."""
    return np.clip((image - low) * (2 / max(high - low, 24.0)) - 1, -3, 3)


def levels(image: np.ndarray) -> tuple[float, float]:
    """Return the dark and the bright end of the visible bands (rows, cols, 3 or more)."""
    low, high = np.percentile(image[::3, ::3, :3], [2, 98])
    return float(low), float(high)


class Sampler:
    """Draw samples from a seed."""

    def __init__(self, pictures: Pictures, seed: int, painted: float = PAINTED) -> None:
        self.pictures = pictures
        self.rng = np.random.default_rng(seed)
        self.p = pictures.weights()
        self.simulated = pictures.simulated
        self.fine = pictures.fine
        self.painted = painted

    def batch(self, size: int) -> dict[str, np.ndarray]:
        chosen = self.rng.choice(len(self.p), size, p=self.p)
        samples = [self.sample(int(i)) for i in chosen]
        return {key: np.stack([s[key] for s in samples]) for key in samples[0]}

    def sample(self, number: int) -> dict[str, np.ndarray]:
        rng = self.rng
        image, valid, trees = self._moved(number)
        count_near = len(trees)
        simulated = bool(self.simulated[number])
        open_land = simulated or count_near <= 12
        other = np.zeros((CROP_PX, CROP_PX), np.float32)
        known = (ground(image) & ~water(image) | simulated).astype(np.float32)
        if open_land and not simulated:
            # Of all that is known there is much else; shadows are what is mistaken for things.
            known = np.maximum(known, 2 * shadows(image, trees))
        if open_land and rng.random() < self.painted:
            image, other, touched = place_things(rng, image, trees, known)
            known = np.maximum(known, touched)
        clean = np.ones((5, CROP_PX, CROP_PX), np.float32)
        clean[:4] = normalised(image, *levels(image)).transpose(2, 0, 1)
        if rng.random() < SPOILED:
            image = spoiled(rng, image)
        low, high = levels(image)
        spread = high - low
        low += rng.normal(0, 0.06) * spread
        high += rng.normal(0, 0.12) * spread
        x = np.zeros((5, CROP_PX, CROP_PX), np.float32)
        kind = rng.uniform(0.4, 1) if self.fine[number] else rng.random()
        if kind < 0.4:
            x[:4] = normalised(image, low, high).transpose(2, 0, 1)
            x[4] = 1
        else:
            rgb = image[..., :3]
            if kind > 0.75:
                rgb = np.repeat(
                    (rgb @ np.array([0.299, 0.587, 0.114], np.float32))[..., None], 3, axis=2
                )
            x[:3] = normalised(rgb, low, high).transpose(2, 0, 1)
        known_well = {"clean": clean, "kept": np.array(not self.fine[number], np.float32)}
        return {"x": x} | known_well | targets(trees, valid, other, known * open_land)

    def _moved(self, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return a crop turned, mirrored and scaled, with its valid pixels and trees."""
        rng = self.rng
        bands = self.pictures.bands[number]
        region = self.pictures.regions[number]
        side = bands.shape[0]
        zoom = float(np.exp(rng.uniform(np.log(0.85), np.log(1.18))))
        if rng.random() < 0.3:
            zoom = float(np.exp(rng.uniform(np.log(0.55), np.log(1.9))))
        zoom *= ENLARGED * (RESOLUTION_M / CHIP_RESOLUTION_M if self.fine[number] else 1)
        angle = int(rng.integers(4)) * np.pi / 2
        if rng.random() < 0.4:
            angle = rng.uniform(0, 2 * np.pi)
        cos, sin = zoom * np.cos(angle), zoom * np.sin(angle)
        turn = np.array([[cos, -sin], [sin, cos]])
        if rng.random() < 0.5:
            turn[:, 0] *= -1
        reach = max((side - CROP_PX / zoom) / 2, 0) + 12
        centre = side / 2 + rng.uniform(-reach, reach, 2)
        shift = CROP_PX / 2 - turn @ centre
        # The pixel whose corner is at zero has its centre at one half.
        matrix = np.column_stack([turn, shift + turn @ [0.5, 0.5] - 0.5])
        picture = bands
        if zoom < 0.8:
            picture = cv2.GaussianBlur(bands, (0, 0), 0.5 * np.sqrt(1 / zoom**2 - 1))
        image = cv2.warpAffine(
            picture,
            matrix,
            (CROP_PX, CROP_PX),
            flags=cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REFLECT_101,
        ).astype(np.float32)
        inner = region.copy()
        edge = int(np.ceil(BORDER_PX))
        inner[:edge], inner[-edge:], inner[:, :edge], inner[:, -edge:] = 0, 0, 0, 0
        valid = cv2.warpAffine(inner, matrix, (CROP_PX, CROP_PX), flags=cv2.INTER_NEAREST)
        trees = self.pictures.trees[number]
        moved = np.column_stack([trees[:, :2] @ turn.T + shift, trees[:, 2] * zoom])
        near = ((moved[:, :2] > -20) & (moved[:, :2] < CROP_PX + 20)).all(axis=1)
        return image, valid, moved[near]


def spoiled(rng: np.random.Generator, image: np.ndarray) -> np.ndarray:
    """Return the picture of another camera, light and file (0..255).

    Files have pixels of their own size, larger than those of lessons most often: what is lost
    there is lost before the picture is enlarged.
    """
    side = image.shape[0]
    kind = rng.random()
    factor = 1.0 if kind < 0.2 else rng.uniform(1.1, 2.0) if kind < 0.75 else rng.uniform(2, 6)
    if factor > 1:
        small = (round(side / factor),) * 2
        image = cv2.resize(image, small, interpolation=cv2.INTER_AREA)
    image = np.rint(np.clip(in_other_light(rng, image), 0, 255))
    if rng.random() < 0.6:
        stored = through_jpeg(image.astype(np.uint8), int(rng.integers(15, 95)))
        image = stored.astype(np.float32)
    if factor > 1:
        how = cv2.INTER_LINEAR if rng.random() < 0.5 else cv2.INTER_CUBIC
        image = np.clip(cv2.resize(image, (side, side), interpolation=how), 0, 255)
    return np.ascontiguousarray(np.rint(image), dtype=np.float32)


def in_other_light(rng: np.random.Generator, image: np.ndarray) -> np.ndarray:
    """Return the picture of another camera and light."""
    if rng.random() < 0.25:
        image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.3, 1.4))
    elif rng.random() < 0.25:
        image = image + rng.uniform(0.3, 1.2) * (image - cv2.GaussianBlur(image, (0, 0), 1.2))
    image = np.clip(image, 0, 255) / 255
    if rng.random() < 0.7:
        image = image ** np.float32(np.exp(rng.normal(0, 0.25)))
    if rng.random() < 0.15:
        image = image * shade(rng, image.shape[0])[..., None]
    gain = np.exp(rng.normal(0, 0.12)) * np.exp(rng.normal(0, 0.07, image.shape[2]))
    image = image * gain.astype(np.float32)
    if rng.random() < 0.25:
        share = np.float32(rng.uniform(0.05, 0.55))
        image = image * (1 - share) + share * np.float32(rng.uniform(0.6, 0.95))
    if rng.random() < 0.15:
        share = np.float32(rng.uniform(0.35, 0.9))
        image = image * share + np.float32(rng.uniform(0, 1 - share))
    image = image * 255
    if rng.random() < 0.4:
        noise = rng.standard_normal(image.shape, dtype=np.float32)
        image = image + noise * np.float32(rng.uniform(0.5, 7))
    return image


def shade(rng: np.random.Generator, side: int) -> np.ndarray:
    """Return the factor of a cloud's or slope's soft shade."""
    y, x = np.mgrid[:side, :side].astype(np.float32)
    angle = rng.uniform(0, 2 * np.pi)
    along = (x - side / 2) * np.cos(angle) + (y - side / 2) * np.sin(angle)
    edge = np.clip((along - rng.uniform(-60, 60)) / rng.uniform(4, 40) + 0.5, 0, 1)
    return (1 - edge * rng.uniform(0.2, 0.55)).astype(np.float32)
