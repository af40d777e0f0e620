"""Names of fields in places that allow less than a person does."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable
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


def unlike(
    name: str,
    taken: set[str],
    joint: str,
    *,
    length: int | None = None,
    key: Callable[[str], str] = str.lower,
) -> str:
    """A name that is not taken, with a number behind it where it must have one; taken from now on.

    Parameters
    ----------
    taken : set of str
        Keys of the names that are taken; changed.
    joint : str
        Between name and number.
    length : int, optional
        What the name is cut to where a number comes behind it.
    key : callable
        What must differ; the name in small letters when not given.
    """
    unique, number = name, 1
    while key(unique) in taken:
        number += 1
        unique = f"{name[:length]}{joint}{number}"
    taken.add(key(unique))
    return unique


def cut_name(name: str, length: int) -> str:
    """A name cut to a number of characters, at its end marked with an ellipsis."""
    return name if len(name) <= length else f"{name[: length - 1]}…"


def line_names(segments: gpd.GeoDataFrame) -> list[str]:
    """``Track 7`` for an unbroken track's first segment, ``Track 7-2`` for its second."""
    return [
        f"Track {track}" if segment == 1 else f"Track {track}-{segment}"
        for track, segment in zip(segments["track_no"], segments["segment_no"], strict=True)
    ]
