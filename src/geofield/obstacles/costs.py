"""From a probability to what a plan does: drive around, show as possible, drive on.

All costs are in looks: what it costs a person to look at one place of the map. Driving into a
thing costs `cost_missed` looks; driving around a place where nothing stands costs a `DETOUR`.
A possible thing is shown, and a share of `OVERLOOKED` of such places is driven over all the
same. With a probability p that something stands there, the plan

- drives around it where that, DETOUR (1 - p), costs less than showing it;
- shows it where that, 1 + OVERLOOKED p cost_missed, costs less than driving on;
- drives on otherwise, which costs p cost_missed.

With 30 to 1 that is from 0.17 and from 0.05 on.
"""

from __future__ import annotations

from geofield.errors import ObstacleError

DETOUR = 3.0
OVERLOOKED = 0.3


def thresholds(cost_missed: float) -> tuple[float, float]:
    """Return from which probability a thing is detected, and from which it is possible."""
    if not cost_missed > 0:
        raise ObstacleError(f"The cost of a missed thing, {cost_missed:g}, is not above zero.")
    detected = (DETOUR - 1) / (DETOUR + OVERLOOKED * cost_missed)
    possible = 1 / ((1 - OVERLOOKED) * cost_missed)
    return detected, min(possible, detected)
