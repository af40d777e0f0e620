"""A layer's style as QML: picture, labels, titles of columns, value lists, map tip, link."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from geofield.formats.qgis.looks import LOOKS, Look, field_rules
from geofield.formats.qgis.symbols import QGIS_VERSION, rule_labels, rule_renderer
from geofield.schema import Column, Layer, unit_in_words

_GEOMETRY = {
    "Point": "0",
    "LineString": "1",
    "MultiLineString": "1",
    "Polygon": "2",
    "MultiPolygon": "2",
}
#: What a person's newly drawn row starts with.
_DEFAULTS = {("obstacles", "status"): "'added'", ("obstacles", "kind"): "'other'"}

#: What a person may change, by layer: all that the next run honours.
EDITABLE = {
    "field": ("field_id", "name"),
    "obstacles": ("kind", "status", "radius_m", "buffer_m"),
}

_LAT = "round(y(transform(point_on_surface($geometry), @layer_crs, 'EPSG:4326')), 7)"
_LON = "round(x(transform(point_on_surface($geometry), @layer_crs, 'EPSG:4326')), 7)"
_MAP = (
    "https://www.openstreetmap.org/?mlat=[% {lat} %]&mlon=[% {lon} %]"
    "#map=19/[% {lat} %]/[% {lon} %]"
)
#: Opens the spot in a web map: a check of position that needs no knowledge of projections.
WEB_MAP = _MAP.format(lat=_LAT, lon=_LON)


def look_of(layer: Layer) -> Look:
    """The look of a layer; a plain one for layers that nobody gave one."""
    return (
        LOOKS.get(layer.name)
        or LOOKS[
            {"Point": "track_points", "Polygon": "headland", "MultiPolygon": "headland"}.get(
                layer.geometry, "segments"
            )
        ]
    )


def style_elements(layer: Layer, frame: str = "") -> list[ET.Element]:
    """The elements that a QML file and a project's layer have in common.

    `frame` is the picture's, as :func:`geofield.formats.qgis.looks.field_rules` takes it.
    """
    look = look_of(layer)
    rules = field_rules(frame) if layer.name == "field" else look.rules
    elements = [rule_renderer(rules, layer.name)]
    if look.labels:
        elements.append(rule_labels(look.labels, layer.name))
    elements.append(_element("blendMode", "0"))
    elements.append(_element("layerOpacity", "1"))
    elements.append(_field_configuration(layer))
    aliases = ET.Element("aliases")
    for index, column in enumerate(layer.columns, start=1):
        ET.SubElement(aliases, "alias", index=str(index), field=column.name, name=heading(column))
    elements.append(aliases)
    defaults = ET.Element("defaults")
    for column in layer.columns:
        ET.SubElement(
            defaults,
            "default",
            field=column.name,
            expression=_DEFAULTS.get((layer.name, column.name), ""),
            applyOnUpdate="0",
        )
    elements.append(defaults)
    editable = ET.Element("editable")
    for column in layer.columns:
        is_editable = column.name in EDITABLE.get(layer.name, ())
        ET.SubElement(editable, "field", name=column.name, editable=str(int(is_editable)))
    elements.append(editable)
    elements.append(_actions())
    elements.append(_element("previewExpression", _preview(layer)))
    elements.append(_element("mapTip", map_tip(layer)))
    return elements


def style_attributes(layer: Layer) -> dict[str, str]:
    """The attributes that a QML file and a project's layer have in common."""
    look = look_of(layer)
    return {
        "version": QGIS_VERSION,
        "hasScaleBasedVisibilityFlag": "1" if look.max_scale else "0",
        # QGIS calls the largest denominator minScale.
        "minScale": str(look.max_scale or 100_000_000),
        "maxScale": "0",
        "labelsEnabled": "1" if look.labels else "0",
        # The next planning makes the other layers anew: nothing typed there could stand.
        "readOnly": "0" if layer.name in EDITABLE else "1",
    }


def qml(layer: Layer, frame: str = "") -> str:
    """The style of a layer as a QML document."""
    root = ET.Element("qgis", {"styleCategories": "AllStyleCategories"} | style_attributes(layer))
    root.extend(style_elements(layer, frame))
    root.append(_element("layerGeometryType", _GEOMETRY[layer.geometry]))
    return (
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
        f"{ET.tostring(root, encoding='unicode')}\n"
    )


def heading(column: Column) -> str:
    """A column's title with its unit: ``Radius (m)``."""
    unit = unit_in_words(column)
    return f"{column.title} ({unit})" if unit and column.unit != "1" else column.title


def map_tip(layer: Layer) -> str:
    """What is shown over a shape, with the link to a web map."""
    tip = look_of(layer).tip
    return f'{tip}<br><a href="{WEB_MAP}">Open this spot in a web map</a>'


def _element(name: str, text: str) -> ET.Element:
    element = ET.Element(name)
    element.text = text
    return element


def _preview(layer: Layer) -> str:
    return " || ' / ' || ".join(f'"{name}"' for name in layer.key)


def _field_configuration(layer: Layer) -> ET.Element:
    root = ET.Element("fieldConfiguration")
    fid = ET.SubElement(root, "field", name="fid", configurationFlags="None")
    _widget(fid, "Hidden", None)
    for column in layer.columns:
        field = ET.SubElement(root, "field", name=column.name, configurationFlags="None")
        if column.values:
            _widget(field, "ValueMap", _value_map(column.values))
        else:
            kind = {"int": "Range", "float": "TextEdit", "str": "TextEdit", "date": "DateTime"}
            _widget(field, kind[column.type], None)
    return root


def _widget(field: ET.Element, kind: str, options: ET.Element | None) -> None:
    widget = ET.SubElement(field, "editWidget", type=kind)
    config = ET.SubElement(widget, "config")
    config.append(ET.Element("Option") if options is None else options)


def _value_map(values: tuple[str, ...]) -> ET.Element:
    root = ET.Element("Option", type="Map")
    entries = ET.SubElement(root, "Option", type="List", name="map")
    for value in values:
        entry = ET.SubElement(entries, "Option", type="Map")
        ET.SubElement(entry, "Option", type="QString", name=value.capitalize(), value=value)
    return root


def _actions() -> ET.Element:
    root = ET.Element("attributeactions")
    action = ET.SubElement(
        root,
        "actionsetting",
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
    for scope in ("Canvas", "Feature"):
        ET.SubElement(action, "actionScope", id=scope)
    return root
