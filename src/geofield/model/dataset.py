"""Dataset: the tables of one field with what is known of their origin.

It is what every format writes and reads: layer names of `geofield.schema` to tables, in one
metric CRS. Formats know datasets; only `geofield.plan` knows how a plan becomes one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pyproj import CRS

from geofield import schema
from geofield.errors import CRSMismatchError
from geofield.grid import Grid
from geofield.model.evidence import obstacle_doubts, shown_from_json
from geofield.model.frame import Shown
from geofield.model.scene import ImagerySource

if TYPE_CHECKING:
    import geopandas as gpd


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a dataset comes from.

    Attributes
    ----------
    software : str
        Name and version.
    source : ImagerySource
        The picture behind it.
    settings : mapping
        All settings of the run, as plain JSON values.
    evidence : mapping
        What the stages measured (field quality, detection method and counts), plain JSON.
    """

    software: str = ""
    source: ImagerySource = field(default_factory=ImagerySource)
    settings: Mapping[str, Any] = field(default_factory=dict)
    evidence: Mapping[str, Any] = field(default_factory=dict)

    @property
    def obstacle_doubts(self) -> tuple[str, ...]:
        """What the picture did not allow when obstacles were looked for, in words."""
        return obstacle_doubts(self.evidence)

    @property
    def shown_px(self) -> Shown | None:
        """Where the picture has data, pixel coordinates; None where that is all of it."""
        return shown_from_json(self.evidence)


@dataclass(frozen=True, eq=False)
class Dataset:
    """Tables of one field.

    Attributes
    ----------
    tables : mapping of str to GeoDataFrame
        By layer name; all in `crs`. `track_points` may be absent though there are
        tracks: ask :meth:`point_chunks`.
    crs : CRS
        The metric CRS.
    name : str
        The field's name.
    provenance : Provenance
    grid : Grid or None
        The picture's grid: gives `x_px`, `y_px` their meaning.
    scene_path : Path or None
        The picture's file beside the products, for projects that show it.
    points : callable or None
        Yields the track points in chunks, for products that stream them.
    notes : tuple of str
        What a reader took as what in another program's file, for people.
    """

    tables: Mapping[str, gpd.GeoDataFrame]
    crs: CRS
    name: str = "field"
    provenance: Provenance = field(default_factory=Provenance)
    grid: Grid | None = None
    scene_path: Path | None = None
    points: Callable[[], Iterator[gpd.GeoDataFrame]] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        refuse_other_crs(self.tables, self.crs)

    @property
    def tracks_stand(self) -> bool:
        """Whether tracks that are edited in its file stand in a later run."""
        return len(self.table(schema.FIELD.name)) < 2

    def picture_lies_in(self, folder: Path) -> bool:
        """Whether the picture, where there is one, is in a folder."""
        scene = self.scene_path
        return scene is None or scene.resolve().parent == folder.resolve()

    def table(self, name: str) -> gpd.GeoDataFrame:
        """The table of a layer; an empty one where the dataset has none."""
        if name in self.tables:
            return self.tables[name]
        if name == schema.TRACK_POINTS.name and self.points is not None:
            import pandas as pd

            chunks = list(self.points())
            if chunks:
                return pd.concat(chunks, ignore_index=True)
        return schema.empty(schema.layer(name), self.crs)

    def has(self, name: str) -> bool:
        """Whether a layer has rows."""
        if name == schema.TRACK_POINTS.name and self.points is not None:
            return len(self.table(schema.SEGMENTS.name)) > 0
        return name in self.tables and len(self.tables[name]) > 0

    def layers(self, *, working: bool = False) -> list[schema.Layer]:
        """The layers to write, in the schema's order: optional ones only where they have rows.

        With `working` those, too, that only the plan's own file has.
        """
        return [
            each
            for each in schema.LAYERS
            if (not each.optional or self.has(each.name)) and (working or not each.working)
        ]

    def point_chunks(self) -> Iterator[gpd.GeoDataFrame]:
        """The track points, a table at a time."""
        if self.points is not None:
            yield from self.points()
        elif self.has(schema.TRACK_POINTS.name):
            yield self.tables[schema.TRACK_POINTS.name]


def refuse_other_crs(layers: Mapping[str, Any], crs: CRS) -> None:
    """Refuse layers, as tables or rows, that are in another CRS than their dataset's.

    Raises
    ------
    CRSMismatchError
    """
    for name, layer in layers.items():
        # To compare two takes as long as to make a small table.
        if layer.crs is not crs and (layer.crs is None or CRS(layer.crs) != crs):
            raise CRSMismatchError(f"Layer {name!r} is not in the dataset's {crs.name}.")
