"""The same looks as SLD 1.0, for GeoServer and other readers of `layer_styles`.

Colours, dashes and the choice by status carry over; labels, arrows and scale-dependent
symbols of QGIS do not.
"""

from __future__ import annotations

import re
from functools import lru_cache
from xml.etree import ElementTree as ET

from geofield.formats.qgis.looks import LOOKS
from geofield.formats.qgis.symbols import Rule, SymbolLayer
from geofield.formats.xml import node
from geofield.schema import Layer

SLD = "http://www.opengis.net/sld"
OGC = "http://www.opengis.net/ogc"
#: OGC's standard pixel is 0.28 mm.
PIXEL_MM = 0.28
_TERM = re.compile(r"\"(\w+)\" (?:= '(\w+)'|IS (NOT )?NULL)")


@lru_cache(maxsize=32)
def sld(layer: Layer) -> str:
    """The style of a layer as an SLD document."""
    ET.register_namespace("sld", SLD)
    ET.register_namespace("ogc", OGC)
    style = _sld("FeatureTypeStyle", *map(_rule, LOOKS[layer.name].rules))
    user = _sld("UserStyle", _sld("Title", layer.title), style)
    named = _sld("NamedLayer", _sld("Name", layer.name), user)
    root = _sld("StyledLayerDescriptor", named, version="1.0.0")
    return ET.tostring(root, encoding="unicode", xml_declaration=True)


def _rule(rule: Rule) -> ET.Element:
    scales = {"MinScaleDenominator": rule.min_scale, "MaxScaleDenominator": rule.max_scale}
    return _sld(
        "Rule",
        _sld("Name", rule.label),
        *([_filter(rule.filter)] if rule.filter else []),
        *(_sld(tag, str(scale)) for tag, scale in scales.items() if scale),
        *(made for each in rule.layers if (made := _symbolizer(each)) is not None),
    )


def _symbolizer(of: SymbolLayer) -> ET.Element | None:
    values = of.values
    if of.kind == "SimpleLine":
        dash = values.get("customdash", "")
        stroke = _stroke(values["line_color"], values["line_width"], dash)
        return _sld("LineSymbolizer", stroke)
    if of.kind not in ("SimpleFill", "SimpleMarker"):
        return None
    parts = [_fill(values["color"])]
    if of.kind == "SimpleMarker" or float(values["outline_width"]):
        parts.append(_stroke(values["outline_color"], values["outline_width"]))
    if of.kind == "SimpleFill":
        return _sld("PolygonSymbolizer", *parts)
    mark = _sld("Mark", _sld("WellKnownName", "circle"), *parts)
    size = _sld("Size", f"{float(values['size']) / PIXEL_MM:.1f}")
    return _sld("PointSymbolizer", _sld("Graphic", mark, size))


def _filter(expression: str) -> ET.Element:
    """What the first term of a rule's QGIS expression says."""
    term = _TERM.match(expression)
    if term is None:
        raise ValueError(f"no filter of SLD: {expression}")
    column, value, present = term.groups()
    name = _ogc("PropertyName", column)
    if value is not None:
        return _ogc("Filter", _ogc("PropertyIsEqualTo", name, _ogc("Literal", value)))
    test = _ogc("PropertyIsNull", name)
    return _ogc("Filter", _ogc("Not", test) if present else test)


def _fill(rgba: str) -> ET.Element:
    return _css("Fill", **_colour("fill", rgba))


def _stroke(rgba: str, width_mm: str, dash_mm: str = "") -> ET.Element:
    values = _colour("stroke", rgba) | {"stroke-width": f"{float(width_mm) / PIXEL_MM:.1f}"}
    if dash_mm:
        dash = [float(part) / PIXEL_MM for part in dash_mm.split(";")]
        values["stroke-dasharray"] = " ".join(f"{d:.1f}" for d in dash)
    return _css("Stroke", **values)


def _colour(name: str, rgba: str) -> dict[str, str]:
    r, g, b, a = (int(part) for part in rgba.split(","))
    return {name: f"#{r:02x}{g:02x}{b:02x}", f"{name}-opacity": f"{a / 255:.2f}"}


def _css(tag: str, **values: str) -> ET.Element:
    return _sld(tag, *(_sld("CssParameter", text, name=name) for name, text in values.items()))


def _sld(tag: str, *inside: ET.Element | str, **attributes: str) -> ET.Element:
    return node(f"{{{SLD}}}{tag}", *inside, **attributes)


def _ogc(tag: str, *inside: ET.Element | str) -> ET.Element:
    return node(f"{{{OGC}}}{tag}", *inside)
