"""Latitude and longitude as people and receivers write them, for options."""

from __future__ import annotations

import math
import re
from typing import Any

import click

_ANGLE = re.compile(
    r"""(?P<before>[NSEW]?)\s*(?P<sign>[-+\N{MINUS SIGN}]?)\s*
    (?P<degrees>\d+(?:\.\d*)?|\.\d+)\s*
    (?:[°ºd:\s]\s*(?:(?P<minutes>\d+(?:\.\d*)?)\s*
    (?:['′’m:\s]\s*(?:(?P<seconds>\d+(?:\.\d*)?)\s*(?:"|″|”|''|′′|s)?\s*)?)?)?)?
    (?P<after>[NSEW]?)""",
    re.VERBOSE | re.IGNORECASE,
)


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


class Degrees(click.FloatRange):
    """A latitude or longitude."""

    name = "degrees"

    def __init__(self, letters: str) -> None:
        limit = 90 if letters == "NS" else 180
        super().__init__(-limit, limit)
        self.letters = letters

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The angle in degrees."""
        text = str(value)
        try:
            angle: float | None = float(text)
        except ValueError:
            angle = angle_of(text, self.letters)
        if angle is None or not math.isfinite(angle):
            point = text.replace(",", ".")
            write = "degrees, such as 35.0754 or 35 4.524 N"
            if point != text and angle_of(point, self.letters) is not None:
                write = point
            self.fail(f"{text!r} is not an angle: write {write}.", param, ctx)
        return super().convert(angle, param, ctx)
