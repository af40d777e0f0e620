"""Angles: between lines, and as people and receivers write latitude and longitude."""

from __future__ import annotations

import re
from typing import Any

# An s of the seconds goes with an m of the minutes; without one it is the south.
_ANGLE = re.compile(
    r"""(?P<before>[NSEW]?)\s*(?P<sign>[-+\N{MINUS SIGN}]?)\s*
    (?P<degrees>\d+(?:\.\d*)?|\.\d+)\s*
    (?:[°ºd:\s]\s*(?:(?P<minutes>\d+(?:\.\d*)?)\s*
    (?:(?:['′’:\s]|(?P<m>m))\s*(?:(?P<seconds>\d+(?:\.\d*)?)\s*
    (?:"|″|”|''|′′|(?(m)(?-i:s)|(?!))|(?(m)(?!\s*(?-i:S))))\s*)?)?)?)?
    (?P<after>[NSEW]?)""",
    re.VERBOSE | re.IGNORECASE,
)


def apart_deg(one: Any, other: Any) -> Any:
    """The angle between lines that run in these directions, one way or back: 0 to 90 degrees."""
    return abs((one - other + 90.0) % 180.0 - 90.0)


def angle_of(text: str, letters: str) -> float | None:
    """Degrees of an angle such as ``35.0754``, ``35 4.5 N`` or ``S 35° 4' 31.3"``, else None.

    `letters` are those of what is positive and what is negative, ``NS`` or ``EW``. Only the last
    part may have decimals, so that no latitude and longitude together are one angle.
    """
    found = _ANGLE.fullmatch(text.strip())
    if found is None:
        return None
    parts = [part for part in found.group("degrees", "minutes", "seconds") if part]
    letter, sign = (found["before"] + found["after"]).upper(), found["sign"]
    if any("." in part for part in parts[:-1]) or any(float(part) >= 60 for part in parts[1:]):
        return None
    if letter and (sign or letter not in letters):
        return None
    angle = sum(float(part) / 60.0**place for place, part in enumerate(parts))
    return -angle if letter == letters[1] or sign not in ("", "+") else angle
