"""KML: a folder per layer, a placemark per row, typed columns in a schema."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import pandas as pd
import shapely

from geofield import schema, theme
from geofield.formats.arrow import exact_geometry, to_lonlat
from geofield.formats.foreign import RawLayer, layer_names, read_foreign, read_vector
from geofield.formats.origin import lineage
from geofield.formats.xml import write_xml
from geofield.model import Dataset

if TYPE_CHECKING:
    from geofield.schema import Layer

KML = "http://www.opengis.net/kml/2.2"
#: 1e-9 degrees are a tenth of a millimetre.
DECIMALS = 9
LAYERS = (schema.FIELD, schema.OBSTACLES, schema.TRACKS, schema.GAPS)

_TYPES = {"int": "int", "float": "double", "str": "string", "date": "string"}


def _abgr(color: str, alpha: str = "ff") -> str:
    """A colour ``#rrggbb`` as KML has it."""
    return f"{alpha}{color[5:7]}{color[3:5]}{color[1:3]}"


# Colour, width in pixels, filling. Obstacles that tracks run through are hollow.
_STYLES: dict[str, tuple[str, float, str | None]] = {
    "field": (_abgr(theme.OUTLINE), 3.0, "00000000"),
    "tracks": (_abgr(theme.TRACK), 1.5, None),
    "gaps": (_abgr(theme.GAP), 1.0, None),
    **{
        f"obstacles_{status}": (
            _abgr(look.color),
            1.5,
            "00000000" if status in schema.NOT_AVOIDED else _abgr(look.color, "60"),
        )
        for status, look in theme.STATUS.items()
    },
}
#: What GDAL makes of a placemark besides its own columns.
_DRIVER_COLUMNS = [
    *("id", "Name", "description", "timestamp", "begin", "end", "altitudeMode", "tessellate"),
    *("extrude", "visibility", "drawOrder", "icon", "snippet"),
]


def write(
    datasets: Sequence[Dataset], folder: Path, *, stem: str, options: Mapping[str, Any]
) -> list[Path]:
    """Write ``{stem}.kml``; of several fields each has a folder of its own."""
    root = ET.Element("kml", xmlns=KML)
    document = ET.SubElement(root, "Document")
    alone = len(datasets) == 1
    ET.SubElement(document, "name").text = datasets[0].name if alone else stem
    told = list(dict.fromkeys(map(lineage, datasets)))
    # Programs show a description as HTML.
    description = html.escape("\n".join(told), quote=False)
    ET.SubElement(document, "description").text = description
    for name, (colour, width, fill) in _STYLES.items():
        _add_style(document, name, colour, width, fill)
    for layer in LAYERS:
        columns = ET.SubElement(document, "Schema", name=layer.name, id=f"schema_{layer.name}")
        for name, (kind, title) in _columns(layer, datasets).items():
            field = ET.SubElement(columns, "SimpleField", type=kind, name=name)
            ET.SubElement(field, "displayName").text = title
    for dataset in datasets:
        place = document if alone else ET.SubElement(document, "Folder")
        if not alone:
            ET.SubElement(place, "name").text = dataset.name
        for layer in LAYERS:
            if dataset.has(layer.name):
                _add_layer(place, layer, dataset)
    path = folder / f"{stem}.kml"
    write_xml(root, path)
    return [path]


def read(path: Path) -> Dataset:
    """The dataset in a KML or KMZ file."""
    layers = []
    for name in layer_names(path):
        frame = read_vector(path, name)
        # The driver calls a column `name` that stands beside the placemark's own `name2`.
        named = "name2" if "name2" in frame.columns else "Name"
        if named in frame.columns:
            frame = frame.rename(columns={named: "name"})
        layers.append(RawLayer(name, frame.drop(columns=_DRIVER_COLUMNS, errors="ignore")))
    return read_foreign(layers, path)


def _columns(layer: Layer, datasets: Sequence[Dataset]) -> dict[str, tuple[str, str]]:
    """Type and title of a layer's columns, the user's own behind the schema's."""
    found = {column.name: (_TYPES[column.type], column.title) for column in layer.columns}
    for each in datasets:
        table = each.table(layer.name)
        for name in schema.own_columns(layer, table):
            kind = {"i": "int", "u": "int", "f": "double"}.get(table[name].dtype.kind, "string")
            if found.setdefault(str(name), (kind, str(name)))[0] != kind:
                found[str(name)] = ("string", str(name))
    return found


def _style_name(layer: Layer, row: Mapping[str, Any]) -> str:
    """Obstacles look as their status says."""
    if layer.name != schema.OBSTACLES.name:
        return layer.name
    status = _status(row)
    return f"obstacles_{status if status in theme.STATUS else 'added'}"


def _status(row: Mapping[str, Any]) -> str:
    return str(row.get("status")).strip().lower()


def _add_style(
    document: ET.Element, name: str, colour: str, width: float, fill: str | None
) -> None:
    style = ET.SubElement(document, "Style", id=f"style_{name}")
    line = ET.SubElement(style, "LineStyle")
    ET.SubElement(line, "color").text = colour
    ET.SubElement(line, "width").text = f"{width:g}"
    if fill is not None:
        polygon = ET.SubElement(style, "PolyStyle")
        ET.SubElement(polygon, "color").text = fill


def _add_layer(place: ET.Element, layer: Layer, dataset: Dataset) -> None:
    table = dataset.table(layer.name)
    shapes = to_lonlat(exact_geometry(layer, table), dataset.crs)
    folder = ET.SubElement(place, "Folder")
    ET.SubElement(folder, "name").text = layer.name
    for row, shape in zip(table.to_dict("records"), shapes, strict=True):
        placemark = ET.SubElement(folder, "Placemark")
        ET.SubElement(placemark, "name").text = row_name(layer, row)
        ET.SubElement(placemark, "styleUrl").text = f"#style_{_style_name(layer, row)}"
        data = ET.SubElement(
            ET.SubElement(placemark, "ExtendedData"),
            "SchemaData",
            schemaUrl=f"#schema_{layer.name}",
        )
        for name in (*layer.column_names, *schema.own_columns(layer, table)):
            value = row[name]
            if not pd.isna(value):
                text = repr(float(value)) if isinstance(value, float) else str(value)
                ET.SubElement(data, "SimpleData", name=str(name)).text = text
        _add_geometry(placemark, shape)


def row_name(layer: Layer, row: Mapping[str, Any]) -> str:
    """What a person calls a row: the field's name, ``Track 7``, ``Gap 2 of track 7``."""
    if layer.name == schema.FIELD.name:
        return str(row["name"])
    if layer.name == schema.GAPS.name:
        return f"Gap {row['gap_no']} of track {row['track_no']}"
    if layer.name == schema.OBSTACLES.name:
        number = row["obstacle_no"]
        name = "Obstacle" if pd.isna(number) else f"Obstacle {number}"
        return f"{name} ({_status(row)})" if _status(row) in schema.NOT_AVOIDED else name
    return f"Track {row['track_no']}"


def _add_geometry(parent: ET.Element, shape: Any) -> None:
    if shape.geom_type == "Polygon":
        polygon = ET.SubElement(parent, "Polygon")
        for tag, ring in (
            ("outerBoundaryIs", shape.exterior),
            *(("innerBoundaryIs", ring) for ring in shape.interiors),
        ):
            linear = ET.SubElement(ET.SubElement(polygon, tag), "LinearRing")
            ET.SubElement(linear, "coordinates").text = _coordinates(ring)
    elif shape.geom_type == "LineString":
        line = ET.SubElement(parent, "LineString")
        ET.SubElement(line, "tessellate").text = "1"
        ET.SubElement(line, "coordinates").text = _coordinates(shape)
    else:
        many = ET.SubElement(parent, "MultiGeometry")
        for part in shape.geoms:
            _add_geometry(many, part)


def _coordinates(line: Any) -> str:
    return " ".join(
        f"{lon:.{DECIMALS}f},{lat:.{DECIMALS}f},0" for lon, lat in shapely.get_coordinates(line)
    )
