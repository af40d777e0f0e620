"""The ontology's words: what a class, a property and a code list value are; the classes.

The ontology, the SHACL shapes, the JSON-LD context and the documentation page are made from
these tables and those of `terms`, and the column mapping points into them.
"""

from __future__ import annotations

from dataclasses import dataclass

from geofield import schema
from geofield.formats.rdf.namespaces import expand


@dataclass(frozen=True, slots=True)
class Class:
    """A class of the ontology.

    Attributes
    ----------
    name : str
        Prefixed name.
    label, comment : str
    parents : tuple of str
        Super-classes, prefixed names.
    """

    name: str
    label: str
    comment: str
    parents: tuple[str, ...] = ("geo:Feature",)


@dataclass(frozen=True, slots=True)
class Term:
    """A property of the ontology, or one of another vocabulary that geofield uses.

    Attributes
    ----------
    name : str
        Prefixed name.
    range : str
        Prefixed name of a datatype (``xsd:...``, ``geo:wktLiteral``) or class.
    label, comment : str
    domain : tuple of str
        Classes it is used on.
    unit : str
        QUDT unit, prefixed name; empty for none.
    parents : tuple of str
        Super-properties.
    minimum, maximum : float or None
        Bounds of its values.
    """

    name: str
    range: str
    label: str
    comment: str
    domain: tuple[str, ...] = ()
    unit: str = ""
    parents: tuple[str, ...] = ()
    minimum: float | None = None
    maximum: float | None = None

    @property
    def iri(self) -> str:
        """The full IRI."""
        return expand(self.name)

    @property
    def is_object(self) -> bool:
        """Whether its values are things, not literals."""
        return not self.range.startswith("xsd:") and self.range != "geo:wktLiteral"


@dataclass(frozen=True, slots=True)
class Individual:
    """A value of a code list.

    Attributes
    ----------
    name : str
        Prefixed name.
    type : str
        The code list's class.
    label, comment : str
    see_also : tuple of str
        Terms of other vocabularies that mean something near.
    """

    name: str
    type: str
    label: str
    comment: str
    see_also: tuple[str, ...] = ()


CLASSES: tuple[Class, ...] = (
    Class(
        "gf:Field",
        "Field",
        "A farm field: the area that one outline encloses, without its holes.",
        ("geo:Feature", "s4agri:Parcel"),
    ),
    Class(
        "gf:Obstacle",
        "Obstacle",
        "Something in a field that no vehicle may enter. Its default geometry is its buffer: "
        "the footprint grown by the safety margin.",
        ("geo:Feature", "sosa:FeatureOfInterest"),
    ),
    Class(
        "gf:Track",
        "Track",
        "A straight driving line across a field, numbered from the edge the planning starts "
        "at. Its geometry holds its drivable segments.",
    ),
    Class("gf:Segment", "Segment", "A maximal drivable piece of a track."),
    Class(
        "gf:Gap",
        "Gap",
        "The piece between two segments of a track, with what causes it: obstacles, or the "
        "field's own border.",
    ),
    Class("gf:TrackPoint", "Track point", "A point to drive over, sampled along a segment."),
    Class(
        "gf:Headland",
        "Headland",
        "The strip along the border that is kept free for turning, and worked last.",
    ),
    Class(
        "gf:HeadlandTrack",
        "Headland track",
        "A track around the field, parallel to its border.",
    ),
    Class(
        "gf:RouteStep",
        "Step of the route",
        "A piece of the whole drive: work on a segment, or the way to the next one.",
    ),
    Class("gf:Turn", "Turn", "The way from one segment to the next."),
    Class(
        "gf:TrackPlan",
        "Track plan",
        "The tracks of one field that one planner made in one run. A field may have several "
        "plans; its obstacles are the same in all of them.",
        ("prov:Entity",),
    ),
    Class(
        "gf:Detection",
        "Detection",
        "The observation by which an obstacle was found in a picture; its simple result is "
        "the detector's confidence.",
        ("sosa:Observation",),
    ),
    Class("gf:ObstacleKind", "Kind of obstacle", "What an obstacle is.", ("skos:Concept",)),
    Class(
        "gf:ReviewStatus",
        "Review status",
        "What the detector or a person says of an obstacle.",
        ("skos:Concept",),
    ),
)

INDIVIDUALS: tuple[Individual, ...] = (
    Individual(
        "gf:Tree",
        "gf:ObstacleKind",
        "tree",
        "A tree, or a round thing that looks like one from above. The source study marks it by "
        "the narrow synonym 'tree' of a term of the Plant Ontology, PO_0000003.",
        ("po:0000003",),
    ),
    Individual("gf:Other", "gf:ObstacleKind", "other", "An obstacle that is not a tree."),
    Individual("gf:Detected", "gf:ReviewStatus", "detected", "Found by the detector, unreviewed."),
    Individual(
        "gf:Possible",
        "gf:ReviewStatus",
        "possible",
        "Found by the detector, too uncertain to be driven around; tracks ignore it.",
    ),
    Individual("gf:Confirmed", "gf:ReviewStatus", "confirmed", "A person says it is there."),
    Individual(
        "gf:Rejected",
        "gf:ReviewStatus",
        "rejected",
        "A person says it is not there; tracks ignore it.",
    ),
    Individual("gf:Added", "gf:ReviewStatus", "added", "A person added it."),
    Individual(
        "gf:obstaclePresence",
        "sosa:ObservableProperty",
        "presence of an obstacle",
        "What a detection observes: whether there is an obstacle. Its result is the confidence.",
    ),
)

#: Columns whose property is not simply their own name in camel case.
_COLUMN_TERMS: dict[str, str] = {
    "field_id": "dcterms:identifier",
    "name": "rdfs:label",
    "perimeter_m": "geo:hasMetricPerimeterLength",
    "method": "gf:outlineMethod",
    "imagery": "gf:imageryName",
    "licence": "dc:rights",
    "x_px": "gf:pixelX",
    "y_px": "gf:pixelY",
    "radius_px": "gf:pixelRadius",
    "lat": "wgs84:lat",
    "lon": "wgs84:long",
    "length_m": "geo:hasMetricLength",
}
#: Endings of column names and the words that tell the unit in a property's name.
_UNIT_WORDS = {"_m": "InMetres", "_deg": "InDegrees", "_ha": "InHectares", "_px": "InPixels"}
_DATATYPES = {"int": "xsd:integer", "float": "xsd:double", "str": "xsd:string", "date": "xsd:date"}
_UNITS = {"m": "unit:M", "har": "unit:HA", "deg": "unit:DEG", "1": "unit:UNITLESS"}


def camel(name: str) -> str:
    """``some_column`` as ``someColumn``."""
    head, *tail = name.split("_")
    return head + "".join(part.capitalize() for part in tail)


def column_term(column: schema.Column) -> str:
    """The prefixed name of a column's property."""
    if column.name in _COLUMN_TERMS:
        return _COLUMN_TERMS[column.name]
    for ending, word in _UNIT_WORDS.items():
        if column.name.endswith(ending):
            return f"gf:{camel(column.name.removesuffix(ending))}{word}"
    return f"gf:{camel(column.name)}"


def term_of_column(column: schema.Column, name: str, domain: str) -> Term:
    """An entry for a column that the table of terms does not know."""
    return Term(
        name,
        _DATATYPES[column.type],
        column.title,
        f"{column.title}.",
        (domain,),
        _UNITS.get(column.unit, ""),
    )
