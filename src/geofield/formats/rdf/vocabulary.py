"""The ontology's words: classes, properties and code lists, each said once.

The ontology, the SHACL shapes, the JSON-LD context and the documentation page are all made
from these tables (`geofield.formats.rdf.publish`), and the column mapping points into them.
A new column of the schema becomes a property by itself; an entry here gives it a better
name or comment.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

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
    see_also : tuple of str
        Terms of other vocabularies that mean something near.
    """

    name: str
    label: str
    comment: str
    parents: tuple[str, ...] = ("geo:Feature",)
    see_also: tuple[str, ...] = ()


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
    """A value of a code list."""

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
        "the narrow synonym 'tree' of the Plant Ontology's 'whole plant' (PO_0000003).",
        ("po:0000003",),
    ),
    Individual("gf:Other", "gf:ObstacleKind", "other", "An obstacle that is not a tree."),
    Individual(
        "gf:Detected", "gf:ReviewStatus", "detected", "Found by the detector, not reviewed."
    ),
    Individual("gf:Confirmed", "gf:ReviewStatus", "confirmed", "A person says it is there."),
    Individual(
        "gf:Rejected",
        "gf:ReviewStatus",
        "rejected",
        "A person says it is not there; tracks ignore it.",
    ),
    Individual("gf:Added", "gf:ReviewStatus", "added", "A person added it."),
)

_FEATURES = ("gf:Field", "gf:Obstacle", "gf:Track", "gf:Segment", "gf:Gap", "gf:TrackPoint")
_PLANNED = ("gf:Track", "gf:Segment", "gf:Gap", "gf:TrackPoint")
_PIXELS = "pixels of the picture, from the corner of its top-left pixel"

_TERMS: tuple[Term, ...] = (
    # the field
    Term("dcterms:identifier", "xsd:string", "Identifier", "The field's id.", ("gf:Field",)),
    Term(
        "gf:areaInHectares",
        "xsd:double",
        "Area",
        "Area without holes.",
        ("gf:Field",),
        "unit:HA",
        minimum=0.0,
    ),
    Term(
        "geo:hasMetricPerimeterLength",
        "xsd:double",
        "Perimeter",
        "Length of the outer ring, ground metres.",
        ("gf:Field",),
        "unit:M",
        minimum=0.0,
    ),
    Term(
        "gf:longestEdgeInMetres",
        "xsd:double",
        "Longest edge",
        "Length of the longest straight edge of the outline.",
        ("gf:Field",),
        "unit:M",
        minimum=0.0,
    ),
    Term(
        "gf:headingInDegrees",
        "xsd:double",
        "Heading",
        "Direction, clockwise from true north: of a field's longest edge, of a track.",
        ("gf:Field", "gf:Track"),
        "unit:DEG",
        minimum=-360.0,
        maximum=360.0,
    ),
    Term(
        "gf:outlineMethod",
        "xsd:string",
        "Outline method",
        "How the outline came to be.",
        ("gf:Field",),
    ),
    Term("gf:imageryName", "xsd:string", "Imagery", "Name of the picture.", ("gf:Field",)),
    Term(
        "gf:imageryDate",
        "xsd:date",
        "Imagery date",
        "When the picture was taken; a text where only the year or month is known.",
        ("gf:Field",),
    ),
    Term("dcterms:rights", "xsd:string", "Rights", "Licence in words.", ("gf:Field",)),
    # obstacles
    Term(
        "gf:obstacleNo",
        "xsd:integer",
        "Obstacle number",
        "Unique in its field.",
        ("gf:Obstacle",),
        minimum=0,
    ),
    Term("gf:kind", "gf:ObstacleKind", "Kind", "What the obstacle is.", ("gf:Obstacle",)),
    Term(
        "gf:status",
        "gf:ReviewStatus",
        "Status",
        "What the detector or a person says; a person's word survives every re-run.",
        ("gf:Obstacle",),
    ),
    Term(
        "gf:radiusInMetres",
        "xsd:double",
        "Radius",
        "Of the footprint, on the ground; none where the footprint is not round.",
        ("gf:Obstacle",),
        "unit:M",
        minimum=0.0,
    ),
    Term(
        "gf:bufferInMetres",
        "xsd:double",
        "Safety margin",
        "By which the footprint is grown to the buffer.",
        ("gf:Obstacle",),
        "unit:M",
        minimum=0.0,
    ),
    Term(
        "gf:confidence",
        "xsd:double",
        "Confidence",
        "Of the detector, 0 to 1.",
        ("gf:Obstacle",),
        "unit:UNITLESS",
        minimum=0.0,
        maximum=1.0,
    ),
    Term(
        "gf:pixelX",
        "xsd:double",
        "Pixel x",
        f"To the right, in {_PIXELS}.",
        ("gf:Obstacle", "gf:TrackPoint"),
        minimum=-1e9,
        maximum=1e9,
    ),
    Term(
        "gf:pixelY",
        "xsd:double",
        "Pixel y",
        f"Down, in {_PIXELS}.",
        ("gf:Obstacle", "gf:TrackPoint"),
        minimum=-1e9,
        maximum=1e9,
    ),
    Term(
        "gf:pixelRadius",
        "xsd:double",
        "Radius in pixels",
        "Of the circle in the picture.",
        ("gf:Obstacle",),
        minimum=0.0,
    ),
    Term(
        "wgs84:lat",
        "xsd:double",
        "Latitude",
        "WGS 84.",
        ("gf:Obstacle", "gf:TrackPoint"),
        "unit:DEG",
        minimum=-90.0,
        maximum=90.0,
    ),
    Term(
        "wgs84:long",
        "xsd:double",
        "Longitude",
        "WGS 84.",
        ("gf:Obstacle", "gf:TrackPoint"),
        "unit:DEG",
        minimum=-180.0,
        maximum=180.0,
    ),
    # tracks
    Term(
        "gf:trackNo",
        "xsd:integer",
        "Track number",
        "Unique in its plan, counted from the edge the planning starts at: the sequence of the "
        "tracks across the field.",
        ("gf:Track",),
        minimum=0,
    ),
    Term(
        "gf:segmentCount",
        "xsd:integer",
        "Segments",
        "Number of segments.",
        ("gf:Track",),
        minimum=0,
    ),
    Term("gf:gapCount", "xsd:integer", "Gaps", "Number of gaps.", ("gf:Track",), minimum=0),
    Term(
        "gf:pointCount",
        "xsd:integer",
        "Points",
        "Number of points.",
        ("gf:Track",),
        minimum=0,
    ),
    Term(
        "geo:hasMetricLength",
        "xsd:double",
        "Length",
        "Ground metres.",
        ("gf:Track", "gf:Segment", "gf:Gap"),
        "unit:M",
        minimum=0.0,
    ),
    Term(
        "gf:segmentNo",
        "xsd:integer",
        "Segment number",
        "Unique in its track, counted in the track's direction.",
        ("gf:Segment",),
        minimum=0,
    ),
    Term(
        "gf:gapNo",
        "xsd:integer",
        "Gap number",
        "Unique in its track, counted in the track's direction.",
        ("gf:Gap",),
        minimum=0,
    ),
    Term(
        "gf:cause",
        "xsd:string",
        "Cause",
        "All causes of a gap in words.",
        ("gf:Gap",),
    ),
    Term(
        "gf:causingObstacleNo",
        "xsd:integer",
        "Causing obstacle's number",
        "The lowest number of the obstacles that cause the gap; none for the border alone.",
        ("gf:Gap",),
        minimum=0,
    ),
    Term(
        "gf:pointNo",
        "xsd:integer",
        "Point number",
        "Unique in its plan, counted along the tracks.",
        ("gf:TrackPoint",),
        minimum=0,
    ),
    Term(
        "gf:easting",
        "xsd:double",
        "Easting",
        "In the dataset's metric CRS.",
        ("gf:TrackPoint",),
        "unit:M",
        minimum=-1e9,
        maximum=1e9,
    ),
    Term(
        "gf:northing",
        "xsd:double",
        "Northing",
        "In the dataset's metric CRS.",
        ("gf:TrackPoint",),
        "unit:M",
        minimum=-1e9,
        maximum=1e9,
    ),
    # links
    Term(
        "gf:inField",
        "gf:Field",
        "in field",
        "The field an obstacle, track or plan belongs to.",
        ("gf:Obstacle", "gf:Track", "gf:TrackPlan"),
        parents=("dcterms:isPartOf",),
    ),
    Term(
        "gf:inPlan",
        "gf:TrackPlan",
        "in plan",
        "The plan that a part belongs to.",
        ("gf:Track",),
        parents=("dcterms:isPartOf",),
    ),
    Term(
        "gf:onTrack",
        "gf:Track",
        "on track",
        "The track that a part belongs to.",
        ("gf:Segment", "gf:Gap", "gf:TrackPoint"),
        parents=("dcterms:isPartOf",),
    ),
    Term(
        "gf:onSegment",
        "gf:Segment",
        "on segment",
        "The segment that a point was sampled on.",
        ("gf:TrackPoint",),
        parents=("dcterms:isPartOf",),
    ),
    Term(
        "gf:causedBy",
        "gf:Obstacle",
        "caused by",
        "An obstacle that causes a gap.",
        ("gf:Gap",),
    ),
    Term(
        "gf:planner",
        "xsd:string",
        "Planner",
        "Name of the program that planned.",
        ("gf:TrackPlan",),
    ),
    # geometry
    Term(
        "geo:hasDefaultGeometry",
        "geo:Geometry",
        "has default geometry",
        "The geometry in CRS84: longitude before latitude, degrees.",
        _FEATURES,
        parents=("geo:hasGeometry",),
    ),
    Term(
        "geo:hasGeometry",
        "geo:Geometry",
        "has geometry",
        "All geometries: the default one, and the one in the metric CRS.",
        _FEATURES,
    ),
    Term(
        "geo:asWKT",
        "geo:wktLiteral",
        "as WKT",
        "Exactly one per geometry.",
        ("geo:Geometry",),
    ),
    Term(
        "geo:hasMetricSpatialAccuracy",
        "xsd:double",
        "Spatial accuracy",
        "Metres on the ground that one pixel of the picture covers.",
        ("geo:Geometry",),
        "unit:M",
        minimum=0.0,
    ),
    Term(
        "geo:hasMetricArea",
        "xsd:double",
        "Area",
        "Square metres on the ground.",
        ("gf:Field", "gf:Obstacle"),
        "unit:M2",
        minimum=0.0,
    ),
    Term(
        "geo:sfWithin",
        "geo:Feature",
        "within",
        "Lies within the field: computed, to 1 mm.",
        ("gf:Obstacle", "gf:Track"),
    ),
    # the dataset and its origin
    Term(
        "gf:metricCrs",
        "rdfs:Resource",
        "Metric CRS",
        "The CRS in which lengths and areas are measured: its OGC identifier.",
        ("dcat:Dataset",),
    ),
    Term(
        "gf:metricCrsWkt",
        "xsd:string",
        "Metric CRS in WKT",
        "Only where the CRS has no identifier.",
        ("dcat:Dataset",),
    ),
    Term(
        "gf:settings",
        "xsd:string",
        "Settings",
        "All settings of the run, as JSON.",
        ("prov:Activity",),
    ),
    Term(
        "gf:evidence",
        "xsd:string",
        "Evidence",
        "What the stages measured, as JSON.",
        ("prov:Activity",),
    ),
    Term(
        "gf:mayDerive",
        "xsd:boolean",
        "May derive",
        "Whether the terms of the picture allow deriving geodata.",
        ("prov:Entity",),
    ),
    Term(
        "gf:mayCache",
        "xsd:boolean",
        "May cache",
        "Whether the terms of the picture allow keeping it.",
        ("prov:Entity",),
    ),
    Term("gf:zoom", "xsd:integer", "Zoom", "Of tiled imagery.", ("prov:Entity",)),
    Term("gf:details", "xsd:string", "Details", "Further facts, as JSON.", ("prov:Entity",)),
    Term(
        "gf:widthInPixels",
        "xsd:integer",
        "Width",
        "Columns of the picture.",
        ("prov:Entity",),
        minimum=1,
    ),
    Term(
        "gf:heightInPixels",
        "xsd:integer",
        "Height",
        "Rows of the picture.",
        ("prov:Entity",),
        minimum=1,
    ),
    Term(
        "gf:geoTransform",
        "xsd:string",
        "Geotransform",
        "From pixel (x, y) to the picture's CRS: a b c d e f of x' = ax + by + c, "
        "y' = dx + ey + f.",
        ("prov:Entity",),
    ),
    Term(
        "gf:gridCrs",
        "xsd:string",
        "CRS of the picture",
        "EPSG code or WKT.",
        ("prov:Entity",),
    ),
    Term(
        "gf:fileName", "xsd:string", "File", "The picture's file beside the data.", ("prov:Entity",)
    ),
)


def camel(name: str) -> str:
    """``some_column_m`` as ``someColumnM``."""
    head, *tail = name.split("_")
    return head + "".join(part.capitalize() for part in tail)


#: Columns whose property is not simply their own name in camel case.
COLUMN_TERMS: dict[str, str] = {
    "field_id": "dcterms:identifier",
    "name": "rdfs:label",
    "area_ha": "gf:areaInHectares",
    "perimeter_m": "geo:hasMetricPerimeterLength",
    "longest_edge_m": "gf:longestEdgeInMetres",
    "heading_deg": "gf:headingInDegrees",
    "method": "gf:outlineMethod",
    "imagery": "gf:imageryName",
    "licence": "dcterms:rights",
    "radius_m": "gf:radiusInMetres",
    "buffer_m": "gf:bufferInMetres",
    "x_px": "gf:pixelX",
    "y_px": "gf:pixelY",
    "radius_px": "gf:pixelRadius",
    "lat": "wgs84:lat",
    "lon": "wgs84:long",
    "length_m": "geo:hasMetricLength",
}
_DATATYPES = {"int": "xsd:integer", "float": "xsd:double", "str": "xsd:string", "date": "xsd:date"}
_UNITS = {"m": "unit:M", "har": "unit:HA", "deg": "unit:DEG", "1": "unit:UNITLESS"}
_UNIT_WORDS = {"_m": "InMetres", "_deg": "InDegrees", "_ha": "InHectares", "_px": "InPixels"}


def column_term(column: schema.Column) -> str:
    """The prefixed name of a column's property."""
    if column.name in COLUMN_TERMS:
        return COLUMN_TERMS[column.name]
    for ending, word in _UNIT_WORDS.items():
        if column.name.endswith(ending):
            return f"gf:{camel(column.name.removesuffix(ending))}{word}"
    return f"gf:{camel(column.name)}"


def build_terms(derived: Iterable[tuple[schema.Column, str, str]] = ()) -> dict[str, Term]:
    """All properties by prefixed name.

    Parameters
    ----------
    derived : iterable of (column, property, class)
        Columns in use; those without an entry in the table get one from the schema.
    """
    result = {term.name: term for term in _TERMS}
    for column, name, domain in derived:
        if name.startswith("rdfs:"):
            continue
        known = result.get(name)
        if known is None:
            result[name] = Term(
                name,
                _DATATYPES[column.type],
                column.title,
                f"{column.title}.",
                (domain,),
                _UNITS.get(column.unit, ""),
            )
        elif domain not in known.domain:
            result[name] = _with_domain(known, domain)
    return result


def _with_domain(term: Term, domain: str) -> Term:
    return replace(term, domain=(*term.domain, domain))
