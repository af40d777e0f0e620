"""Columns of places that are named like settings: they hold for that field alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from geofield.errors import FormatError, SettingsError
from geofield.settings import SECTIONS, Settings, with_values

#: Settings of one picture or of lists of places: no column of a place holds them.
_NOT_PER_PLACE = {"bands", "crs", "scaling", "include", "exclude", "radius_m"}
_NOT_PER_PLACE |= {"ab_lonlat", "through_lonlat", "start_lonlat"}


def setting_names() -> set[str]:
    """What a column may be called to hold a setting of its field."""
    names = {"heading_deg"}
    for section in SECTIONS[:4]:
        names |= set(type(getattr(Settings(), section)).model_fields)
    return names - _NOT_PER_PLACE


def as_settings(settings: Settings, said: Mapping[str, Any]) -> Settings:
    """Settings with what the columns of a place say."""
    if not said:
        return settings
    values = dict(said)
    if "heading_deg" in values:
        values["direction"] = str(values.pop("heading_deg"))
    elif "direction" in values:
        values["direction"] = str(values["direction"])
    return with_values(settings, **values)


def check_settings(file: str, said: pa.Table, settings: Settings | None) -> None:
    """Judge every value that occurs, before any work."""
    for name in said.column_names:
        column = said[name]
        nested = pa.types.is_nested(column.type)  # a machine as a mapping
        for value in (column if nested else pc.unique(column)).to_pylist():
            if missing(value):
                continue
            try:
                as_settings(settings or Settings(), {name: value})
            except SettingsError as error:
                row = column.to_pylist().index(value) + 1
                words = error.message.removeprefix("Settings are not valid: ")
                raise FormatError(
                    f"{file}, row {row}: column {name!r} is named like a setting, and "
                    f"{value!r} is none: {words}",
                    hint="Correct the value, or rename the column if it is something else.",
                ) from None


def missing(value: Any) -> bool:
    """Whether a value says nothing."""
    return value is None or (isinstance(value, float) and math.isnan(value))
