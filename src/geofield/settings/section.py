"""What all sections of the settings share: their base, and the kinds of values."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from geofield import wording

NonNegative = Annotated[float, Field(ge=0)]


def _lonlat(value: Any) -> Any:
    """Longitude and latitude of a text ``LON,LAT``; what is a pair already stays."""
    if isinstance(value, str):
        value = value.split(",")
    if len(value) != 2:
        raise ValueError("write a position as LON,LAT, for instance 33.531142,35.075373")
    lon, lat = (float(part) for part in value)
    if not (abs(lon) <= 180 and abs(lat) <= 90):
        raise ValueError(f"{lon:g},{lat:g} is no longitude and latitude")
    return lon, lat


LonLat = Annotated[tuple[float, float], BeforeValidator(_lonlat)]
"""Longitude and latitude, degrees."""


class Section(BaseModel):
    """Base of the sections: unknown names are refused, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def nearest(given: str, names: Iterable[str]) -> str:
    """A sentence with the nearest of some names of settings, or nothing."""
    return wording.nearest(given.lower(), names, cutoff=0.5)
