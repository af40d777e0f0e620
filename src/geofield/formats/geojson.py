"""GeoJSON by RFC 7946: one file per layer, WGS 84, seven decimals, right-hand rule."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pyproj import CRS

from geofield.formats.arrow import write_layer
from geofield.formats.foreign import RawLayer, files_in, read_foreign, read_vector
from geofield.formats.origin import lineage
from geofield.model import Dataset


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``geojson/<layer>.geojson`` for every layer."""
    written = []
    about = {"RFC7946": "YES", "DESCRIPTION": lineage(dataset)}
    for layer in dataset.layers():
        path = folder / "geojson" / f"{layer.name}.geojson"
        write_layer(dataset, layer, path, "GeoJSON", lonlat=True, layer_options=about)
        written.append(path)
    return written


def read(path: Path, *, crs: CRS | None = None) -> Dataset:
    """The dataset in a GeoJSON file, or in all GeoJSON files of a folder."""
    files = files_in(path, ".geojson", ".json")
    return read_foreign([RawLayer(file.stem, read_vector(file)) for file in files], path, crs=crs)
