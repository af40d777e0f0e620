"""Settings: one section per stage, from a TOML file, the environment and the command line.

Later sources win: defaults, ``geofield.toml``, ``GEOFIELD_TRACKS__SPACING_M=3`` and the like
in the environment, options of the command line. A section's field names are the keyword
arguments of its stage, so that each figure is described once, here.
"""

from geofield.settings.export import ExportSettings, FormatName
from geofield.settings.field import FieldSettings
from geofield.settings.idle import idle
from geofield.settings.imagery import FetchSettings, ImagerySettings, SourceSettings
from geofield.settings.load import as_before, from_mapping, load_settings, with_values
from geofield.settings.machines import Machine
from geofield.settings.obstacles import ObstacleSettings
from geofield.settings.section import LonLat
from geofield.settings.sections import MODELS, SECTIONS, Stage
from geofield.settings.tracks import DirectionName, TrackSettings
from geofield.settings.whole import NAMES, Settings, option_named

__all__ = [
    "MODELS",
    "NAMES",
    "SECTIONS",
    "DirectionName",
    "ExportSettings",
    "FetchSettings",
    "FieldSettings",
    "FormatName",
    "ImagerySettings",
    "LonLat",
    "Machine",
    "ObstacleSettings",
    "Settings",
    "SourceSettings",
    "Stage",
    "TrackSettings",
    "as_before",
    "from_mapping",
    "idle",
    "load_settings",
    "option_named",
    "with_values",
]
