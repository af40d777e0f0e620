"""Settings that are not right, in words."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import get_args

from pydantic import ValidationError

from geofield.errors import SettingsError
from geofield.settings.machines import Machine
from geofield.settings.section import nearest
from geofield.settings.sections import HOMES, MODELS
from geofield.settings.tracks import DirectionName


@contextmanager
def in_words() -> Iterator[None]:
    """Say what is wrong with settings: each by its name, its value and what would be right."""
    try:
        yield
    except ValidationError as error:
        raise SettingsError(_explained(error)) from None


def _explained(error: ValidationError) -> str:
    lines = []
    for problem in error.errors():
        name = ".".join(str(part) for part in problem["loc"])
        # Sources hold keys; a message must not.
        secret = {"sources", "keys"} & set(problem["loc"])
        whole = isinstance(problem.get("input"), Mapping)
        given = [] if secret or whole else [f"given: {problem.get('input')!r}"]
        message = problem["msg"].removeprefix("Value error, ")
        message = message.replace("valid tuple", "list").replace("valid dictionary", "table")
        near = ""
        if problem["type"] == "extra_forbidden":
            message = "there is no such setting"
            section = str(problem["loc"][0])
            within: Iterable[str] = ()
            if section in MODELS and len(problem["loc"]) == 2:
                within = MODELS[section].model_fields
            elif section == "machines":
                within = Machine.model_fields
            elif len(problem["loc"]) == 1:
                within = MODELS
            setting = str(problem["loc"][-1])
            near = nearest(setting, within)
            if setting in HOMES:
                near = f"it belongs to [{HOMES[setting]}]"
        elif not whole and problem["type"] in ("literal_error", "value_error"):
            named = get_args(DirectionName) if "direction" in problem["loc"] else ()
            choices = re.findall(r"'([^']+)'", message) or named
            near = nearest(str(problem.get("input")), choices)
        words = "; ".join([*given, *([near.strip()] if near else [])])
        lines.append(
            f"{name}: {message[:1].lower()}{message[1:]}" + (f" ({words})" if words else "")
        )
    return "Settings are not valid: " + "; ".join(lines) + "."
