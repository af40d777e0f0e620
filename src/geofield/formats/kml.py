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
from geofield.formats.arrow import cut_lonlat, exact_geometry
from geofield.formats.foreign import (
    KML_LOOKS,
    KML_SAID,
    RawLayer,
    layer_names,
    read_foreign,
    read_vector,
)
from geofield.formats.many import told_apart
from geofield.formats.origin import lineage
from geofield.formats.xml import node, write_xml
from geofield.model import Dataset
from geofield.schema import Layer

if TYPE_CHECKING:
    import geopandas as gpd

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
#: How the placemarks of a plan are called where nobody called them otherwise.
_OUR_NAMES = r"Obstacle \d+( \(\w+\))?|Track \d+|Gap \d+ of track \d+"


def write(
    datasets: Sequence[Dataset], folder: Path, *, stem: str, options: Mapping[str, Any]
) -> list[Path]:
    """Write ``{stem}.kml``; of several fields each has a folder, and its id in every row."""
    alone = len(datasets) == 1
    datasets = datasets if alone else told_apart(datasets)
    told = list(dict.fromkeys(map(lineage, datasets)))
    document = node(
        "Document",
        node("name", datasets[0].name if alone else stem),
        # Programs show a description as HTML.
        node("description", html.escape("\n".join(told), quote=False)),
        *(_style(name, *look) for name, look in _STYLES.items()),
        *(_schema(layer, datasets) for layer in LAYERS),
    )
    for dataset in datasets:
        folders = [_folder(layer, dataset) for layer in LAYERS if dataset.has(layer.name)]
        document.extend(
            folders if alone else [node("Folder", node("name", dataset.name), *folders)]
        )
    path = folder / f"{stem}.kml"
    write_xml(node("kml", document, xmlns=KML), path)
    return [path]


def read(path: Path) -> Dataset:
    """The dataset in a KML or KMZ file."""
    layers = [_raw(name, read_vector(path, name)) for name in layer_names(path)]
    return read_foreign(layers, path)


def _raw(name: str, frame: gpd.GeoDataFrame) -> RawLayer:
    """A layer with the columns of which GDAL has another name beside its own, as a person has them.

    A name of ours is no person's word; one that somebody gave a placemark is.
    """
    given = frame.pop("Name") if "Name" in frame else pd.Series(index=frame.index, dtype="string")
    other = {f"{each}2": each for each in (*KML_SAID[1:], *KML_LOOKS)} | {"name2": "name"}
    frame = frame.rename(columns={one: of for one, of in other.items() if of not in frame})
    if "track_no" in frame or "obstacle_no" in frame:
        given = given.mask(given.astype("string").str.fullmatch(_OUR_NAMES))
    if "name" in frame:
        given = given.fillna(frame["name"])
    return RawLayer(name, frame.assign(name=given) if given.notna().any() else frame)


def _schema(layer: Layer, datasets: Sequence[Dataset]) -> ET.Element:
    """Type and title of a layer's columns, the user's own behind the schema's."""
    found = {column.name: (_TYPES[column.type], column.title) for column in layer.columns}
    for each in datasets:
        table = each.table(layer.name)
        for name in schema.own_columns(layer, table):
            kind = _own_type(table[name])
            if found.setdefault(str(name), (kind, str(name)))[0] != kind:
                found[str(name)] = ("string", str(name))
    fields = (
        node("SimpleField", node("displayName", title), type=kind, name=name)
        for name, (kind, title) in found.items()
    )
    return node("Schema", {"name": layer.name, "id": f"schema_{layer.name}"}, *fields)


def _own_type(values: pd.Series[Any]) -> str:
    """The type of a user's column; KML's whole numbers have 32 bits, longer ones are text."""
    kind = schema.own_type(values)
    if kind == "int" and (values.abs() >= 2**31).any():
        return "string"
    return _TYPES[kind]


def _style(name: str, colour: str, width: float, fill: str | None) -> ET.Element:
    line = node("LineStyle", node("color", colour), node("width", f"{width:g}"))
    polygon = [] if fill is None else [node("PolyStyle", node("color", fill))]
    return node("Style", line, *polygon, id=f"style_{name}")


def _folder(layer: Layer, dataset: Dataset) -> ET.Element:
    table = dataset.table(layer.name)
    shapes = cut_lonlat(exact_geometry(layer, table), dataset.crs)
    folder = node("Folder", node("name", layer.name))
    for row, shape in zip(table.to_dict("records"), shapes, strict=True):
        data = node("SchemaData", schemaUrl=f"#schema_{layer.name}")
        for name in (*layer.column_names, *schema.own_columns(layer, table)):
            value = row[name]
            if not pd.isna(value):
                text = repr(float(value)) if isinstance(value, float) else str(value)
                data.append(node("SimpleData", text, name=str(name)))
        # Obstacles look as their status says.
        look = f"_{row['status']}" if layer.name == schema.OBSTACLES.name else ""
        placemark = node(
            "Placemark",
            node("name", row_name(layer, row)),
            node("styleUrl", f"#style_{layer.name}{look}"),
            node("ExtendedData", data),
            _geometry(shape),
        )
        folder.append(placemark)
    return folder


def row_name(layer: Layer, row: Mapping[str, Any]) -> str:
    """What a person calls a row: the field's name, ``Track 7``, ``Gap 2 of track 7``."""
    if layer.name == schema.FIELD.name:
        return str(row["name"])
    if layer.name == schema.GAPS.name:
        return f"Gap {row['gap_no']} of track {row['track_no']}"
    if layer.name == schema.OBSTACLES.name:
        status = row["status"]
        told = f" ({status})" if status in schema.NOT_AVOIDED else ""
        return f"Obstacle {row['obstacle_no']}{told}"
    return f"Track {row['track_no']}"


def _geometry(shape: Any) -> ET.Element:
    if shape.geom_type == "Polygon":
        rings = [("outerBoundaryIs", shape.exterior)]
        rings += [("innerBoundaryIs", ring) for ring in shape.interiors]
        linear = ((tag, node("LinearRing", _coordinates(ring))) for tag, ring in rings)
        return node("Polygon", *(node(tag, ring) for tag, ring in linear))
    if shape.geom_type == "LineString":
        return node("LineString", node("tessellate", "1"), _coordinates(shape))
    return node("MultiGeometry", *map(_geometry, shape.geoms))


def _coordinates(line: Any) -> ET.Element:
    places = (
        f"{lon:.{DECIMALS}f},{lat:.{DECIMALS}f},0" for lon, lat in shapely.get_coordinates(line)
    )
    return node("coordinates", " ".join(places))
