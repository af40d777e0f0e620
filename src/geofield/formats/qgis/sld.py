"""The same looks as SLD 1.0, for GeoServer and other readers of `layer_styles`.

Colours, dashes and the choice by status carry over; labels, arrows and scale-dependent
symbols of QGIS do not.
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

from geofield.formats.qgis.layer_style import look_of
from geofield.formats.qgis.looks import OBSTACLE_RULES
from geofield.formats.qgis.symbols import Rule, SymbolLayer
from geofield.schema import Layer

SLD = "http://www.opengis.net/sld"
OGC = "http://www.opengis.net/ogc"
#: OGC's standard pixel is 0.28 mm.
PIXEL_MM = 0.28


def sld(layer: Layer) -> str:
    """The style of a layer as an SLD document."""
    ET.register_namespace("sld", SLD)
    ET.register_namespace("ogc", OGC)
    root = ET.Element(f"{{{SLD}}}StyledLayerDescriptor", version="1.0.0")
    named = _sub(root, "NamedLayer")
    _sub(named, "Name", layer.name)
    user = _sub(named, "UserStyle")
    _sub(user, "Title", layer.title)
    style = _sub(user, "FeatureTypeStyle")
    for rule in look_of(layer).rules:
        _add_rule(style, rule)
    return ET.tostring(root, encoding="unicode", xml_declaration=True)


def _add_rule(style: ET.Element, rule: Rule) -> None:
    element = _sub(style, "Rule")
    _sub(element, "Name", rule.label)
    if rule.filter:
        _add_filter(element, rule.label)
    if rule.min_scale:
        _sub(element, "MinScaleDenominator", str(rule.min_scale))
    if rule.max_scale:
        _sub(element, "MaxScaleDenominator", str(rule.max_scale))
    for each in rule.layers:
        if each.kind == "SimpleLine":
            line = _sub(element, "LineSymbolizer")
            _stroke(line, each.values["line_color"], each.values["line_width"], each)
        elif each.kind == "SimpleFill":
            polygon = _sub(element, "PolygonSymbolizer")
            _fill(polygon, each.values["color"])
            if float(each.values["outline_width"]):
                _stroke(polygon, each.values["outline_color"], each.values["outline_width"])
        elif each.kind == "SimpleMarker":
            point = _sub(element, "PointSymbolizer")
            graphic = _sub(point, "Graphic")
            mark = _sub(graphic, "Mark")
            _sub(mark, "WellKnownName", "circle")
            _fill(mark, each.values["color"])
            _stroke(mark, each.values["outline_color"], each.values["outline_width"])
            _sub(graphic, "Size", f"{float(each.values['size']) / PIXEL_MM:.1f}")


#: The filters of the rules by their legend: what QGIS's expressions say.
_MISSING = {"Outline": "doubts", "Field": "doubts"}
_PRESENT = {
    "Outline to be checked": "doubts",
    "Field to be checked": "doubts",
    "Place without a plan": "error",
}
_CONDITIONS: dict[str, tuple[str, str]] = {
    **{label: ("status", status) for label, status in OBSTACLE_RULES.items()},
    "Turn": ("fits", "yes"),
    "Turn that does not fit": ("fits", "no"),
}


def _add_filter(element: ET.Element, label: str) -> None:
    root = ET.SubElement(element, f"{{{OGC}}}Filter")
    column = _PRESENT.get(label) or _MISSING.get(label)
    if column is not None:
        if label in _PRESENT:
            root = ET.SubElement(root, f"{{{OGC}}}Not")
        none = ET.SubElement(root, f"{{{OGC}}}PropertyIsNull")
        ET.SubElement(none, f"{{{OGC}}}PropertyName").text = column
        return
    name, value = _CONDITIONS[label]
    element = ET.SubElement(root, f"{{{OGC}}}PropertyIsEqualTo")
    ET.SubElement(element, f"{{{OGC}}}PropertyName").text = name
    ET.SubElement(element, f"{{{OGC}}}Literal").text = value


def _colour(rgba: str) -> tuple[str, str]:
    r, g, b, a = (int(part) for part in rgba.split(","))
    return f"#{r:02x}{g:02x}{b:02x}", f"{a / 255:.2f}"


def _fill(parent: ET.Element, rgba: str) -> None:
    colour, opacity = _colour(rgba)
    fill = _sub(parent, "Fill")
    _sub(fill, "CssParameter", colour, name="fill")
    _sub(fill, "CssParameter", opacity, name="fill-opacity")


def _stroke(parent: ET.Element, rgba: str, width_mm: str, layer: SymbolLayer | None = None) -> None:
    colour, opacity = _colour(rgba)
    stroke = _sub(parent, "Stroke")
    _sub(stroke, "CssParameter", colour, name="stroke")
    _sub(stroke, "CssParameter", opacity, name="stroke-opacity")
    _sub(stroke, "CssParameter", f"{float(width_mm) / PIXEL_MM:.1f}", name="stroke-width")
    if layer is not None and "customdash" in layer.values:
        dash = [float(part) / PIXEL_MM for part in layer.values["customdash"].split(";")]
        _sub(stroke, "CssParameter", " ".join(f"{d:.1f}" for d in dash), name="stroke-dasharray")


def _sub(parent: ET.Element, tag: str, text: str | None = None, **attributes: str) -> ET.Element:
    element = ET.SubElement(parent, f"{{{SLD}}}{tag}", attributes)
    element.text = text
    return element
