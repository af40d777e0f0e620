"""The sections of the settings, and the names in each."""

from __future__ import annotations

from typing import Literal, get_args

from geofield.settings.export import ExportSettings
from geofield.settings.field import FieldSettings
from geofield.settings.imagery import FetchSettings, ImagerySettings
from geofield.settings.obstacles import ObstacleSettings
from geofield.settings.section import Section
from geofield.settings.tracks import TrackSettings

Stage = Literal["imagery", "field", "obstacles", "tracks", "export", "fetch"]
MODELS: dict[str, type[Section]] = {
    "imagery": ImagerySettings,
    "field": FieldSettings,
    "obstacles": ObstacleSettings,
    "tracks": TrackSettings,
    "export": ExportSettings,
    "fetch": FetchSettings,
}
SECTIONS: tuple[Stage, ...] = get_args(Stage)
#: The section of each name: none is in two.
HOMES: dict[str, Stage] = {name: of for of in SECTIONS for name in MODELS[of].model_fields}
