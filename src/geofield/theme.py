"""One theme: the colours and dashes of map picture, QGIS, KML and the pages in the browser.

A thing looks the same wherever it is shown. Colours are ``#rrggbb``; dashes are lengths of line
and space in pixels, or None for a full line.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any

OUTLINE = "#ffd54f"
#: An outline that a person should look at, and where it is the picture's frame.
DOUBT = "#ff8f00"
TRACK = "#ffffff"
GAP = "#ff80ab"
HEADLAND = "#80deea"
TURN = "#b39ddb"
#: A turn that the machine cannot drive.
UNFIT = "#ff1744"


@dataclass(frozen=True, slots=True)
class Look:
    """How an obstacle is drawn."""

    color: str
    dash: tuple[int, int] | None = None


#: By the status of an obstacle.
STATUS: Mapping[str, Look] = MappingProxyType(
    {
        "detected": Look("#ff7043"),
        "possible": Look("#ffca28", (2, 6)),
        "confirmed": Look("#66bb6a"),
        "added": Look("#42a5f5"),
        "rejected": Look("#bdbdbd", (6, 6)),
    }
)


def rgb(color: str) -> tuple[int, int, int]:
    """Red, green and blue of a colour, 0 to 255.

    >>> rgb("#ff8000")
    (255, 128, 0)
    """
    value = int(color[1:], 16)
    return value >> 16, (value >> 8) & 255, value & 255


def web_theme() -> dict[str, Any]:
    """The theme as JSON values, for pages in the browser."""
    return {
        "outline": OUTLINE,
        "doubt": DOUBT,
        "track": TRACK,
        "gap": GAP,
        "headland": HEADLAND,
        "turn": TURN,
        "unfit": UNFIT,
        "status": {status: asdict(look) for status, look in STATUS.items()},
    }
