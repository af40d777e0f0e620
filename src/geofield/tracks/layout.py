"""Where the tracks lie across the field, and which numbers they carry.

Positions and numbers follow from the outline and the settings alone, never from obstacles: a
track keeps its number whatever is found or moved in the field.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from geofield.errors import TrackError, refuse_unknown
from geofield.tracks.clip import SNAP_M
from geofield.tracks.frame import FloatArray
from geofield.tracks.shapes import Edges

LastStrip = Literal["overrun", "leave", "shift", "spread"]
LAST_STRIPS: tuple[str, ...] = get_args(LastStrip)

#: Ground between passes that is worth a word.
_GAP_M = 0.01


@dataclass(frozen=True, slots=True)
class Strips:
    """How a field is divided into strips, whatever their direction; metres on the ground."""

    spacing_m: float
    #: From the border to the first track; half a width if None.
    offset_m: float | None = None
    last_strip: LastStrip = "overrun"
    #: Of the machine; a spacing if None. Passes that overlap are closer together than it is wide.
    width_m: float | None = None

    @property
    def half_m(self) -> float:
        """How far the machine reaches beside its track."""
        return (self.spacing_m if self.width_m is None else self.width_m) / 2.0

    @property
    def wide_words(self) -> str:
        """Machine or spacing, whichever is the wider, in words."""
        wide_m = 2.0 * self.half_m
        if wide_m > self.spacing_m:
            return f"The machine's width of {wide_m:g} m"
        return f"The spacing of {self.spacing_m:g} m"

    @property
    def overlap_m(self) -> float:
        """Of neighbouring passes; below 0 a gap between them."""
        return 2.0 * self.half_m - self.spacing_m

    def gap_note(self, spacing_m: float) -> tuple[str, ...]:
        """That passes so far apart leave ground between them, where they do."""
        gap_m = spacing_m - 2.0 * self.half_m
        if gap_m < _GAP_M:
            return ()
        words = f"Between passes {gap_m:.2f} m stay unworked"
        return (f"{words}: the machine is {2.0 * self.half_m:g} m wide, the spacing larger.",)

    @property
    def first_m(self) -> float:
        """From the border to the first track."""
        return self.half_m if self.offset_m is None else float(self.offset_m)

    def across(
        self, edges: Edges, first_m: float | None = None, *, asked: bool = False
    ) -> FloatArray:
        """Places of the tracks across an area, counted from `first_m` if that is given.

        With `asked` one of them is there, and so is one at an offset, whatever its strip reaches.
        """
        near, far = float(edges.va.min()), float(edges.va.max())
        first_m = near + self.first_m if first_m is None else first_m
        return on_the_border(self._positions(near, far, first_m, asked=asked), edges)

    def refuse_beyond(self, across_m: float) -> None:
        """Refuse an offset that lies beyond a field so wide across the tracks."""
        if self.offset_m is not None and self.offset_m > across_m:
            raise TrackError(
                f"An offset of {self.offset_m:g} m lies beyond the field, which is "
                f"{across_m:.1f} m wide across the tracks.",
                hint="Give the distance of the first track from its edge, or leave the offset out.",
            )

    def count(self, width_m: float) -> int:
        """How many tracks an area needs that is so wide across them; one if none fits."""
        return max(1, len(self._positions(0.0, width_m, self.first_m)))

    def _positions(
        self, near_m: float, far_m: float, first_m: float, *, asked: bool = False
    ) -> FloatArray:
        return track_positions(
            near_m,
            far_m,
            self.spacing_m,
            first_m=first_m,
            asked=asked or self.offset_m is not None,
            last_strip=self.last_strip,
            width_m=self.width_m,
        )


def on_the_border(positions: FloatArray, edges: Edges) -> FloatArray:
    """Leave out a first or last track that only touches a corner of the field.

    A track on the border itself is one where an edge of the field lies along it; it is moved
    onto that edge by the last digits that it may be off.
    """
    near, far = float(edges.va.min()), float(edges.va.max())
    positions = positions.copy()
    keep = np.ones(len(positions), dtype=bool)
    for at in {0, len(positions) - 1} if len(positions) else set():
        place = positions[at]
        if min(abs(place - near), abs(place - far)) <= SNAP_M:
            along = (np.abs(edges.va - place) <= SNAP_M) & (np.abs(edges.vb - place) <= SNAP_M)
            keep[at] = bool(along.any())
            positions[at] = near if abs(place - near) <= SNAP_M else far
    return positions[keep]


def track_positions(
    near_m: float,
    far_m: float,
    spacing_m: float,
    *,
    first_m: float,
    asked: bool = False,
    last_strip: LastStrip = "overrun",
    width_m: float | None = None,
) -> FloatArray:
    """Places of the tracks across the field, increasing; the n-th is track n + 1, if any fits.

    The field reaches from `near_m` to `far_m` across them. Each works a strip of `width_m`, or of a
    spacing where none is given; all are whole spacings away from `first_m`, where one is if that
    was `asked`.

    `last_strip` is what becomes of the rest at the far side. ``overrun``: tracks as far as the
    field goes (the study's rule), so that the last strip may reach beyond the border by up to half
    a spacing, or a rest narrower than that stays unworked; ``leave``: only strips that lie wholly
    inside, but for one that was asked; ``shift``: one more track, moved back until its strip ends
    at the far side; ``spread``: the spacing shrinks evenly until strips fill the field exactly,
    those of a given width from border to border.
    """
    refuse_unknown(TrackError, "last_strip", last_strip, LAST_STRIPS)
    half = (width_m or spacing_m) / 2.0
    # Of passes that overlap by more than half, none beyond those that reach the borders: their
    # machine would drive outside for nothing. What was asked for stays.
    idle = half - spacing_m + SNAP_M if half > spacing_m else -SNAP_M
    low, high = near_m + idle, far_m - idle
    limit = far_m - half + SNAP_M
    if near_m - SNAP_M <= first_m <= far_m + SNAP_M:
        low, high = min(low, first_m), max(high, first_m)
        limit = max(limit, first_m) if asked else limit
    limit = high if last_strip == "overrun" else limit
    index = np.ceil((low - first_m) / spacing_m)
    start = first_m + index * spacing_m
    if last_strip == "spread":
        edge = max(start - half, near_m)
        if width_m is not None:
            steps = int(np.ceil((far_m - edge - width_m) / spacing_m - 1e-9))
            middle = [(edge + far_m) / 2.0]
            return np.array(
                middle if steps < 1 else np.linspace(edge + half, far_m - half, steps + 1)
            )
        count = max(1, int(np.ceil((far_m - edge) / spacing_m - 1e-9)))
        width = (far_m - edge) / count
        return np.asarray(edge + (np.arange(count) + 0.5) * width)
    count = max(0, int(np.floor((limit - first_m) / spacing_m) - index) + 1)
    # Multiples of the spacing from the one place, so that numbers far away do not drift.
    positions = first_m + (index + np.arange(count)) * spacing_m
    if last_strip == "leave":
        inside = positions >= near_m + half - SNAP_M
        positions = positions[inside | (np.abs(positions - first_m) <= SNAP_M)]
    if last_strip == "shift":
        worked = positions[-1] + half if count else near_m
        if far_m - worked > SNAP_M and far_m - half > near_m:
            positions = np.append(positions, far_m - half)
    return np.asarray(positions)
