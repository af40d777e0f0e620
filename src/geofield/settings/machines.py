"""Machines: what a person says once of a tractor and its implement."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import Field, PositiveFloat

from geofield.errors import SettingsError
from geofield.settings.section import NonNegative, Section, nearest

#: The settings of the tracks that a machine decides.
MACHINE_VALUES = ("width_m", "overlap_m", "turning_radius_m", "offset_m", "clearance_m")


class Machine(Section):
    """A machine: ``[machines.NAME]`` in the settings file, ``--machine NAME`` on the command line.

    Examples
    --------
    >>> Machine(width_m=12, overlap_m=0.5, turning_radius_m=6).track_values()["width_m"]
    12.0
    """

    width_m: PositiveFloat = Field(description="Working width, metres: the spacing follows.")
    overlap_m: float | None = Field(
        None, description="How far neighbouring passes overlap, metres."
    )
    turning_radius_m: PositiveFloat | None = Field(
        None, description="Smallest radius that it turns on, metres."
    )
    overhang_m: NonNegative = Field(
        0.0,
        description="How far it reaches beyond its working width on either side, metres: half the "
        "width and this are the clearance kept from obstacles.",
    )
    offset_m: float | None = Field(
        None, description="Of its first track from the edge, metres; half the width by default."
    )

    def track_values(self) -> dict[str, Any]:
        """The settings of the tracks that follow from the machine."""
        values = self.model_dump(exclude={"overhang_m"}, exclude_none=True)
        return values | {"clearance_m": self.width_m / 2.0 + self.overhang_m}


def machine_named(name: str, machines: Mapping[str, Machine]) -> Machine:
    """The machine of a name.

    Raises
    ------
    SettingsError
        Naming those there are.
    """
    if name in machines:
        return machines[name]
    known = ", ".join(machines)
    raise SettingsError(
        f"There is no machine {name!r}." + nearest(name, machines),
        hint=f"Known: {known}."
        if known
        else f"Write it into geofield.toml: [machines.{name}] and below it width_m = 6.",
    )
