"""DXF of lines for drawing programs: outline, obstacles, segments and gaps, a layer each.

Coordinates are metres of the metric CRS; a DXF file has no place to say which one, so a
``.prj`` lies beside it; `geofield.formats.drawing` reads it, and those of other programs.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pyproj import CRS

from geofield import schema
from geofield.errors import FormatError
from geofield.formats.arrow import disk_hint, exact_geometry, gdal_config, writing
from geofield.formats.foreign import RawLayer, read_foreign, read_vector
from geofield.formats.terminal import avoided
from geofield.model import Dataset

#: DXF layer by layer of the schema.
LAYERS = {
    "field": "FIELD",
    "obstacles": "OBSTACLES",
    "segments": "TRACKS",
    "gaps": "GAPS",
}


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``{stem}.dxf`` and ``{stem}.prj``."""
    import geopandas as gpd
    import pyogrio

    names: list[str] = []
    lines: list[Any] = []
    for name, drawing_layer in LAYERS.items():
        table = avoided(dataset) if name == "obstacles" else dataset.table(name)
        shapes = exact_geometry(schema.layer(name), table)
        names += [drawing_layer] * len(shapes)
        lines += list(shapes)
    path = folder / f"{stem}.dxf"
    # Polygons are written ring by ring, each with the flag that says it is closed.
    # Arrow would create the column `Layer`, which the driver has already.
    frame = gpd.GeoDataFrame({"Layer": names}, geometry=lines, crs=dataset.crs)
    with writing(path), gdal_config(DXF_WRITE_HATCH="NO"):
        pyogrio.write_dataframe(frame, path, driver="DXF", layer="entities", use_arrow=False)
        written = pyogrio.read_info(path, force_feature_count=True)["features"]
    if written < len(frame):  # on a full disk, of which GDAL does not tell
        raise FormatError(f"{path.name} could not be written whole.", hint=disk_hint(path))
    beside = path.with_suffix(".prj")
    beside.write_text(dataset.crs.to_wkt("WKT1_ESRI") + "\n", encoding="utf-8", newline="\n")
    return [path, beside]


def read(path: Path, *, crs: CRS | None = None) -> Dataset:
    """The dataset in a DXF file, layer by layer."""
    drawn = read_vector(path)
    layers = [RawLayer(str(name), of_one) for name, of_one in drawn.groupby("Layer", sort=False)]
    return read_foreign(layers, path, crs=crs)
