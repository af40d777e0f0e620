"""DXF drawings, of any program: what of them are areas, lines and points, and what is left out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
from pyproj import CRS
from pyproj.exceptions import CRSError as NoCRS

from geofield.errors import FormatWarning
from geofield.notes import warn
from geofield.wording import counted

if TYPE_CHECKING:
    import geopandas as gpd


def drawn(frame: gpd.GeoDataFrame, path: Path) -> gpd.GeoDataFrame:
    """What a drawing shows, and the layer of each: closed lines and circles are areas.

    Written words are left out, and hatches where lines are drawn around them, as they mostly are,
    which is told; of what is no part of the drawing (sheets of paper, points of dimensions)
    nothing is said.
    """
    frame = frame[frame["PaperSpace"].isna() & (frame["Layer"] != "Defpoints")]
    shapes = np.asarray(frame.geometry.to_numpy(), dtype=object)
    rings = shapely.is_ring(shapes) & (shapely.get_num_coordinates(shapes) > 3)
    shapes[rings] = [shapely.Polygon(line) for line in shapes[rings]]
    kinds = frame["SubClasses"].fillna("")
    texts = np.asarray(kinds.str.contains("Text") | frame["Text"].notna()) & ~rings
    hatches = np.asarray(kinds.str.contains("Hatch"))
    texts &= ~hatches
    aside = texts | (hatches & rings.any())
    for count, thing in ((texts.sum(), "text"), ((aside & hatches).sum(), "hatch")):
        if count:
            warn(f"{path.name}: {counted(int(count), thing)} left out.", FormatWarning)
    kept = frame[["Layer"]].set_geometry(shapes, crs=_said_beside(path))[~aside]
    return kept.reset_index(drop=True)


def encoding(path: Path) -> dict[str, str]:
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
