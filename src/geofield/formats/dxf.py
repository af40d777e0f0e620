"""DXF of lines for drawing programs: outline, obstacles, segments and gaps, a layer each.

Coordinates are metres of the metric CRS; a DXF file has no place to say which one, so a
``.prj`` lies beside it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from geofield import schema
from geofield.formats.arrow import exact_geometry, write_layer
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
    import pyarrow as pa

    names: list[str] = []
    lines: list[Any] = []
    for name, drawing_layer in LAYERS.items():
        table = dataset.table(name)
        if name == "obstacles":
            table = table[table["status"] != "rejected"]
        shapes = exact_geometry(schema.layer(name), table)
        if name in ("field", "obstacles"):
            shapes = shapely.get_rings(shapes)
            shapes = np.array([shapely.LineString(ring.coords) for ring in shapes], dtype=object)
        names += [drawing_layer] * len(shapes)
        lines += list(shapes)
    content = pa.table(
        {
            "Layer": pa.array(names, pa.string()),
            "geom": pa.array(shapely.to_wkb(np.array(lines, dtype=object)), pa.binary()),
        }
    )
    path = folder / f"{stem}.dxf"
    write_layer(
        content,
        path,
        layer="entities",
        driver="DXF",
        geometry_type="LineString",
        crs=dataset.crs,
    )
    beside = path.with_suffix(".prj")
    beside.write_text(dataset.crs.to_wkt("WKT1_ESRI") + "\n", encoding="utf-8")
    return [path, beside]
