"""The ways between segments in any order of these, each planned once."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from geofield.tracks.frame import FloatArray
from geofield.tracks.route.passage import Passage
from geofield.tracks.route.turns import Curve, Turn, plan_turns, straight_ways
from geofield.tracks.shapes import IntArray

_SPARE_SHARE = 0.45
"""Of a segment, at most this much may be left out at either end to pass an obstacle."""
_Link = tuple[int, bool, int, bool]


@dataclass(frozen=True, slots=True)
class Ways:
    """What is driven between segments, metres on the ground.

    Attributes
    ----------
    lines : object array (segments,)
        In the CRS, of which a metre has `scale` units.
    track_no : int array (segments,)
    scale : float
    passage : Passage
        In metres on the ground, where the machine may go.
    radius_m : float, optional
        Turning radius; without it the ways are the shortest ones, with sharp corners.
    curve : {"dubins", "reeds_shepp"}
    """

    lines: NDArray[np.object_]
    track_no: IntArray
    scale: float
    passage: Passage
    radius_m: float | None
    curve: Curve
    _found: dict[_Link, Turn] = field(default_factory=dict)

    def along(self, rows: IntArray, backward: NDArray[np.bool_]) -> list[Turn]:
        """The ways from each segment of an order to the next."""
        order = list(zip(rows.tolist(), backward.tolist(), strict=True))
        links: list[_Link] = [(*one, *other) for one, other in pairwise(order)]
        new = np.array([at for at, link in enumerate(links) if link not in self._found], np.int64)
        exits, entries = (each[new] for each in self.poses(rows, backward))
        if self.radius_m is None:
            turns = straight_ways(exits, entries, self.passage)
        else:
            turns = plan_turns(
                exits,
                entries,
                self.passage,
                radius_m=self.radius_m,
                curve=self.curve,
                spare_m=self._spare(rows, backward)[new] / self.scale,
            )
        self._found.update(zip((links[at] for at in new), turns, strict=True))
        return [self._found[link] for link in links]

    def poses(self, rows: IntArray, backward: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        """Poses at which one segment is left and the next is entered."""
        ends, legs = places_of(self.lines[rows]) / self.scale, _legs(self.lines[rows])
        # Driven backward, a line begins at its end, and the other way round.
        ends = np.where(backward[:, None, None], ends[:, ::-1], ends)
        way = np.arctan2(legs[..., 1], legs[..., 0])
        way = np.where(backward[:, None], way[:, ::-1] + np.pi, way)
        exits = np.column_stack((ends[:, 1], way[:, 1]))[:-1]
        entries = np.column_stack((ends[:, 0], way[:, 0]))[1:]
        return exits, entries

    def _spare(self, rows: IntArray, backward: NDArray[np.bool_]) -> FloatArray:
        """What may be left out of the segments before and after each turn along one track.

        Where a person bent a segment, it is left and joined on its straight pieces at the ends.
        """
        lines, track_no = self.lines[rows], self.track_no[rows]
        legs = _legs(lines)
        share = _SPARE_SHARE * shapely.length(lines)
        spare = np.minimum(share[:, None], np.hypot(legs[..., 0], legs[..., 1]))
        spare = np.where(backward[:, None], spare[:, ::-1], spare)
        same = (track_no[1:] == track_no[:-1]) & (backward[1:] == backward[:-1])
        return np.asarray(np.column_stack((spare[:-1, 1], spare[1:, 0])) * same[:, None])


def places_of(lines: NDArray[np.object_]) -> FloatArray:
    """First and last place of each line, (lines, 2, 2)."""
    return np.stack([shapely.get_coordinates(shapely.get_point(lines, at)) for at in (0, -1)], 1)


def _legs(lines: NDArray[np.object_]) -> FloatArray:
    """First and last straight piece of each line, (lines, 2, 2); a person may have bent one."""
    beside = np.stack([shapely.get_coordinates(shapely.get_point(lines, at)) for at in (1, -2)], 1)
    ends = places_of(lines)
    return np.stack((beside[:, 0] - ends[:, 0], ends[:, 1] - beside[:, 1]), axis=1)
