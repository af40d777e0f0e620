"""Layers as linked data: which class a row is, how it is named, what its columns mean.

The one table to extend. A layer of the schema without an entry here still becomes RDF, by
the default rules of :func:`layer_map`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

from geofield import schema
from geofield.formats.rdf.terms import TERMS
from geofield.formats.rdf.vocabulary import Term, camel, column_term, term_of_column


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
    key : str
        The key column that the number is, where it has another name there.
    """

    column: str
    predicate: str
    target: str
    key: str = ""

    @property
    def target_key(self) -> str:
        """The key column of the other layer that the number is."""
        return self.key or self.column


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
    says_plan : bool
        Whether rows link to their plan; parts of a track do so through the track.
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
    says_plan: bool = True

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
_ON_SEGMENT = Link("segment_no", "gf:onSegment", "segments")

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
        "says_plan": False,
    },
    "gaps": {
        "cls": "gf:Gap",
        "path": "track/{track_no}/gap/{gap_no}",
        "links": (_ON_TRACK,),
        "terms": (("obstacle_no", "gf:causingObstacleNo"),),
        "says_plan": False,
    },
    "track_points": {
        "cls": "gf:TrackPoint",
        "path": "point/{point_no}",
        "links": (_ON_TRACK, _ON_SEGMENT),
        "metric_geometry": False,
        "says_plan": False,
    },
    "headland": {"cls": "gf:Headland", "path": "headland/{headland_no}"},
    "headland_tracks": {
        "cls": "gf:HeadlandTrack",
        "path": "headland-track/{pass_no}/segment/{segment_no}",
    },
    "route": {
        "cls": "gf:RouteStep",
        "path": "route/{sequence}",
        "links": (_ON_TRACK, _ON_SEGMENT),
        "terms": (("kind", "gf:stepKind"), ("direction", "gf:drivingDirection")),
    },
    "turns": {
        "cls": "gf:Turn",
        "path": "turn/{turn_no}",
        "links": (
            Link("from_track", "gf:fromTrack", "tracks", "track_no"),
            Link("to_track", "gf:toTrack", "tracks", "track_no"),
        ),
        "terms": (
            ("kind", "gf:turnKind"),
            ("direction", "gf:turnDirection"),
            ("radius_m", "gf:turningRadiusInMetres"),
        ),
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
    """All properties in use, by prefixed name; each column has one, and its class as domain."""
    result = {term.name: term for term in TERMS}
    for each in layer_maps():
        for column, name in each.properties():
            known = result.get(name)
            if name.startswith("rdfs:"):
                continue
            if known is None:
                result[name] = term_of_column(column, name, each.cls)
            elif each.cls not in known.domain:
                result[name] = replace(known, domain=(*known.domain, each.cls))
    return result


def value_iri(value: str) -> str:
    """A value of a code list (`kind`, `status`) as a prefixed name."""
    return "gf:" + camel("_" + value)
