"""Stage 2, the outline."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from geofield.settings.section import LonLat, NonNegative, Section


class FieldSettings(Section):
    """Stage 2: the outline."""

    method: Literal["auto", "study"] = Field(
        "auto",
        description="How the outline is found: auto (colour, near infrared, edges) or study "
        "(brightness threshold).",
    )
    holes: Literal["fill", "keep"] | None = Field(
        None,
        description="What becomes of crowns, huts and ponds inside: fill (the way of auto) or "
        "keep as holes (the way of study).",
    )
    min_hole_m2: NonNegative = Field(
        20.0,
        description="Holes below this size are filled, square metres.",
        json_schema_extra={"option": "--min-hole"},
    )
    tolerance_px: NonNegative = Field(
        3.0,
        description="How far the straightened outline may leave the pixels; 0 keeps them all.",
    )
    smooth: Literal["none", "diffusion"] = Field(
        "none", description="Smoothing of the picture first; diffusion is anisotropic."
    )
    include: tuple[LonLat, ...] = Field(
        (),
        description="Further ground that belongs to the field, LON,LAT; repeat for several.",
        json_schema_extra={"option": "--include-lonlat"},
    )
    exclude: tuple[LonLat, ...] = Field(
        (),
        description="Ground that does not belong to the field, LON,LAT; repeat for several.",
        json_schema_extra={"option": "--exclude-lonlat"},
    )
