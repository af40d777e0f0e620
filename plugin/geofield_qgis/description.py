"""The command line's own description of itself, shipped with the plugin.

`geofield settings --json` writes it; a test holds it equal to the settings of the engine. So each
parameter is described once, in the engine, and none can be forgotten here.
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any

#: Units at the end of a name, and how a person writes them.
_UNITS = {"_m2": "m²", "_m": "m", "_px": "px", "_mb": "MB", "_days": "days", "_lonlat": ""}
_WRITTEN = {"ab": "A-B line", "crs": "CRS", "stem": "file name", "further": "further options"}
FILE = Path(__file__).with_name("description.json")


@lru_cache(maxsize=1)
def _all() -> dict[str, Any]:
    return json.loads(FILE.read_text(encoding="utf-8"))


def settings() -> dict[str, dict[str, Any]]:
    """Every setting by its name, such as ``tracks.spacing_m``."""
    return {f"{row['section']}.{row['name']}": row for row in _all()["settings"]}


def command_help(command: str) -> list[str]:
    """What a command does, in its own words: paragraphs, the first of one sentence."""
    return [" ".join(part.split()) for part in _all()["commands"][command]["help"].split("\n\n")]


def parameters(command: str) -> list[dict[str, Any]]:
    """The parameters of a command; those that are settings with all that is known of them."""
    known = settings()
    rows = []
    for row in _all()["commands"][command]["parameters"]:
        if "setting" in row:
            rows.append({**known[row["setting"]], "setting": row["setting"]})
        else:
            rows.append(row)
    return rows


def label_of(row: dict[str, Any]) -> str:
    """A short label of a parameter, with its unit; what it means is its description."""
    name, unit = str(row["name"]), ""
    for end, written in _UNITS.items():
        if name.endswith(end):
            name, unit = name[: -len(end)], written
            break
    label = _WRITTEN.get(name, name.replace("_", " "))
    label = label[0].upper() + label[1:]
    return f"{label} ({unit})" if unit else label


def said(language: str) -> list[tuple[str, str]]:
    """Sentences of the engine, as patterns, and what they are in another language."""
    return [tuple(row) for row in _all()["said"].get(language, ())]


def formats() -> list[str]:
    """Names of the formats that a plan can be written in."""
    return [row["name"] for row in _all()["formats"]]


def layers() -> list[str]:
    """Layers of a plan."""
    return sorted({name for row in _all()["formats"] for name in row["layers"]})
