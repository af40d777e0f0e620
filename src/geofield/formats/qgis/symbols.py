"""Building blocks of QGIS style files (QML, written for QGIS 3.22): symbols, rules, labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as ET

from geofield.formats.qgis.as_written import marked
from geofield.formats.xml import node

#: The version that the XML is written for; later ones read it.
QGIS_VERSION = "3.22.0-Białowieża"


def document(root: ET.Element) -> str:
    """A QML file or project as text."""
    return marked(
        "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
        f"{ET.tostring(root, encoding='unicode')}\n"
    )


def option_map(values: dict[str, str]) -> ET.Element:
    """The property list of a symbol layer."""
    options = (
        node("Option", type="QString", name=name, value=value) for name, value in values.items()
    )
    return node("Option", *options, type="Map")


@dataclass(frozen=True, slots=True)
class SymbolLayer:
    """One layer of a symbol: its class and properties, and the marker it repeats."""

    kind: str
    values: dict[str, str]
    marker: SymbolLayer | None = None


def symbol(kind: str, name: str, layers: Sequence[SymbolLayer]) -> ET.Element:
    """A symbol of type ``fill``, ``line`` or ``marker``."""
    root = node("symbol", type=kind, name=name, alpha="1", clip_to_extent="1", force_rhr="0")
    for position, each in enumerate(layers):
        attributes = {"class": each.kind, "enabled": "1", "locked": "0", "pass": "0"}
        layer = node("layer", attributes, option_map(each.values))
        if each.marker is not None:
            sub = "line" if each.kind == "GeometryGenerator" else "marker"
            layer.append(symbol(sub, f"@{name}@{position}", [each.marker]))
        root.append(layer)
    return root


def line(colour: str, width_mm: float, *, dash: str = "") -> SymbolLayer:
    """A line; `dash` is QGIS's ``"on;off"`` in millimetres."""
    values = {
        "line_color": colour,
        "line_width": f"{width_mm:g}",
        "line_width_unit": "MM",
        "line_style": "solid",
        "capstyle": "round",
        "joinstyle": "round",
    }
    if dash:
        values |= {"use_custom_dash": "1", "customdash": dash, "customdash_unit": "MM"}
    return SymbolLayer("SimpleLine", values)


def fill(colour: str, outline: str, width_mm: float, *, line: str = "solid") -> SymbolLayer:
    """A filled polygon with an outline."""
    return SymbolLayer(
        "SimpleFill",
        {
            "color": colour,
            "style": "solid",
            "outline_color": outline,
            "outline_width": f"{width_mm:g}",
            "outline_width_unit": "MM",
            "outline_style": line,
            "joinstyle": "round",
        },
    )


def marker(
    shape: str, colour: str, outline: str, size: float, *, unit: str = "MM", stroke: float = 0.2
) -> SymbolLayer:
    """A simple marker."""
    return SymbolLayer(
        "SimpleMarker",
        {
            "name": shape,
            "color": colour,
            "outline_color": outline,
            "outline_width": f"{stroke:g}",
            "outline_style": "solid" if stroke else "no",
            "size": f"{size:g}",
            "size_unit": unit,
        },
    )


def at_centre(shape: SymbolLayer) -> SymbolLayer:
    """A marker on a polygon, which stays visible when the polygon is too small to see."""
    return SymbolLayer("CentroidFill", {"point_on_surface": "1"}, shape)


def arrows(colour: str, *, every_m: float, size_m: float) -> SymbolLayer:
    """Arrow heads along a line, in ground metres so that they thin out on small scales."""
    return SymbolLayer(
        "MarkerLine",
        {
            "placement": "interval",
            "interval": f"{every_m:g}",
            "interval_unit": "MapUnit",
            "offset_along_line": f"{every_m / 4:g}",
            "offset_along_line_unit": "MapUnit",
            "rotate": "1",
        },
        marker("filled_arrowhead", colour, "0,0,0,160", size_m, unit="MapUnit", stroke=0.1),
    )


def generated(expression: str, shape: SymbolLayer) -> SymbolLayer:
    """A line where an expression says, in the shape's own units."""
    values = {"SymbolType": "Line", "geometryModifier": expression, "units": "MapUnit"}
    return SymbolLayer("GeometryGenerator", values, shape)


@dataclass(frozen=True, slots=True)
class Rule:
    """One rule of a layer's picture.

    Attributes
    ----------
    label : str
        In the legend.
    kind : str
        Of the symbol.
    layers : tuple of SymbolLayer
    filter : str
        A QGIS expression; empty for all rows.
    min_scale, max_scale : int
        Scale denominators between which it is drawn; 0 for no limit.
    """

    label: str
    kind: str
    layers: tuple[SymbolLayer, ...]
    filter: str = ""
    min_scale: int = 0
    max_scale: int = 0


def rule_renderer(rules: Sequence[Rule], prefix: str) -> ET.Element:
    """The renderer of a layer."""
    named = [
        node(
            "rule",
            {"key": f"{{{prefix}-{number}}}", "symbol": str(number), "label": rule.label},
            _limits(rule),
        )
        for number, rule in enumerate(rules)
    ]
    symbols = [symbol(rule.kind, str(number), rule.layers) for number, rule in enumerate(rules)]
    return node(
        "renderer-v2",
        node("rules", *named, key=f"{{{prefix}}}"),
        node("symbols", *symbols),
        type="RuleRenderer",
        symbollevels="0",
        enableorderby="0",
        forceraster="0",
    )


@dataclass(frozen=True, slots=True)
class Label:
    """A text on the map.

    Attributes
    ----------
    expression : str
        A QGIS expression.
    size_pt : float
    colour, halo : str
        ``r,g,b,a``.
    geometry : str
        A QGIS expression for the point where it stands; empty for the shape itself.
    filter, min_scale, max_scale
        As of :class:`Rule`.
    above : bool
        Whether it stands above the point rather than on it.
    priority : int
        Which text gives way where two have no room, 0 to 10: the lower one.
    """

    expression: str
    size_pt: float
    colour: str
    halo: str
    geometry: str = ""
    filter: str = ""
    min_scale: int = 0
    max_scale: int = 0
    above: bool = False
    priority: int = 5


def rule_labels(labels: Sequence[Label], prefix: str) -> ET.Element:
    """The labels of a layer."""
    rules = (
        node(
            "rule",
            {"key": f"{{{prefix}-label-{number}}}", "active": "1"},
            _limits(label),
            _label_settings(label),
        )
        for number, label in enumerate(labels)
    )
    tree = node("rules", *rules, key=f"{{{prefix}-labels}}")
    return node("labeling", tree, type="rule-based")


def _label_settings(label: Label) -> ET.Element:
    placement = {"placement": "1", "centroidWhole": "1", "priority": str(label.priority)}
    # QGIS counts the places around a point from the top left: 1 is above, 4 on it.
    placement |= {"quadOffset": "1" if label.above else "4", "yOffset": "0"}
    if label.above:
        placement |= {"yOffset": "-2.5", "offsetUnits": "MM"}
    if label.geometry:
        placement |= {
            "geometryGenerator": label.geometry,
            "geometryGeneratorEnabled": "1",
            "geometryGeneratorType": "PointGeometry",
            "layerType": "PointGeometry",
        }
    halo = node(
        "text-buffer",
        bufferDraw="1",
        bufferSize="0.7",
        bufferSizeUnits="MM",
        bufferColor=label.halo,
        bufferOpacity="1",
    )
    text = node(
        "text-style",
        halo,
        fieldName=label.expression,
        isExpression="1",
        fontFamily="Sans Serif",
        fontSize=f"{label.size_pt:g}",
        fontSizeUnit="Point",
        fontWeight="75",
        namedStyle="Bold",
        textColor=label.colour,
        textOpacity="1",
    )
    return node(
        "settings",
        text,
        node("placement", placement),
        node("rendering", drawLabels="1", obstacle="0", zIndex="0"),
        calloutType="simple",
    )


def _limits(of: Rule | Label) -> dict[str, str]:
    scales = {"scalemindenom": of.min_scale, "scalemaxdenom": of.max_scale}
    limits = {"filter": of.filter} if of.filter else {}
    return limits | {name: str(scale) for name, scale in scales.items() if scale}
