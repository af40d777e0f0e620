"""What is known of a learned model: the JSON file beside it."""

from __future__ import annotations

import json
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from geofield.errors import GeofieldError


def facts(name: str, folder: Path | None = None) -> dict[str, Any]:
    """Return what ``NAME.json`` of this package, or of another folder, says.

    Raises
    ------
    GeofieldError
        If there is none of that name, or its file is damaged.
    """
    try:
        text = model_file(f"{name}.json", folder).read_text(encoding="utf-8")
        found: dict[str, Any] = json.loads(text)
    except (OSError, ValueError) as error:
        raise unreadable(name, folder) from error
    return found


def model_file(file_name: str, folder: Path | None) -> Traversable:
    """Return a model's file of this package, or of another folder."""
    return (files("geofield.learned") if folder is None else folder) / file_name


def unreadable(name: str, folder: Path | None) -> GeofieldError:
    """Return the error of a model that is missing or damaged."""
    place = "of this installation" if folder is None else f"in {folder}"
    return GeofieldError(f"The model {name!r} {place} cannot be read.")
