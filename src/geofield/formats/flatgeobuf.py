"""FlatGeobuf: one file per layer in the metric CRS, with a spatial index."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from geofield import schema
from geofield.formats.arrow import arrow_table, batches, write_layer
from geofield.formats.foreign import RawLayer, read_foreign, read_vector
from geofield.formats.origin import lineage
from geofield.model import Dataset


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``flatgeobuf/<layer>.fgb`` for every layer."""
    written = []
    for layer in dataset.layers():
        path = folder / "flatgeobuf" / f"{layer.name}.fgb"
        if layer.name == schema.TRACK_POINTS.name:
            table = batches(layer, dataset.point_chunks())
        else:
            table = arrow_table(layer, dataset.table(layer.name))
        write_layer(
            table,
            path,
            layer=layer.name,
            driver="FlatGeobuf",
            geometry_type=layer.geometry,
            crs=dataset.crs,
            # The index keeps rows near each other together; readers sort by the key again.
            layer_options={
                "TITLE": layer.title,
                "DESCRIPTION": lineage(dataset),
                "TEMPORARY_DIR": str(folder),
            },
        )
        written.append(path)
    return written


def read(path: Path) -> Dataset:
    """The dataset in a FlatGeobuf file, or in all of a folder."""
    files = sorted(path.glob("*.fgb")) if path.is_dir() else [path]
    return read_foreign([RawLayer(file.stem, read_vector(file)) for file in files], path)
