"""What all sections of the settings share: their base, and the kinds of values."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
)

from geofield import wording
from geofield.errors import FARTHEST_M, is_truth

NonNegative = Annotated[float, Field(ge=0)]
Reach = Annotated[float, Field(ge=0, le=FARTHEST_M)]
Radius = Annotated[float, Field(gt=0, le=FARTHEST_M)]


def _lonlat(value: Any) -> Any:
    """Longitude and latitude of a text ``LON,LAT``; what is a pair already stays."""
    try:
        lon, lat = map(float, value.split(",") if isinstance(value, str) else value)
    except (TypeError, ValueError):
        raise ValueError("write a position as LON,LAT, for instance 33.531142,35.075373") from None
    if abs(lon) <= 180 and abs(lat) <= 90:
        return lon, lat
    exchanged = abs(lat) <= 180 and abs(lon) <= 90
    raise ValueError(
        f"{lon:.10g},{lat:.10g} is no longitude and latitude"
        + (f": exchanged, {lat:.10g},{lon:.10g}, it is" if exchanged else "")
    )


LonLat = Annotated[tuple[float, float], BeforeValidator(_lonlat)]
"""Longitude and latitude, degrees."""


def words(value: Any) -> Any:
    """The words of a list, where one of them may be several with commas, or all are one text."""
    parts = [value] if isinstance(value, str) else value
    if not isinstance(parts, list | tuple) or not all(isinstance(part, str) for part in parts):
        return value  # what is wrong is said by the setting's own check
    found = tuple(word.strip() for part in parts for word in part.split(","))
    if found and not any(found):
        raise ValueError("it is empty: leave it out, or name one")
    return found


class Section(BaseModel):
    """Base of the sections: unknown names are refused, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth(cls, value: Any, info: ValidationInfo) -> Any:
        """Who writes `headland_m = true` does not mean 1 m."""
        kind = cls.model_fields[str(info.field_name)].annotation
        if bool not in (kind, *get_args(kind)) and _holds_truth(value):
            raise ValueError("input should be a value, not true or false")
        return value


def _holds_truth(value: Any) -> bool:
    """Whether a value, or one in a list of them, is true or false."""
    if isinstance(value, list | tuple):
        return any(map(_holds_truth, value))
    return is_truth(value)


def nearest(given: str, names: Iterable[str]) -> str:
    """A sentence with the nearest of some names of settings, or nothing."""
    return wording.nearest(given.lower(), names, cutoff=0.5)
