"""DXF of lines for drawing programs: outline, obstacles, segments and gaps, a layer each.

Coordinates are metres of the metric CRS; a DXF file has no place to say which one, so a
``.prj`` lies beside it. Of other programs' drawings a closed line is an area.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from pyproj import CRS
from pyproj.exceptions import CRSError as NoCRS

from geofield import schema
from geofield.errors import FormatError
from geofield.formats.arrow import disk_hint, exact_geometry, gdal_config, writing
from geofield.formats.foreign import RawLayer, read_foreign, read_vector
from geofield.formats.terminal import avoided
from geofield.model import Dataset
from geofield.wording import counted

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
    """The dataset in a DXF file, layer by layer: closed lines and circles are areas.

    Written words are left out, and hatches where lines are drawn around them, as they mostly are;
    of what is no part of the drawing (sheets of paper, points of dimensions) nothing is said.
    """
    with gdal_config(**_encoding(path)):
        frame = read_vector(path)
    frame = frame[frame["PaperSpace"].isna() & (frame["Layer"] != "Defpoints")]
    shapes = np.asarray(frame.geometry.to_numpy(), dtype=object)
    rings = shapely.is_ring(shapes) & (shapely.get_num_coordinates(shapes) > 3)
    shapes[rings] = [shapely.Polygon(line) for line in shapes[rings]]
    kinds = frame["SubClasses"].fillna("")
    texts = np.asarray(kinds.str.contains("Text") | frame["Text"].notna()) & ~rings
    hatches = np.asarray(kinds.str.contains("Hatch"))
    texts &= ~hatches
    aside = texts | (hatches & rings.any())
    layers = frame[["Layer"]].set_geometry(shapes, crs=_said_beside(path))[~aside]
    drawn = [RawLayer(str(name), of_one) for name, of_one in layers.groupby("Layer", sort=False)]
    dataset = read_foreign(drawn, path, crs=crs)
    words = [
        counted(int(count), thing) + " left out"
        for count, thing in ((texts.sum(), "text"), ((aside & hatches).sum(), "hatch"))
        if count
    ]
    return replace(dataset, notes=(*words, *dataset.notes))


def _encoding(path: Path) -> dict[str, str]:
    """What GDAL is to be told of the letters: drawings since AutoCAD 2007 have UTF-8."""
    with path.open("rb") as file:
        version = re.search(rb"\$ACADVER\s+1\s+AC(\d+)", file.read(4096))
    return {"DXF_ENCODING": "UTF-8"} if version and int(version[1]) >= 1021 else {}


def _said_beside(path: Path) -> CRS | None:
    """The CRS that a ``.prj`` beside a drawing says."""
    beside = path.with_suffix(".prj")
    if not beside.is_file():
        return None
    try:
        said = CRS.from_wkt(beside.read_text(encoding="utf-8"))
    except (NoCRS, UnicodeDecodeError):
        return None
    return CRS(said.to_epsg(min_confidence=70) or said)
