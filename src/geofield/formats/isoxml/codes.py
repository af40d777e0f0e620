"""Codes of ISO 11783-10 that field, obstacles and guidance need, by name."""

from __future__ import annotations

from enum import StrEnum

#: Designators hold so many characters.
DESIGNATOR = 32
#: Decimals of a position: at most nine, a tenth of a millimetre.
DECIMALS = 9


class PolygonType(StrEnum):
    """PLN, attribute A."""

    BOUNDARY = "1"
    TREATMENT_ZONE = "2"
    WATER = "3"
    BUILDING = "4"
    ROAD = "5"
    OBSTACLE = "6"
    FLAG = "7"
    OTHER = "8"
    MAIN_FIELD = "9"
    HEADLAND = "10"
    BUFFER_ZONE = "11"
    WINDBREAK = "12"


class LineType(StrEnum):
    """LSG, attribute A."""

    EXTERIOR = "1"
    INTERIOR = "2"
    TRAMLINE = "3"
    SAMPLING_ROUTE = "4"
    GUIDANCE = "5"
    DRAINAGE = "6"
    FENCE = "7"
    FLAG = "8"
    OBSTACLE = "9"


class PointType(StrEnum):
    """PNT, attribute A."""

    FLAG = "1"
    OTHER = "2"
    FIELD_ACCESS = "3"
    STORAGE = "4"
    OBSTACLE = "5"
    GUIDANCE_A = "6"
    GUIDANCE_B = "7"
    GUIDANCE_CENTRE = "8"
    GUIDANCE_POINT = "9"
    REFERENCE_POINT = "10"
    HOMEBASE = "11"


class Guidance(StrEnum):
    """GPN, attribute C."""

    AB = "1"
    A_PLUS = "2"
    CURVE = "3"
    PIVOT = "4"
    SPIRAL = "5"


#: GPN, attribute E: the terminal repeats the line on both sides, or not at all.
REPEAT_BOTH, REPEAT_NONE = "1", "4"
#: GPN, attribute D, of pivots; without it they are full circles.
CLOCKWISE, COUNTER_CLOCKWISE = "1", "2"
#: GPN, attribute F: the line does not go on beyond its ends.
EXTEND_NONE = "4"
#: GPN, attribute I: made on a desk, not by a receiver.
DESKTOP = "16"
