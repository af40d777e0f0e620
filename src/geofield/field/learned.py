"""Learned: the network and the ranking that a search asks, as one value.

A search holds the one that it asks. What is shipped has learned from every field drawn by eye, so
whoever judges outlines of such fields hands in another one, learned without their sites.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from geofield.field.ranking import Ranking, trained
from geofield.learned.network import Network, network


@dataclass(frozen=True, eq=False)
class Learned:
    """What was learned about outlines; it can be pickled.

    Attributes
    ----------
    network : Network
        Says which ground belongs to the field.
    ranking : Ranking
        Learned behind such networks: chooses among outlines, and says how far to trust one.
    """

    network: Network
    ranking: Ranking


@cache
def shipped() -> Learned:
    """What this package holds.

    Raises
    ------
    GeofieldError
        When a file of it is missing or damaged.
    """
    return Learned(network("outline"), trained())
