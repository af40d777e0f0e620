"""Latitude and longitude as options."""

from __future__ import annotations

import math
from typing import Any

import click

from geofield.angles import angle_of


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
