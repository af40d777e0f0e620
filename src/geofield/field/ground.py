"""Ground: how likely each superpixel belongs to the field, before any outline is drawn.

A small network adds up what a superpixel shows (`looks`) to log odds. It was learned by
`benchmarks/field_choice.py` on the same fields as the curves of `scoring`, from a thousand
places in each instead of from whole outlines. How well an outline agrees with it makes five
more figures of the outline.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from geofield.field.looks import LOOKS
from geofield.field.surface import Surface
from geofield.field.table import read_table

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: Odds are known no better than this (a probability of 0.5 %).
_SURE = 5.293
#: Inputs further out than so many spreads count as no further.
_END = 4.0

AGREEMENT = (
    "ground_mean",
    "ground_unlikely_share",
    "ground_overlap",
    "ground_fit",
    "ground_10",
)
"""Names of the figures of `agreement`, in their order."""


@dataclass(frozen=True, eq=False)
class Network:
    """A learned network with one hidden layer of rectified units.

    Attributes
    ----------
    usual, spread : float array (looks,)
        Mean and standard deviation of each input.
    hidden : float array (looks, units)
    hidden_bias, outward : float array (units,)
    bias : float
    """

    usual: FloatArray
    spread: FloatArray
    hidden: FloatArray
    hidden_bias: FloatArray
    outward: FloatArray
    bias: float

    def odds(self, looks: FloatArray) -> FloatArray:
        """Log odds of belonging to the field, from looks (superpixels, looks)."""
        standard = standardised(looks, self.usual, self.spread)
        lit = np.maximum(standard @ self.hidden + self.hidden_bias, 0.0)
        return np.asarray(np.clip(lit @ self.outward + self.bias, -_SURE, _SURE))


def log_odds(share: FloatArray | float) -> FloatArray:
    """Logarithm of the odds of a share, within bounds."""
    return np.asarray(logit(np.clip(share, 0.01, 0.995)))


def standardised(looks: FloatArray, usual: FloatArray, spread: FloatArray) -> FloatArray:
    """Looks in units of their spread, within bounds."""
    return np.clip((looks - usual) / spread, -_END, _END)


@cache
def learned() -> Network:
    """The network of `tables/ground.json`.

    Raises
    ------
    FieldError
        When the table is of another version.
    """
    table = read_table("ground", "looks", LOOKS)
    usual, spread, hidden = (
        np.array([row[key] for row in table["looks"]]) for key in ("usual", "spread", "hidden")
    )
    bias, outward = np.array(table["hidden_bias"]), np.array(table["outward"])
    return Network(usual, spread, hidden, bias, outward, float(table["bias"]))


@dataclass(frozen=True, eq=False)
class Ground:
    """A surface, and how likely its parts belong to the field.

    Attributes
    ----------
    surface : Surface
    looks : float array (superpixels, looks)
        What they show, see `looks`.
    network : Network
        That judges them.
    """

    surface: Surface
    looks: FloatArray
    network: Network

    @cached_property
    def odds(self) -> FloatArray:
        """Natural logarithms of the odds that each superpixel belongs to the field."""
        return self.network.odds(self.looks)

    @cached_property
    def likely(self) -> FloatArray:
        """The odds as probabilities."""
        return np.asarray(expit(self.odds))


def agreement(ground: Ground, inside: BoolArray) -> FloatArray:
    """How well an outline agrees with the ground, in the order of `AGREEMENT`.

    Parameters
    ----------
    ground : Ground
    inside : bool array (superpixels,)
        Which the outline holds; at least one.
    """
    size, odds, likely = ground.surface.size_px, ground.odds, ground.likely
    own, own_odds, own_likely = size[inside], odds[inside], likely[inside]
    area, common = float(own.sum()), float(own @ own_likely)
    everywhere, missed = float(size @ likely), float(own @ np.log(own_likely))
    beyond = size[~inside] @ np.log1p(-likely[~inside])
    overlap = common / (area + everywhere - common)
    return np.array(
        [
            own @ own_odds / area,
            own @ (own_likely < 0.3) / area,
            float(log_odds(overlap)),
            np.log(0.02 - (missed + beyond) / size.sum()),
            np.sort(own_odds)[int(0.1 * len(own))],
        ]
    )
