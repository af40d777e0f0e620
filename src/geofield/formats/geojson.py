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

DECIMALS = 7
# GDAL takes `00000x` and `99999x` at the end of a long number for noise and drops them: with seven
# decimals that moves what lies at a tenth of a degree (-62.0000008) by up to a tenth of a metre.
# With three decimals more, the numbers rounded before, there are nothing but zeros for it to drop.
_GDAL_DECIMALS = DECIMALS + 3
_RESOLUTION = '"xy_coordinate_resolution": 1e-{:02d},'


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``geojson/<layer>.geojson`` for every layer."""
    written = []
    about = {
        "RFC7946": "YES",
        "COORDINATE_PRECISION": str(_GDAL_DECIMALS),
        "DESCRIPTION": lineage(dataset),
    }
    for layer in dataset.layers():
        path = folder / "geojson" / f"{layer.name}.geojson"
        write_layer(
            dataset, layer, path, "GeoJSON", lonlat=True, decimals=DECIMALS, layer_options=about
        )
        _say_resolution(path)
        written.append(path)
    return written


def _say_resolution(path: Path) -> None:
    """In the head of a file the decimals that there are, not those that GDAL was given."""
    with path.open("r+b") as file:
        before, found, _ = file.read(1 << 16).partition(_RESOLUTION.format(_GDAL_DECIMALS).encode())
        if found:
            file.seek(len(before))
            file.write(_RESOLUTION.format(DECIMALS).encode())


def read(path: Path, *, crs: CRS | None = None) -> Dataset:
    """The dataset in a GeoJSON file, or in all GeoJSON files of a folder."""
    files = files_in(path, ".geojson", ".json")
    return read_foreign([RawLayer(file.stem, read_vector(file)) for file in files], path, crs=crs)
