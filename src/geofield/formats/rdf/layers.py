"""Layers as linked data: which class a row is, how it is named, what its columns mean.

The one table to extend. A layer of the schema without an entry here still becomes RDF, by
the default rules of :func:`layer_map`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from geofield import schema
from geofield.formats.rdf.vocabulary import COLUMN_TERMS, Term, build_terms, camel, column_term


@dataclass(frozen=True, slots=True)
class Link:
    """A column that names a row of another layer, told by a link instead of a number.

    Attributes
    ----------
    column : str
        The column whose value the link carries.
    predicate : str
        Prefixed name.
    target : str
        The other layer; the link is made from its key columns.
    """

    column: str
    predicate: str
    target: str


@dataclass(frozen=True, slots=True)
class LayerMap:
    """How a layer becomes RDF.

    Attributes
    ----------
    layer : Layer
    cls : str
        Class, prefixed name.
    path : str
        The rows' IRIs below the field's (or the plan's), with key columns in braces.
    product : str
        The RDF/XML file that holds it: ``field``, ``obstacles`` or ``tracks``.
    in_plan : bool
        Whether it changes with the planner.
    label : str
        `rdfs:label` of the rows, with columns in braces; empty for none.
    links : tuple of Link
    terms : tuple of (str, str)
        Columns whose property differs from the one of that name elsewhere.
    metric_geometry : bool
        Whether rows have a second geometry in the metric CRS (points have coordinates).
    """

    layer: schema.Layer
    cls: str
    path: str
    product: str = "tracks"
    in_plan: bool = True
    label: str = ""
    links: tuple[Link, ...] = ()
    terms: tuple[tuple[str, str], ...] = ()
    metric_geometry: bool = True

    def properties(self) -> list[tuple[schema.Column, str]]:
        """The columns that are properties, with prefixed names, in the layer's order."""
        own = dict(self.terms)
        linked = {link.column for link in self.links}
        return [
            (column, own.get(column.name) or column_term(column))
            for column in self.layer.columns
            if column.name not in linked
        ]


_ON_TRACK = Link("track_no", "gf:onTrack", "tracks")

_MAPS: dict[str, dict[str, object]] = {
    "field": {"cls": "gf:Field", "path": "", "product": "field", "in_plan": False},
    "obstacles": {
        "cls": "gf:Obstacle",
        "path": "obstacle/{obstacle_no}",
        "product": "obstacles",
        "in_plan": False,
        "label": "Obstacle {obstacle_no}",
    },
    "tracks": {"cls": "gf:Track", "path": "track/{track_no}", "label": "Track {track_no}"},
    "segments": {
        "cls": "gf:Segment",
        "path": "track/{track_no}/segment/{segment_no}",
        "links": (_ON_TRACK,),
    },
    "gaps": {
        "cls": "gf:Gap",
        "path": "track/{track_no}/gap/{gap_no}",
        "links": (_ON_TRACK,),
        "terms": (("obstacle_no", "gf:causingObstacleNo"),),
    },
    "track_points": {
        "cls": "gf:TrackPoint",
        "path": "point/{point_no}",
        "links": (_ON_TRACK, Link("segment_no", "gf:onSegment", "segments")),
        "metric_geometry": False,
    },
}


@cache
def layer_map(name: str) -> LayerMap:
    """How a layer becomes RDF: its entry, or the default for its schema."""
    layer = schema.layer(name)
    entry = _MAPS.get(name)
    if entry is None:
        single = name.removesuffix("s")
        entry = {
            "cls": f"gf:{camel('_' + single)}",
            "path": "/".join([single.replace("_", "-"), *(f"{{{key}}}" for key in layer.key)]),
            "metric_geometry": layer.geometry != "Point",
        }
    return LayerMap(layer, **entry)  # type: ignore[arg-type]


def layer_maps() -> list[LayerMap]:
    """All layers, in the schema's order."""
    return [layer_map(layer.name) for layer in schema.LAYERS]


@cache
def all_terms() -> dict[str, Term]:
    """All properties in use, by prefixed name."""
    derived = [
        (column, name, each.cls) for each in layer_maps() for column, name in each.properties()
    ]
    return build_terms(derived)


def value_iri(value: str) -> str:
    """A value of a code list (`kind`, `status`) as a prefixed name."""
    return "gf:" + camel("_" + value)


__all__ = ["COLUMN_TERMS", "LayerMap", "Link", "all_terms", "layer_map", "layer_maps", "value_iri"]
