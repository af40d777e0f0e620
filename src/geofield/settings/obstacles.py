"""Stage 3, the obstacles."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, PositiveFloat

from geofield.methods import Strategy
from geofield.settings.section import NonNegative, Radius, Reach, Section


class ObstacleSettings(Section):
    """Stage 3: the obstacles."""

    strategy: Strategy = Field(
        "auto", description="How obstacles are found: auto, or a way of the study."
    )
    radius_m: tuple[Radius, Radius] | None = Field(
        None,
        description="Smallest and largest crown radius, metres; 1 to 15 with auto, 2 to 9 with "
        "the study's strategies by default.",
    )
    buffer_m: Reach = Field(1.5, description="Safety margin around each obstacle, metres.")
    cost_missed: PositiveFloat = Field(
        30.0,
        description="auto: what driving into a thing costs, against a look at one place of the "
        "map; it decides what is detected, and what only possible.",
    )
    careful: bool = Field(False, description="auto: drive around what is only possible, too.")
    min_confidence: Annotated[float, Field(ge=0, le=1)] | None = Field(
        None,
        description="auto: confidence from which a thing is driven around, instead of the cost.",
    )
    polarity: Literal["dark", "bright", "both"] = Field(
        "both", description="auto: crowns darker or brighter than what is around them."
    )
    others: bool = Field(
        True, description="auto: find what is not round, too: ponds, huts, clumps."
    )
    edge_method: Literal["sobel", "prewitt", "roberts", "canny"] | None = Field(
        None,
        description="The study's strategies: edge method.",
        json_schema_extra={"study": True},
    )
    threshold: NonNegative | None = Field(
        None, description="single: edge threshold.", json_schema_extra={"study": True}
    )
    circle_method: Literal["phase_code", "two_stage"] = Field(
        "phase_code",
        description="The study's strategies: circle transform.",
        json_schema_extra={"study": True},
    )
    sensitivity: Annotated[float, Field(ge=0, le=1)] = Field(
        0.85,
        description="The study's strategies: of the circle transform.",
        json_schema_extra={"study": True},
    )
    grey_check: Literal["none", "absolute", "relative"] = Field(
        "none",
        description="Drop discs brighter than 127.37 (absolute) or than the field (relative).",
        json_schema_extra={"study": True},
    )
