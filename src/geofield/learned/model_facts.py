"""What is known of a learned model: the JSON file beside it."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

from geofield.errors import GeofieldError


def facts(name: str) -> dict[str, Any]:
    """Return what ``NAME.json`` of this package says.

    Raises
    ------
    GeofieldError
        If there is none of that name, or its file is damaged.
    """
    try:
        text = (files("geofield.learned") / f"{name}.json").read_text(encoding="utf-8")
        found: dict[str, Any] = json.loads(text)
    except (OSError, ValueError) as error:
        raise GeofieldError(f"The model {name!r} of this installation cannot be read.") from error
    return found
