"""From the end of one segment to the start of the next: curves where the machine can drive them.

Tried in this order, and the first that stays in the allowed area is taken: one curve of the
turning radius; a chain of curves along the shortest way around what is between; around an obstacle
on the same track, a chain that leaves the track early and joins it late. Where none fits, the turn
says so: a curve that leaves the field by up to three radii, else the shortest way itself with its
sharp corners. No way ever runs through an obstacle or a hole.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from geofield.tracks.frame import FloatArray
from geofield.tracks.route.curves import Words, dubins_words, trace
from geofield.tracks.route.passage import Passage
from geofield.tracks.route.reeds_shepp import reeds_shepp_words

Curve = Literal["dubins", "reeds_shepp"]

_TRIED_WORDS = 12
_CUSP_RADII = 2.0
"""Changing between forwards and backwards costs as much as driving this many radii."""
_NEAR_RADII = 3.0
_STEP_RADII = 0.05


@dataclass(frozen=True, slots=True)
class Turn:
    """One way between segments."""

    #: Shape (n, 2): the way, in the CRS.
    places: FloatArray
    #: ``dubins``, ``reeds_shepp``, ``drive``, or ``none`` where there is no way at all.
    kind: str
    #: length_m, reverse_m, outside_m: all of it, backwards, beyond the border and its margin.
    length_m: float
    reverse_m: float = 0.0
    outside_m: float = 0.0
    #: Whether the machine can drive it within the allowed area; without a turning radius, whether
    #: there is a way at all.
    fits: bool = True
    #: early_m, late_m: how much of the segment before and of the one after it leaves out.
    early_m: float = 0.0
    late_m: float = 0.0


def straight_ways(exits: FloatArray, entries: FloatArray, passage: Passage) -> list[Turn]:
    """Shortest ways between poses (n, 3) without regard to a turning radius."""
    ends = np.stack((exits[:, :2], entries[:, :2]), axis=1)
    if not len(ends):
        return []
    free = passage.fits(np.asarray(shapely.linestrings(ends)))
    return [
        _drive(each, each if clear else passage.shortest(*each), fits=True)
        for each, clear in zip(ends, free.tolist(), strict=True)
    ]


def plan_turns(
    exits: FloatArray,
    entries: FloatArray,
    passage: Passage,
    *,
    radius_m: float,
    curve: Curve,
    spare_m: FloatArray,
) -> list[Turn]:
    """Turns of a turning radius between poses (n, 3), metres and radians.

    `spare_m` (n, 2) is the length of the segments before and after that a way around an obstacle on
    their track may leave out; 0 where the segments are on different tracks.
    """
    count = len(exits)
    found: list[Turn | None] = [None] * count
    loose: list[Turn | None] = [None] * count
    if not count:
        return []
    machine = _Machine(passage, radius_m, curve)
    _single_curves(exits, entries, machine, spare_m, found, loose)
    for row in range(count):
        if found[row] is not None:
            continue
        ends = np.stack((exits[row, :2], entries[row, :2]))
        way = passage.shortest(ends[0], ends[1])
        if way is not None and len(way) > 2:
            found[row] = _chain(exits[row], entries[row], way, machine)
            if found[row] is None and spare_m[row].min() > 0.0:
                found[row] = _lane_change(exits[row], entries[row], way, machine, spare_m[row])
        if found[row] is None:
            found[row] = loose[row] or _drive(ends, way, fits=False)
    return [turn for turn in found if turn is not None]


@dataclass(frozen=True, slots=True)
class _Machine:
    """What turns, how tightly, and where it may."""

    passage: Passage
    radius_m: float
    curve: Curve

    def words(self, exits: FloatArray, entries: FloatArray) -> Words:
        return _words(exits, entries, self.radius_m, self.curve)

    def trace(self, start: FloatArray, words: Words, row: int, word: int) -> FloatArray:
        steer, length = words.steer[word], words.length[row, word]
        return trace(start, steer, length, self.radius_m, step_m=_STEP_RADII * self.radius_m)


def _words(exits: FloatArray, entries: FloatArray, radius_m: float, curve: Curve) -> Words:
    words = dubins_words if curve == "dubins" else reeds_shepp_words
    return words(exits, entries, radius_m)


def _cost(words: Words) -> FloatArray:
    """What each curve costs, radii."""
    return words.total + _CUSP_RADII * words.cusps


def shortest_words(
    exits: FloatArray, entries: FloatArray, radius_m: float, curve: Curve
) -> FloatArray:
    """Length of the curve that is tried first for each pair of poses (n, 3), radii."""
    words = _words(exits, entries, radius_m, curve)
    total, first = words.total, np.argmin(_cost(words), axis=1)
    return np.asarray(total[np.arange(len(first)), first])


def _single_curves(
    exits: FloatArray,
    entries: FloatArray,
    machine: _Machine,
    spare_m: FloatArray,
    found: list[Turn | None],
    loose: list[Turn | None],
) -> None:
    """Try one curve for every pair, from the shortest word upwards, all pairs at a time."""
    passage, radius_m = machine.passage, machine.radius_m
    words = machine.words(exits, entries)
    cost = _cost(words)
    rank = np.argsort(cost, axis=1)
    wider = shapely.buffer(passage.open_shell, _NEAR_RADII * radius_m)
    shapely.prepare(wider)
    open_rows = np.arange(len(exits))
    for place in range(min(_TRIED_WORDS, rank.shape[1])):
        word = rank[open_rows, place]
        # On one track a loop is never the way past an obstacle.
        limit = np.where(spare_m[open_rows].min(axis=1) > 0.0, np.pi, np.inf)
        apart = np.hypot(*(entries[open_rows, :2] - exits[open_rows, :2]).T) / radius_m
        best = cost[open_rows, word]
        usable = np.isfinite(best) & (best - apart < limit)
        rows, word = open_rows[usable], word[usable]
        pairs = zip(rows.tolist(), word.tolist(), strict=True)
        places = [machine.trace(exits[row], words, row, w) for row, w in pairs]
        lines = np.array([as_line(each) for each in places], dtype=object)
        clear = ~passage.hits(lines)
        inside = clear & shapely.covers(passage.open_shell, lines)
        near = clear & shapely.covers(wider, lines)
        for at, row in enumerate(rows.tolist()):
            if inside[at] or (near[at] and loose[row] is None):
                pieces = words.length[row, word[at]] * radius_m
                turn = Turn(
                    places[at],
                    machine.curve if (pieces < 0).any() else "dubins",
                    float(np.abs(pieces).sum()),
                    float(np.abs(pieces[pieces < 0]).sum()),
                    0.0 if inside[at] else passage.outside_m(lines[at]),
                    bool(inside[at]),
                )
                if inside[at]:
                    found[row] = turn
                else:
                    loose[row] = turn
        open_rows = np.array([row for row in open_rows if found[row] is None], dtype=np.int64)


def _chain(start: FloatArray, goal: FloatArray, way: FloatArray, machine: _Machine) -> Turn | None:
    """Curves from corner to corner of the shortest way, a little outside of each corner."""
    radius_m = machine.radius_m
    for out in (0.1, 0.3 * radius_m, radius_m):
        turn = _through(np.vstack((start, _corner_poses(way, out, radius_m), goal)), machine)
        if turn is not None and turn.length_m < 2.0 * _length(way) + 4.0 * np.pi * radius_m:
            return turn
    return None


def _through(poses: FloatArray, machine: _Machine) -> Turn | None:
    """The shortest curves through poses, where together they fit."""
    words = machine.words(poses[:-1], poses[1:])
    cost = _cost(words)
    best = np.argmin(cost, axis=1)
    if not np.isfinite(cost[np.arange(len(best)), best]).all():
        return None
    pieces = words.length[np.arange(len(best)), best] * machine.radius_m
    parts = [machine.trace(poses[k], words, k, word) for k, word in enumerate(best.tolist())]
    places = np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
    if not machine.passage.fits(np.array([as_line(places)], dtype=object))[0]:
        return None
    reverse = float(np.abs(pieces[pieces < 0]).sum())
    kind = "reeds_shepp" if reverse > 0.0 else "dubins"
    return Turn(places, kind, float(np.abs(pieces).sum()), reverse)


def _corner_poses(way: FloatArray, out_m: float, radius_m: float) -> FloatArray:
    """Poses at the bends of a way: of corners close together on one side, the middle one."""
    into = way[1:-1] - way[:-2]
    out = way[2:] - way[1:-1]
    into = into / np.maximum(np.hypot(into[:, 0], into[:, 1]), 1e-12)[:, None]
    out = out / np.maximum(np.hypot(out[:, 0], out[:, 1]), 1e-12)[:, None]
    side = np.sign(into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0])
    along = into + out
    angle = np.arctan2(along[:, 1], along[:, 0])
    # What the way bends around lies on the inside: keep to the outside.
    shift = np.column_stack((np.sin(angle), -np.cos(angle))) * (side * out_m)[:, None]
    poses = np.column_stack((way[1:-1] + shift, angle))
    groups: list[list[int]] = [[0]]
    for corner in range(1, len(poses)):
        near = np.hypot(*(way[corner + 1] - way[corner])) < radius_m
        if near and side[corner] == side[corner - 1]:
            groups[-1].append(corner)
        else:
            groups.append([corner])
    return poses[[group[len(group) // 2] for group in groups]]


def _lane_change(
    start: FloatArray, goal: FloatArray, way: FloatArray, machine: _Machine, spare_m: FloatArray
) -> Turn | None:
    """Leave the track before the obstacle, pass beside it, join the track behind it."""
    radius_m, forwards = machine.radius_m, replace(machine, curve="dubins")
    ahead, onward = (np.array([np.cos(each[2]), np.sin(each[2])]) for each in (start, goal))
    left = np.array([-ahead[1], ahead[0]])
    along, across = (way - way[0]) @ ahead, (way - way[0]) @ left
    side = 1.0 if across.max() > -across.min() else -1.0
    reach = float((side * across).max())
    beside = along[side * across > reach - 0.05 * radius_m - 0.1]
    low, high = float(beside.min()), float(beside.max())
    gap = float(along[-1])
    for more, wide, longer in itertools.product((0.1, 0.4 * radius_m), (0.0, 0.5, 1.0), (0.0, 0.5)):
        aside = reach + more
        # Two arcs that leave a line and join its parallel (a lane change) take this length.
        needed = (
            np.sqrt(aside * (4.0 * radius_m - aside)) if aside < 2.0 * radius_m else 2.0 * radius_m
        ) + longer * radius_m
        first, last = low - wide * reach, high + wide * reach
        early = float(np.clip(needed - first, 0.0, None))
        late = float(np.clip(last + needed - gap, 0.0, None))
        if early > spare_m[0] or late > spare_m[1]:
            continue
        poses = np.array(
            [
                [*(start[:2] - early * ahead), start[2]],
                [*(start[:2] + first * ahead + side * aside * left), start[2]],
                [*(start[:2] + last * ahead + side * aside * left), start[2]],
                [*(goal[:2] + late * onward), goal[2]],
            ]
        )
        turn = _through(poses, forwards)
        if turn is not None and turn.length_m < 1.5 * (gap + early + late) + np.pi * radius_m:
            return Turn(turn.places, turn.kind, turn.length_m, early_m=early, late_m=late)
    return None


def _drive(ends: FloatArray, way: FloatArray | None, *, fits: bool) -> Turn:
    """The shortest way between ends, with its corners, where there is one."""
    if way is None:
        return Turn(ends, "none", 0.0, fits=False)
    return Turn(way, "drive", _length(way), fits=fits)


def _length(places: FloatArray) -> float:
    return float(np.hypot(*np.diff(places, axis=0).T).sum())


def as_line(places: FloatArray) -> BaseGeometry:
    """A line, also of one place: shapely wants two."""
    return shapely.LineString(places if len(places) > 1 else np.repeat(places, 2, axis=0))
