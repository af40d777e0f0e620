"""A layer's style as QML: picture, labels, titles of columns, value lists, map tip, link."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from xml.etree import ElementTree as ET

import shapely

from geofield import schema
from geofield.formats.qgis.looks import LOOKS, field_rules
from geofield.formats.qgis.symbols import (
    QGIS_VERSION,
    document,
    option_map,
    rule_labels,
    rule_renderer,
)
from geofield.formats.xml import node
from geofield.model import Dataset
from geofield.model.frame import NEAR_PX, edge_strip
from geofield.schema import Column, Layer, unit_in_words

#: QGIS's numbers of what is drawn.
_GEOMETRY = {"Point": "0", "LineString": "1", "Polygon": "2"}
#: What a person's newly drawn row starts with.
_DEFAULTS = {("obstacles", "status"): "'added'", ("obstacles", "kind"): "'other'"}

#: What a person may change, by layer: all that the next run honours.
EDITABLE = {
    "field": ("field_id", "name"),
    "obstacles": ("kind", "status", "radius_m", "buffer_m"),
    # By their shapes; a piece may be drawn for a track.
    "tracks": (),
    "segments": ("track_no",),
}

#: In a file of many fields that is no farm's, tracks are planned anew from the rest alone.
_OF_TRACKS = ("tracks", "segments")

_LAT = "round(y(transform(point_on_surface($geometry), @layer_crs, 'EPSG:4326')), 7)"
_LON = "round(x(transform(point_on_surface($geometry), @layer_crs, 'EPSG:4326')), 7)"
_MAP = (
    "https://www.openstreetmap.org/?mlat=[% {lat} %]&mlon=[% {lon} %]"
    "#map=19/[% {lat} %]/[% {lon} %]"
)
#: Opens the spot in a web map: a check of position that needs no knowledge of projections.
WEB_MAP = _MAP.format(lat=_LAT, lon=_LON)


@dataclass(frozen=True, slots=True)
class _Said:
    """What the style of a layer takes from the dataset."""

    #: Whether its rows stand in a later run where a person edits them.
    stands: bool
    #: Along the picture's edge, WKT.
    strip: str
    tip: str


def _said(layer: Layer, dataset: Dataset) -> _Said:
    return _Said(
        layer.name not in _OF_TRACKS or dataset.tracks_stand,
        frame_strip(dataset) if layer.name == "field" else "",
        map_tip(layer, dataset),
    )


def style_of(layer: Layer, dataset: Dataset) -> Sequence[ET.Element | dict[str, str]]:
    """The attributes and elements that a QML file and a project's layer have in common."""
    return _style(layer, _said(layer, dataset))


#: Of a farm most layers of all fields have the same.
@lru_cache(maxsize=32)
def _style(layer: Layer, said: _Said) -> tuple[ET.Element | dict[str, str], ...]:
    look = LOOKS[layer.name]
    rules = field_rules(said.strip) if layer.name == "field" else look.rules
    aliases = (
        node("alias", index=str(index), field=column.name, name=heading(column))
        for index, column in enumerate(layer.columns, start=1)
    )
    first = {name: _DEFAULTS.get((layer.name, name), "") for name in layer.column_names}
    defaults = (
        node("default", field=name, expression=value, applyOnUpdate="0")
        for name, value in first.items()
    )
    open_ = EDITABLE.get(layer.name) if said.stands else None
    editable = (
        node("field", name=name, editable=str(int(name in (open_ or ()))))
        for name in layer.column_names
    )
    attributes = {
        "version": QGIS_VERSION,
        "hasScaleBasedVisibilityFlag": "1" if look.max_scale else "0",
        # QGIS calls the largest denominator minScale.
        "minScale": str(look.max_scale or 100_000_000),
        "maxScale": "0",
        "labelsEnabled": "1" if look.labels else "0",
        # The next planning makes the other layers anew: nothing typed there could stand.
        "readOnly": "1" if open_ is None else "0",
    }
    return (
        attributes,
        rule_renderer(rules, layer.name),
        *([rule_labels(look.labels, layer.name)] if look.labels else []),
        node("blendMode", "0"),
        node("layerOpacity", "1"),
        _field_configuration(layer),
        node("aliases", *aliases),
        node("defaults", *defaults),
        node("editable", *editable),
        _actions(),
        node("previewExpression", " || ' / ' || ".join(f'"{name}"' for name in layer.key)),
        node("mapTip", said.tip),
    )


def qml(layer: Layer, dataset: Dataset) -> str:
    """The style of a layer as a QML document."""
    return _qml(layer, _said(layer, dataset))


@lru_cache(maxsize=32)
def _qml(layer: Layer, said: _Said) -> str:
    root = node(
        "qgis",
        {"styleCategories": "AllStyleCategories"},
        *_style(layer, said),
        node("layerGeometryType", _GEOMETRY[layer.geometry.removeprefix("Multi")]),
    )
    return document(root)


def frame_strip(dataset: Dataset) -> str:
    """A narrow strip along the picture's edge, WKT; empty where the outline is not of it."""
    field, grid = dataset.table(schema.FIELD.name), dataset.grid
    if grid is None or not len(field) or field["method"].iloc[0] == "boundary":
        return ""
    near = NEAR_PX * grid.ground_resolution_m
    strip = edge_strip(grid, dataset.crs, dataset.provenance.shown_px, near)
    return str(shapely.to_wkt(strip, rounding_precision=3))


def heading(column: Column) -> str:
    """A column's title with its unit: ``Radius (m)``."""
    unit = unit_in_words(column)
    return f"{column.title} ({unit})" if unit and column.unit != "1" else column.title


def map_tip(layer: Layer, dataset: Dataset) -> str:
    """What is shown over a shape, with the link to a web map."""
    tip = LOOKS[layer.name].tip
    if layer.name == "field":
        # QGIS would take [% for the beginning of an expression.
        doubts = dataset.provenance.obstacle_doubts
        said = (html.escape(each).replace("%", "&#37;") for each in doubts)
        tip += "".join(f"<br><b>Obstacles:</b> {each}" for each in said)
    return f'{tip}<br><a href="{WEB_MAP}">Open this spot in a web map</a>'


def _field_configuration(layer: Layer) -> ET.Element:
    kinds = {"int": "Range", "float": "TextEdit", "str": "TextEdit", "date": "DateTime"}
    return node(
        "fieldConfiguration",
        _field("fid", "Hidden", node("Option")),
        *(
            _field(column.name, "ValueMap", _value_map(column.values))
            if column.values
            else _field(column.name, kinds[column.type], node("Option"))
            for column in layer.columns
        ),
    )


def _field(name: str, widget: str, options: ET.Element) -> ET.Element:
    config = node("config", options)
    return node(
        "field", node("editWidget", config, type=widget), name=name, configurationFlags="None"
    )


def _value_map(values: tuple[str, ...]) -> ET.Element:
    entries = (option_map({value.capitalize(): value}) for value in values)
    return node("Option", node("Option", *entries, type="List", name="map"), type="Map")


def _actions() -> ET.Element:
    action = node(
        "actionsetting",
        node("actionScope", id="Canvas"),
        node("actionScope", id="Feature"),
        id="{6b6f9f52-6f2e-4a63-9d0a-0d8f1c6a2b10}",
        type="5",  # open a URL
        name="Open this spot in a web map",
        shortTitle="Web map",
        action=WEB_MAP,
        icon="",
        notificationMessage="",
        capture="0",
        isEnabledOnlyWhenEditable="0",
    )
    return node("attributeactions", action)
