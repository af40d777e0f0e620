"""The study's plain XML: ``Obstacles/Tree/Item`` and ``Path/Track``.

For programs written against the study's listings. It carries circles and points only. The
study prints radii in pixels of one zoom and in metres of another; here ``Radius`` is ground
metres and says so.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from geofield import schema
from geofield.formats.rdf.triples import xml_text
from geofield.model.dataset import Dataset
from geofield.model.obstacles import active

if TYPE_CHECKING:
    import geopandas as gpd

_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
#: Element names of the kinds of obstacles; the study knows trees only.
_ELEMENTS = {"tree": "Tree", "other": "Other"}


def write_study_xml(
    dataset: Dataset, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
) -> list[Path]:
    """Two files, ``obstacles.xml`` and ``path.xml``; rejected obstacles are left out.

    Parameters
    ----------
    dataset : Dataset
    folder : Path
        There already.
    stem : str
        Other than ``field``, it stands before the names: ``north_path.xml``.
    options : mapping
        None are known.
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
    region = xml_text(dataset.name)
    for kind, element in _ELEMENTS.items():
        rows = frame[frame["kind"] == kind]
        if not len(rows):
            continue
        yield f"  <{element}>\n"
        yield from (_item(row, region) for row in rows.to_dict("records"))
        yield f"  </{element}>\n"
    yield "</Obstacles>\n"


def _item(row: dict[Any, Any], region: str) -> str:
    x, y, radius = _number(row["x_px"]), _number(row["y_px"]), _number(row["radius_m"])
    lines = [f"<Number>{row['obstacle_no']}</Number>", f"<Position>{region}</Position>"]
    if x and y:
        lines.append(f"<PixelCoordinates><X>{x}</X><Y>{y}</Y></PixelCoordinates>")
    if radius:
        lines.append(f'<Radius unit="m">{radius}</Radius>')
    lat, lon = _number(row["lat"]), _number(row["lon"])
    lines += [
        f"<Latitude>{lat}</Latitude>",
        f"<Longitude>{lon}</Longitude>",
        f"<GpsPositions>{lat},{lon}</GpsPositions>",
    ]
    inside = "".join(f"      {line}\n" for line in lines)
    return f"    <Item>\n{inside}    </Item>\n"


def _path(dataset: Dataset) -> Iterator[str]:
    yield _HEAD + "<Path>\n"
    number: int | None = None
    for track_no, lat, lon in _positions(dataset.point_chunks()):
        if track_no != number:
            yield ("  </Track>\n" if number is not None else "") + "  <Track>\n"
            yield f"    <Number>{track_no}</Number>\n"
            number = track_no
        yield f"    <gpsPoint>{lat!r},{lon!r}</gpsPoint>\n"
    yield ("  </Track>\n" if number is not None else "") + "</Path>\n"


def _positions(chunks: Iterable[gpd.GeoDataFrame]) -> Iterator[tuple[int, float, float]]:
    for chunk in chunks:
        yield from zip(
            chunk["track_no"].to_numpy(dtype=np.int64).tolist(),
            chunk["lat"].to_numpy(dtype="float64").tolist(),
            chunk["lon"].to_numpy(dtype="float64").tolist(),
            strict=True,
        )


def _number(value: float) -> str:
    return repr(float(value)) if np.isfinite(value) else ""
