"""Parameters of Processing, made from the command line's description of itself."""

from __future__ import annotations

import json
import math
import os
from contextlib import suppress
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingAlgorithm,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterFile,
    QgsProcessingParameterFolderDestination,
    QgsProcessingParameterNumber,
    QgsProcessingParameterPoint,
    QgsProcessingParameterRange,
    QgsProcessingParameterString,
)

from . import compat, description
from .words import tr

LONLAT = QgsCoordinateReferenceSystem("EPSG:4326")
#: What nearly everybody sets; all else is among the advanced parameters.
USUAL = {
    "tracks.spacing_m",
    "tracks.direction",
    "tracks.headland_m",
    "tracks.route",
    "tracks.turning_radius_m",
    "obstacles.buffer_m",
    "obstacles.radius_m",
    "imagery.size_m",
    "export.formats",
    "size_m",
    "resolution_m",
    "distance_m",
    "formats",
    "name",
    "customer",
    "farm",
}  # fmt: skip
#: Sections whose settings count for a command though none of its options carries them: they go
#: through the environment.
THROUGH_ENVIRONMENT = {
    "run": ("fetch", "export"),
    "field": ("fetch",),
    "obstacles": ("fetch",),
    "tiles": ("fetch",),
}
#: Keys and sources of one's own stay in a settings file, for Processing writes what it is given
#: to its history.
IN_SETTINGS_FILE = ("fetch.keys", "fetch.sources")


def name_of(row: dict[str, Any]) -> str:
    """A parameter's name: SPACING_M for tracks.spacing_m."""
    return str(row["name"]).upper()


def definitions(row: dict[str, Any]) -> list[QgsProcessingParameterDefinition]:
    """The parameters that ask for one value of the command line; an A-B line takes two."""
    made = [_definition(name, label, row) for name, label in _asked(row)]
    for each in made:
        each.setHelp(
            tr("TOML file with a table per stage, for what this form leaves at its default.")
            if row["name"] == "settings_file"
            else tr(row["description"])
        )
        if row.get("setting", row["name"]) not in USUAL:
            each.setFlags(each.flags() | compat.ADVANCED)
    return made


def words(
    row: dict[str, Any], algorithm: QgsProcessingAlgorithm, values: dict[str, Any], context: Any
) -> list[str]:
    """A value as words of the command line; none when it was not given or is the default."""
    text = as_text(row, algorithm, values, context)
    if text is None:
        # A geofield.toml in the folder that QGIS happens to run in is in no dialogue.
        return [row["option"], os.devnull] if row["name"] == "settings_file" else []
    if row["type"] == "flag":
        return [row["option"]] if text == ["true"] else [row["off"]]
    if row.get("multiple"):
        return [word for part in text for word in (row["option"], part)]
    return [row["option"], *text]


def as_text(
    row: dict[str, Any], algorithm: QgsProcessingAlgorithm, values: dict[str, Any], context: Any
) -> list[str] | None:
    """A value as texts; None when it was not given or is what would be taken anyway."""
    names = [name for name, _ in _asked(row)]
    if any(values.get(name) in (None, "") for name in names):
        return None
    name = names[0]
    kind = _kind(row)
    if kind == "points":
        points = [algorithm.parameterAsPoint(values, each, context, LONLAT) for each in names]
        return [f"{value:.9f}" for point in points for value in (point.x(), point.y())]
    if kind == "flag":
        value = algorithm.parameterAsBoolean(values, name, context)
        return None if value == bool(row["default"]) else [str(value).lower()]
    if kind == "range":
        value = algorithm.parameterAsRange(values, name, context)
        given = [float(each) for each in value]
        unsaid = not given or any(math.isnan(each) for each in given)
        return None if unsaid or given == row["default"] else [repr(each) for each in given]
    if kind in ("integer", "float"):
        whole = kind == "integer"
        read = algorithm.parameterAsInt if whole else algorithm.parameterAsDouble
        number = read(values, name, context)
        return None if number == row["default"] else [repr(number)]
    if kind == "choices":
        chosen = algorithm.parameterAsEnumStrings(values, name, context)
        return None if chosen == row["default"] else chosen
    read = algorithm.parameterAsEnumString if kind == "choice" else algorithm.parameterAsString
    return _as_words(row, read(values, name, context).strip())


def _as_words(row: dict[str, Any], text: str) -> list[str] | None:
    if not text or text == row["default"]:
        return None
    if row.get("multiple"):
        return [part.strip() for part in text.split(";") if part.strip()]
    return [text]


def without_option(command: str, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The settings that count for a command and that none of its parameters carries."""
    carried = {row.get("setting") for row in rows}
    taken = {name_of(row) for row in rows}
    return [
        {**row, "setting": setting}
        for setting, row in description.settings().items()
        if row["section"] in THROUGH_ENVIRONMENT.get(command, ())
        and setting not in carried
        and setting not in IN_SETTINGS_FILE
        and name_of(row) not in taken
    ]


def variable(
    row: dict[str, Any], algorithm: QgsProcessingAlgorithm, values: dict[str, Any], context: Any
) -> dict[str, str]:
    """A setting that is no option of the command, as a variable."""
    text = as_text(row, algorithm, values, context)
    if text is None:
        return {}
    several = row.get("multiple") or row["type"] == "numbers"
    return {variable_name(row): json.dumps(text) if several else text[0]}


def variable_name(row: dict[str, Any]) -> str:
    """The variable that says a setting: GEOFIELD_TRACKS__SPACING_M."""
    return f"GEOFIELD_{row['setting']}".replace(".", "__").upper()


def unsaid(rows: list[dict[str, Any]]) -> dict[str, str | None]:
    """The variables that say what a form shows, without that: what the form shows holds.

    A variable may say one setting, or those of a whole section; the engine reads names in any
    case. Of a section what no form shows stays, such as keys.
    """
    found: dict[str, str | None] = {}
    shown: dict[str, set[str]] = {}
    for row in rows:
        if "setting" in row:
            found[variable_name(row)] = None
            shown.setdefault(f"GEOFIELD_{row['section']}".upper(), set()).add(row["name"])
    for name, text in os.environ.items():
        section = name.upper()
        if section in shown:
            with suppress(ValueError, AttributeError):  # what is no section, the engine refuses
                said = json.loads(text).items()
                rest = {key: value for key, value in said if key.lower() not in shown[section]}
                found[section] = json.dumps(rest) if rest else None
    return found


def _kind(row: dict[str, Any]) -> str:
    if row["type"] == "numbers":
        return "points" if row["name"].endswith("_lonlat") else "range"
    if row["type"] == "choice" or row["name"] == "formats":
        return "choices" if row.get("multiple") else "choice"
    # Several numbers are typed as one text, with semicolons between them.
    return "text" if row.get("multiple") else str(row["type"])


def _asked(row: dict[str, Any]) -> list[tuple[str, str]]:
    """Names and labels of the parameters of one value."""
    label = tr(description.label_of(row))
    if _kind(row) == "points" and row["count"] == 4:
        return [(f"{name_of(row)}_{end}", f"{label} ({end})") for end in "AB"]
    return [(name_of(row), label)]


def _number(name: str, label: str, row: dict[str, Any]) -> QgsProcessingParameterDefinition:
    kind = compat.WHOLE if _kind(row) == "integer" else compat.REAL
    made = QgsProcessingParameterNumber(name, label, kind, row["default"], True)
    if "minimum" in row or "above" in row:
        made.setMinimum(row.get("minimum", 1e-6))
    if "maximum" in row:
        made.setMaximum(row["maximum"])
    return made


def _definition(name: str, label: str, row: dict[str, Any]) -> QgsProcessingParameterDefinition:
    kind, default = _kind(row), row["default"]
    if kind == "points":
        return QgsProcessingParameterPoint(name, label, None, True)
    if kind == "flag":
        return QgsProcessingParameterBoolean(name, label, bool(default), True)
    if kind in ("choice", "choices"):
        options = row.get("choices") or description.formats()
        return QgsProcessingParameterEnum(
            name,
            label,
            options,
            kind == "choices",
            default if kind == "choice" else ",".join(default or []) or None,
            default is None and not row.get("required"),
            True,
        )
    if kind == "range":
        text = ",".join(str(each) for each in default) if default else None
        return QgsProcessingParameterRange(name, label, compat.REAL, text, True)
    if kind in ("float", "integer"):
        return _number(name, label, row)
    if kind in ("path", "file"):
        return QgsProcessingParameterFile(name, label, optional=True)
    if kind == "directory":
        return QgsProcessingParameterFolderDestination(name, label, None, True, False)
    if isinstance(default, (list, dict)):
        default = json.dumps(default) if default else None
    return QgsProcessingParameterString(name, label, default, optional=True)
