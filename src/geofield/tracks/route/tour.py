"""Local search on tours whose stops are segments, each with two ends.

A tour is a list of ends: entry and exit of the first segment, entry and exit of the second, ...;
what counts are the links from each exit to the next entry. An extra segment of no length, free
to reach from anywhere, turns the open drive into a closed tour.
"""

from __future__ import annotations

import random
from collections import deque
from math import hypot

_KICKS_PER_SEGMENT = 0.5
_MAX_KICKS = 300
_KICK_SPAN = 30
_MAX_RUN = 3
_GAIN_M = 1e-7
_SEED = 20_240_229


def improve_tour(
    tour: list[int],
    places: list[list[float]],
    near: list[list[int]],
    cost: dict[int, float],
    *,
    detour_m: float,
    begin: list[float] | None,
) -> list[int]:
    """Shorten a tour by local search with kicks; deterministic.

    The tour is entry and exit of each segment in turn, `places` are those of the ends, `near` the
    cheap links of every end, whose `cost` is listed by ``a * len(places) + b``. Links that are not
    listed cost `detour_m` above the straight line, starting at an end what `begin` says.
    """
    search = _Search(tour, places, near, cost, detour_m, begin)
    search.improve(range(len(tour)))
    best, length = list(search.tour), search.length()
    # Reproducible, not secret.
    chance = random.Random(_SEED)  # noqa: S311
    segments = len(tour) // 2
    if segments >= 8:
        for _ in range(min(_MAX_KICKS, int(_KICKS_PER_SEGMENT * segments))):
            touched = search.kick(chance)
            search.improve(touched)
            now = search.length()
            if now < length - _GAIN_M:
                best, length = list(search.tour), now
            elif now > length + _GAIN_M:
                search.restore(best)
    return _opened(best, 2 * segments)


def _opened(closed: list[int], extra: int) -> list[int]:
    """Cut the closed tour at the extra segment, its exit first."""
    at = closed.index(extra) if closed.index(extra) % 2 == 1 else closed.index(extra + 1)
    turned = closed[at + 1 :] + closed[: at + 1]
    return [end for end in turned if end < extra]


class _Search:
    """A closed tour with the place of every end in it."""

    def __init__(
        self,
        tour: list[int],
        places: list[list[float]],
        near: list[list[int]],
        cost: dict[int, float],
        detour_m: float,
        begin: list[float] | None,
    ) -> None:
        self.ends = len(tour)
        self.tour = [*tour, self.ends, self.ends + 1]
        self.places, self.near, self.cost = places, near, cost
        self.detour_m, self.begin = detour_m, begin
        self.at = [0] * len(self.tour)
        self.restore(self.tour)

    def restore(self, tour: list[int]) -> None:
        self.tour = list(tour)
        for place, end in enumerate(tour):
            self.at[end] = place

    def link(self, a: int, b: int) -> float:
        """Cost of driving between two ends of different segments."""
        if a >= self.ends or b >= self.ends:
            # The drive starts at what the exit of the extra segment leads to; it ends anywhere.
            if self.begin is None or max(a, b) != self.ends + 1:
                return 0.0
            return self.begin[min(a, b)]
        found = self.cost.get(a * self.ends + b)
        if found is not None:
            return found
        p, q = self.places[a], self.places[b]
        return hypot(q[0] - p[0], q[1] - p[1]) + self.detour_m

    def length(self) -> float:
        tour = self.tour
        return sum(self.link(tour[k - 1], tour[k]) for k in range(0, len(tour), 2))

    def improve(self, touched: range | list[int]) -> None:
        """Apply improving moves around the ends given until none is left."""
        waiting = deque(touched)
        listed = set(touched)
        while waiting:
            end = waiting.popleft()
            listed.discard(end)
            if end >= self.ends:
                continue
            changed = self._two_opt(end) or self._or_opt(end)
            for other in changed:
                if other not in listed:
                    listed.add(other)
                    waiting.append(other)

    def _partner(self, end: int) -> int:
        """The end at the other side of an end's link."""
        place = self.at[end]
        return self.tour[(place + 1) % len(self.tour) if place % 2 else place - 1]

    def _two_opt(self, a: int) -> list[int]:
        b = self._partner(a)
        now = self.link(a, b)
        leaves = self.at[a] % 2
        for c in self.near[a]:
            new = self.link(a, c)
            if new >= now:
                break
            if self.at[c] % 2 != leaves:
                continue
            e = self._partner(c)
            if now + self.link(c, e) - new - self.link(b, e) > _GAIN_M:
                if leaves:
                    self._reverse(self.at[b], self.at[c])
                else:
                    self._reverse(self.at[c], self.at[b])
                return [a, b, c, e]
        return []

    def _reverse(self, first: int, last: int) -> None:
        """Reverse the tour from one place to another, or the rest, which is the same tour."""
        size = len(self.tour)
        inner = (last - first) % size + 1
        if 2 * inner > size:
            first, last = (last + 1) % size, (first - 1) % size
            inner = size - inner
        tour, at = self.tour, self.at
        if first <= last:
            tour[first : last + 1] = tour[first : last + 1][::-1]
            for place in range(first, last + 1):
                at[tour[place]] = place
            return
        for _ in range(inner // 2):
            tour[first], tour[last] = tour[last], tour[first]
            at[tour[first]], at[tour[last]] = first, last
            first, last = (first + 1) % size, (last - 1) % size

    def _or_opt(self, a: int) -> list[int]:
        """Move a run of segments that begins with this end to beside one of its neighbours."""
        size = len(self.tour)
        step = 1 if self.at[a] % 2 == 0 else -1
        x = self._partner(a)
        before = self.link(x, a)
        for run in range(1, _MAX_RUN + 1):
            inside = [self.tour[(self.at[a] + step * k) % size] for k in range(2 * run)]
            if 2 * run >= size - 4 or max(inside) >= self.ends:
                return []
            z = inside[-1]
            y = self._partner(z)
            freed = before + self.link(z, y) - self.link(x, y)
            if freed <= _GAIN_M:
                continue
            members = set(inside)
            for c in self.near[a]:
                new = self.link(a, c)
                if new >= freed:
                    break
                if c in members:
                    continue
                f = self._partner(c)
                # A link that goes with the run: x-a and z-y are gone, x-y is there instead.
                if f in members:
                    continue
                if freed + self.link(c, f) - new - self.link(z, f) > _GAIN_M:
                    self._move(inside, c, f)
                    return [x, y, a, z, c, f]
        return []

    def _move(self, run: list[int], c: int, f: int) -> None:
        """Put a run between two linked ends, its first end beside the first of them."""
        members = set(run)
        rest = [end for end in self.tour if end not in members]
        # Runs are taken out whole, so that places of one parity keep it only up to rotation.
        if rest and self.at[rest[0]] % 2 == 1:
            rest = rest[1:] + rest[:1]
        place = rest.index(c)
        after = rest[(place + 1) % len(rest)] == f and place % 2 == 1
        if after:
            rest[place + 1 : place + 1] = run
        else:
            rest[place:place] = run[::-1]
        self.restore(rest)

    def kick(self, chance: random.Random) -> list[int]:
        """Exchange two neighbouring stretches somewhere (a double bridge)."""
        segments = len(self.tour) // 2
        span = min(_KICK_SPAN, segments // 2 - 1)
        first = chance.randrange(segments - 2 * span) if segments > 2 * span else 0
        cuts = sorted(chance.sample(range(2 * span + 1), 3))
        i, j, k = (2 * (first + cut) for cut in cuts)
        tour = self.tour
        ends = [tour[i - 1], tour[i], tour[j - 1], tour[j], tour[k - 1], tour[k % len(tour)]]
        tour[i:k] = tour[j:k] + tour[i:j]
        for place in range(i, k):
            self.at[tour[place]] = place
        return ends
