"""The study's plain XML: ``Obstacles/Tree/Item`` and ``Path/Track``.

For programs written against the study's listings. It carries circles and points only. The
study prints radii in pixels of one zoom and in metres of another; here ``Radius`` is ground
metres and says so.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from geofield import schema
from geofield.formats.xml import NOT_IN_XML
from geofield.model.dataset import Dataset
from geofield.model.obstacles import active

_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
#: Element names of the kinds of obstacles; the study knows trees only.
_ELEMENTS = {"tree": "Tree", "other": "Other"}


def write_study_xml(
    dataset: Dataset, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
) -> list[Path]:
    """Two files, ``obstacles.xml`` and ``path.xml``, of what is driven around and driven.

    A stem other than ``field`` stands before the names: ``north_path.xml``. It has no options.
    """
    before = "" if stem == "field" else f"{stem}_"
    products = {
        folder / f"{before}obstacles.xml": _obstacles(dataset),
        folder / f"{before}path.xml": _path(dataset),
    }
    for path, pieces in products.items():
        with path.open("w", encoding="utf-8", newline="\n") as file:
            file.writelines(pieces)
    return list(products)


def _obstacles(dataset: Dataset) -> Iterator[str]:
    yield _HEAD + "<Obstacles>\n"
    frame = active(dataset.table(schema.OBSTACLES.name))
    region = escape(NOT_IN_XML.sub("\ufffd", dataset.name), {"\r": "&#13;"})
    for kind, element in _ELEMENTS.items():
        rows = frame[frame["kind"] == kind].to_dict("records")
        if rows:
            items = "".join(_item(row, region) for row in rows)
            yield f"  <{element}>\n{items}  </{element}>\n"
    yield "</Obstacles>\n"


def _item(row: dict[Any, Any], region: str) -> str:
    x, y, radius, lat, lon = (
        repr(float(row[name])) if np.isfinite(row[name]) else ""
        for name in ("x_px", "y_px", "radius_m", "lat", "lon")
    )
    lines = [
        f"<Number>{row['obstacle_no']}</Number>",
        f"<Position>{region}</Position>",
        f"<PixelCoordinates><X>{x}</X><Y>{y}</Y></PixelCoordinates>" if x and y else "",
        f'<Radius unit="m">{radius}</Radius>' if radius else "",
        f"<Latitude>{lat}</Latitude>",
        f"<Longitude>{lon}</Longitude>",
        f"<GpsPositions>{lat},{lon}</GpsPositions>",
    ]
    inside = "".join(f"      {line}\n" for line in lines if line)
    return f"    <Item>\n{inside}    </Item>\n"


def _path(dataset: Dataset) -> Iterator[str]:
    yield _HEAD + "<Path>\n"
    closing, number = "", None
    for chunk in dataset.point_chunks():
        columns = (chunk[name].tolist() for name in ("track_no", "lat", "lon"))
        for track_no, lat, lon in zip(*columns, strict=True):
            if track_no != number:
                yield f"{closing}  <Track>\n    <Number>{track_no}</Number>\n"
                closing, number = "  </Track>\n", track_no
            yield f"    <gpsPoint>{lat!r},{lon!r}</gpsPoint>\n"
    yield closing + "</Path>\n"
