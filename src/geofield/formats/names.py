"""Names of fields in places that allow less than a person does."""

from __future__ import annotations

import re
import unicodedata
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import geopandas as gpd

# What Windows reserves, whatever the suffix: terminals and sticks are read there.
_RESERVED = {"CON", "PRN", "AUX", "NUL", *(f"{d}{n}" for d in ("COM", "LPT") for n in range(1, 10))}
_LETTERS = str.maketrans(
    {"ß": "ss", "ø": "o", "Ø": "O", "æ": "ae", "Æ": "Ae", "œ": "oe", "ł": "l", "Ł": "L", "đ": "d"}
)


def safe_name(name: str, *, length: int = 40) -> str:
    """A name as part of a file's path: ASCII letters, digits, ``-`` and ``_``.

    Accents go, letters of other scripts become ``_``; never empty, never a reserved name.
    """
    plain = unicodedata.normalize("NFKD", name.translate(_LETTERS))
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    plain = re.sub(r"[^A-Za-z0-9-]+", "_", plain).strip("_-")[:length].rstrip("_-")
    if not plain:
        return "field"
    return f"{plain}_" if plain.upper() in _RESERVED else plain


def cut_name(name: str, length: int) -> str:
    """A name cut to a number of characters, at its end marked with an ellipsis."""
    return name if len(name) <= length else f"{name[: length - 1]}…"


def line_names(segments: gpd.GeoDataFrame) -> list[str]:
    """``Track 7`` for an unbroken track's first segment, ``Track 7-2`` for its second."""
    return [
        f"Track {track}" if segment == 1 else f"Track {track}-{segment}"
        for track, segment in zip(segments["track_no"], segments["segment_no"], strict=True)
    ]
