"""All settings of a run, one section per stage."""

from __future__ import annotations

from typing import Any, Self

from pydantic import Field, ModelWrapValidatorHandler, model_validator
from pydantic.fields import FieldInfo

from geofield.settings.explain import in_words
from geofield.settings.export import ExportSettings
from geofield.settings.field import FieldSettings
from geofield.settings.imagery import FetchSettings, ImagerySettings
from geofield.settings.machines import Machine
from geofield.settings.obstacles import ObstacleSettings
from geofield.settings.section import Section
from geofield.settings.sections import MODELS
from geofield.settings.tracks import TrackSettings


class Settings(Section):
    """All settings of a run. A plain value: :func:`load_settings` reads file and environment.

    Examples
    --------
    >>> Settings(tracks={"spacing_m": 3}).tracks.spacing_m
    3.0
    """

    imagery: ImagerySettings = ImagerySettings()
    field: FieldSettings = FieldSettings()
    obstacles: ObstacleSettings = ObstacleSettings()
    tracks: TrackSettings = TrackSettings()
    export: ExportSettings = ExportSettings()

    # What follows from a machine stands in `tracks`, under its name.
    machines: dict[str, Machine] = Field(default={}, exclude=True, repr=False)
    # Keys live here: never written into a product.
    fetch: FetchSettings = Field(default=FetchSettings(), exclude=True, repr=False)

    @model_validator(mode="wrap")
    @classmethod
    def _in_words(cls, values: Any, check: ModelWrapValidatorHandler[Self]) -> Self:
        """Say what is wrong as all other ways to settings do."""
        with in_words():
            return check(values)


UNITS = ("_m", "_deg", "_px", "_ha")


def option_named(name: str, field: FieldInfo) -> str:
    """The option of the command line that stands for a setting: its name without the unit."""
    extra = field.json_schema_extra
    if isinstance(extra, dict) and isinstance(extra.get("option"), str):
        return str(extra["option"])
    unit = next((each for each in UNITS if name.endswith(each)), "")
    return "--" + name.removesuffix(unit).replace("_", "-")


#: What the options of settings are called in Python.
NAMES = {
    option_named(name, field)[2:]: name
    for model in MODELS.values()
    for name, field in model.model_fields.items()
}
