"""FlatGeobuf: one file per layer in the metric CRS, with a spatial index."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from geofield.formats.arrow import write_layer
from geofield.formats.foreign import RawLayer, files_in, read_foreign, read_vector
from geofield.formats.origin import lineage
from geofield.model import Dataset


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``flatgeobuf/<layer>.fgb`` for every layer."""
    written, told = [], lineage(dataset)
    for layer in dataset.layers():
        path = folder / "flatgeobuf" / f"{layer.name}.fgb"
        about = {"TITLE": layer.title, "DESCRIPTION": told}
        # The index keeps rows near each other together; readers sort by the key again.
        about["TEMPORARY_DIR"] = str(folder)
        write_layer(dataset, layer, path, "FlatGeobuf", layer_options=about)
        written.append(path)
    return written


def read(path: Path) -> Dataset:
    """The dataset in a FlatGeobuf file, or in all of a folder."""
    files = files_in(path, ".fgb")
    return read_foreign([RawLayer(file.stem, read_vector(file)) for file in files], path)
