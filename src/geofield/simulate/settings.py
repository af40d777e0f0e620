"""What a simulated picture shows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from geofield.errors import SettingsError, refuse_no_number, refuse_unknown

Climate = Literal["temperate", "dry", "lush", "bare"]
CLIMATES: tuple[Climate, ...] = ("temperate", "dry", "lush", "bare")


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """What a simulated picture shows.

    Attributes
    ----------
    width_px, height_px : int
        Size of the picture.
    resolution_m : float
        Metres per pixel.
    obstacles : int or None
        Crowns inside the field, fewer where there is no room; None draws 3 to 25.
    radius_m : (float, float)
        Range of the crowns' radii.
    climate : {"temperate", "dry", "lush", "bare"} or None
        Colours of the ground; None draws one.
    equal_brightness : bool
        Give the neighbours the field's grey level, so that only colour, near infrared and
        texture tell them apart: the case in which thresholds fail.
    nir : bool
        Add the near infrared band.
    lat, lon : float
        The place of the picture's centre, degrees.
    """

    width_px: int = 640
    height_px: int = 640
    resolution_m: float = 0.6
    obstacles: int | None = None
    radius_m: tuple[float, float] = (2.0, 7.0)
    climate: Climate | None = None
    equal_brightness: bool = False
    nir: bool = True
    lat: float = 35.075373
    lon: float = 33.531142

    def __post_init__(self) -> None:
        sides: dict[str, Any] = {"width_px": self.width_px, "height_px": self.height_px}
        refuse_no_number(SettingsError, "pixels", whole=True, **sides)
        refuse_no_number(SettingsError, "metres", resolution_m=self.resolution_m)
        refuse_no_number(SettingsError, "degrees", lat=self.lat, lon=self.lon)
        refuse_no_number(SettingsError, none_too=True, whole=True, obstacles=self.obstacles)
        if min(self.width_px, self.height_px) < 64:
            raise SettingsError("A simulated picture has at least 64 x 64 px.")
        refuse_no_number(SettingsError, "metres", radius_m=self.radius_m[0])
        refuse_no_number(SettingsError, "metres", radius_m=self.radius_m[1])
        if not 0 < self.radius_m[0] <= self.radius_m[1] < math.inf:
            raise SettingsError(f"The radius range {self.radius_m} is empty or endless.")
        if not 0 < self.resolution_m < math.inf:
            raise SettingsError("The resolution must be above zero and finite.")
        if self.obstacles is not None and self.obstacles < 0:
            raise SettingsError(f"{self.obstacles} obstacles are fewer than none.")
        if self.climate is not None:
            refuse_unknown(SettingsError, "climate", self.climate, CLIMATES)
