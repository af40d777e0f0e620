"""Layers as linked data: which class a row is, how it is named, what its columns mean.

The one table to extend. A layer or column of the schema without an entry here still becomes
RDF, by the default rules; tests then ask for its words in ``data/ontology.ttl``,
``data/shapes.ttl`` and ``data/context.jsonld``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from geofield import schema
from geofield.formats.rdf.namespaces import STUDY_PREFIXES, expand

#: Columns whose property is not simply their own name in camel case.
_COLUMN_TERMS = {
    "field_id": "dcterms:identifier", "name": "rdfs:label", "method": "gf:outlineMethod",
    "perimeter_m": "geo:hasMetricPerimeterLength", "length_m": "geo:hasMetricLength",
    "imagery": "gf:imageryName", "licence": "dc:rights", "x_px": "gf:pixelX", "y_px": "gf:pixelY",
    "radius_px": "gf:pixelRadius", "lat": "wgs84:lat", "lon": "wgs84:long",
}  # fmt: skip
#: Endings of column names and the words that tell the unit in a property's name.
_UNIT_WORDS = {"_m": "InMetres", "_deg": "InDegrees", "_ha": "InHectares", "_px": "InPixels"}
#: Columns whose values are things of a code list.
CODE_LISTS = {"gf:kind": "gf:ObstacleKind", "gf:status": "gf:ReviewStatus"}
#: The values of columns that are truth values.
YES_NO = ("yes", "no")
#: Obstacles that are not driven around have a class of their own.
CANDIDATE = "gf:Candidate"


@dataclass(frozen=True, slots=True)
class Link:
    """A column with the number of another layer's row (the last of its key), told as a link."""

    column: str
    predicate: str
    target: str


@dataclass(frozen=True, slots=True)
class LayerMap:
    """How a layer becomes RDF. Names of classes and properties are prefixed."""

    layer: schema.Layer
    cls: str
    #: The rows' IRIs below the plan's (or the survey's), with key columns in braces.
    path: str
    #: The RDF/XML file that holds it.
    product: str = "tracks"
    #: Whether it belongs to a plan of tracks; to the survey otherwise.
    in_plan: bool = True
    #: `rdfs:label` of the rows, with columns in braces.
    label: str = ""
    links: tuple[Link, ...] = ()
    #: Properties of columns that mean something else than elsewhere.
    terms: dict[str, str] | None = None
    #: What rows are of: properties and the dataset's names (`Names`) they point to. Parts of a
    #: track are of a plan through the track.
    belongs: tuple[tuple[str, str], ...] = (("gf:inPlan", "plan"),)
    #: Classes of other vocabularies that rows have as well.
    also: tuple[str, ...] = ()
    #: The source study's class, and its properties of columns.
    study_cls: str = ""
    study: Mapping[str, str] = field(default_factory=dict)

    @property
    def known_as(self) -> list[str]:
        """The classes by which rows are known, whoever wrote them."""
        return [*classes(self), *filter(None, [self.study_cls])]

    def names(self, column: str) -> list[str]:
        """The properties that tell a column that is not a link, whoever wrote them."""
        own = [name for each, name in self.properties() if each.name == column]
        return [*own, *filter(None, [self.study.get(column)])]

    def properties(self) -> list[tuple[schema.Column, str]]:
        """The columns that are properties, with prefixed names, in the layer's order."""
        linked = {link.column for link in self.links}
        return [
            (column, (self.terms or {}).get(column.name) or column_term(column))
            for column in self.layer.columns
            if column.name not in linked
        ]


_IN_FIELD, _OF_PICTURE = ("gf:inField", "field"), ("prov:wasDerivedFrom", "imagery")
_ON_TRACK = Link("track_no", "gf:onTrack", "tracks")
_ON_SEGMENT = Link("segment_no", "gf:onSegment", "segments")
_IN_PICTURE = {"x_px": "svg:cx", "y_px": "svg:cy"}

#: By layer what differs from the default.
_MAPS: dict[str, dict[str, Any]] = {
    "field": {
        "cls": "gf:Survey", "path": "", "product": "field", "in_plan": False,
        "belongs": (_IN_FIELD, _OF_PICTURE, ("prov:wasGeneratedBy", "run")),
        "also": ("prov:Entity",),
    },
    "obstacles": {
        "product": "obstacles", "in_plan": False, "label": "Obstacle {obstacle_no}",
        "belongs": (_IN_FIELD, ("gf:inSurvey", "survey"), _OF_PICTURE),
        "also": ("sosa:FeatureOfInterest",),
        "study_cls": STUDY_PREFIXES["po"] + "tree",
        "study": {
            "obstacle_no": "obstacle:no", "lat": "wgs84:lat", "lon": "wgs84:long",
            **_IN_PICTURE, "radius_px": "svg:r",
        },
    },
    "tracks": {
        "label": "Track {track_no}",
        "belongs": (_IN_FIELD, ("prov:wasDerivedFrom", "survey"), ("gf:inPlan", "plan")),
    },
    "segments": {"links": (_ON_TRACK,), "belongs": ()},
    "gaps": {
        "links": (_ON_TRACK,), "belongs": (), "terms": {"obstacle_no": "gf:causingObstacleNo"},
    },
    "track_points": {
        "links": (_ON_TRACK, _ON_SEGMENT), "belongs": (), "study_cls": "gml:point",
        "study": {
            "point_no": "trajectory:no", "track_no": "trajectory:track",
            "lat": "gml:lat", "lon": "gml:long", **_IN_PICTURE,
        },
    },
    "headland_tracks": {"path": "headland-track/{pass_no}/segment/{segment_no}"},
    "route": {
        "cls": "gf:RouteStep", "path": "route/{sequence}", "links": (_ON_TRACK, _ON_SEGMENT),
        "terms": {"kind": "gf:stepKind", "direction": "gf:drivingDirection"},
    },
    "turns": {
        "links": (
            Link("from_track", "gf:fromTrack", "tracks"),
            Link("to_track", "gf:toTrack", "tracks"),
        ),
        "terms": {
            "kind": "gf:turnKind", "direction": "gf:turnDirection",
            "radius_m": "gf:turningRadiusInMetres",
        },
    },
}  # fmt: skip


@cache
def layer_map(name: str) -> LayerMap:
    """How a layer becomes RDF: a class of its own name, its key numbers in the rows' names."""
    layer = schema.layer(name)
    path = "/".join(f"{key.removesuffix('_no')}/{{{key}}}" for key in layer.key)
    return LayerMap(
        layer, **{"cls": value_iri(name.removesuffix("s")), "path": path, **_MAPS.get(name, {})}
    )


def layer_maps() -> list[LayerMap]:
    """All layers, in the schema's order."""
    return [layer_map(layer.name) for layer in schema.LAYERS if not layer.working]


def column_term(column: schema.Column) -> str:
    """The prefixed name of a column's property."""
    name, words = column.name, ""
    for ending, unit in _UNIT_WORDS.items():
        if name.endswith(ending):
            name, words = name.removesuffix(ending), unit
    return _COLUMN_TERMS.get(column.name) or f"gf:{_camel(name)}{words}"


def classes(layer: LayerMap) -> list[str]:
    """The full IRIs of the classes that a layer's rows have."""
    further = {"field": ["gf:Field"], "obstacles": [CANDIDATE]}
    return [expand(name) for name in (layer.cls, *further.get(layer.layer.name, ()))]


def value_iri(value: str) -> str:
    """A value of a code list (`kind`, `status`) as a prefixed name."""
    return "gf:" + _camel("_" + value)


def _camel(name: str) -> str:
    head, *tail = name.split("_")
    return head + "".join(part.capitalize() for part in tail)
