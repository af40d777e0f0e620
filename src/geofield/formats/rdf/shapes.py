"""Shapes: SHACL for every class, in Turtle, made from the vocabulary tables."""

from __future__ import annotations

from dataclasses import dataclass

from geofield.formats.rdf.layers import all_terms, layer_maps, value_iri
from geofield.formats.rdf.namespaces import GML, STUDY_TREE, SVG_CIRCLE, expand
from geofield.formats.rdf.ontology import MANY_VALUES, block, prefix_lines, quoted
from geofield.formats.rdf.study import STUDY_OBSTACLE_TERMS, STUDY_POINT_TERMS
from geofield.formats.rdf.vocabulary import CLASSES, INDIVIDUALS, Term

#: What a thing of a class cannot do without.
REQUIRED: dict[str, tuple[str, ...]] = {
    "gf:Field": ("dcterms:identifier",),
    "gf:Obstacle": ("gf:obstacleNo", "gf:kind", "gf:status"),
    "gf:Track": ("gf:trackNo",),
    "gf:Segment": ("gf:segmentNo", "gf:onTrack"),
    "gf:Gap": ("gf:gapNo", "gf:onTrack", "gf:cause"),
    "gf:TrackPoint": ("gf:pointNo", "gf:onTrack"),
    "gf:Headland": ("gf:headlandNo",),
    "gf:HeadlandTrack": ("gf:passNo",),
    "gf:RouteStep": ("gf:sequence", "gf:stepKind"),
    "gf:Turn": ("gf:turnNo",),
    "gf:TrackPlan": ("gf:inField",),
}
_WKT_KINDS = {
    "Point": "POINT",
    "LineString": "LINESTRING",
    "MultiLineString": "(MULTI)?LINESTRING",
    "Polygon": "POLYGON",
    "MultiPolygon": "(MULTI)?POLYGON",
}
#: A literal in CRS84; GeoSPARQL takes a literal without a CRS as that.
_CRS84 = r"^\\s*(<http://www\\.opengis\\.net/def/crs/OGC/1\\.3/CRS84>\\s*)?"
#: Bounds that every finite double keeps: only NaN and the infinities fall outside.
_FINITE = 1.7976931348623157e308


@dataclass(frozen=True, slots=True)
class Rule:
    """One property shape.

    Attributes
    ----------
    path : str
        Prefixed name or SHACL path in Turtle.
    message : str
        In plain words, for whoever sees it broken.
    constraints : tuple of (str, str)
        SHACL terms and their values in Turtle.
    """

    path: str
    message: str
    constraints: tuple[tuple[str, str], ...]


def shapes_turtle() -> str:
    """All shapes."""
    parts = [prefix_lines()]
    parts += [_shape(name, rules) for name, rules in class_rules().items()]
    return "\n".join(parts)


def class_rules() -> dict[str, list[Rule]]:
    """The rules of each class, by its prefixed name or IRI in angle brackets."""
    result: dict[str, list[Rule]] = {}
    code_lists = {individual.type for individual in INDIVIDUALS}
    for each in CLASSES:
        if each.name in code_lists:
            continue
        terms = [term for term in all_terms().values() if each.name in term.domain]
        result[each.name] = [term_rule(term, each.name, each.label) for term in terms]
    for layer in layer_maps():
        result[layer.cls] += _geometry_rules(layer.cls, layer.layer.geometry)
        for column, name in layer.properties():
            if column.values and all_terms()[name].range == "xsd:string":
                result[layer.cls].append(_values_rule(name, column.values))
    result["gf:Detection"] += _detection_rules()
    result["geo:Geometry"] = _literal_rules()
    result["dcat:Dataset"] = _dataset_rules()
    result["prov:Activity"] = [
        term_rule(all_terms()[name], "prov:Activity", "Run")
        for name in ("gf:settings", "gf:evidence")
    ]
    result[f"<{STUDY_TREE}tree>"] = _study_rules(STUDY_OBSTACLE_TERMS, "tree")
    result[f"<{GML}point>"] = _study_rules(STUDY_POINT_TERMS, "trajectory point")
    return result


def term_rule(term: Term, cls: str, label: str) -> Rule:
    """What a property's values must be on things of a class."""
    needed = term.name in REQUIRED.get(cls, ()) or term.name == "geo:hasDefaultGeometry"
    constraints: list[tuple[str, str]] = []
    if needed:
        constraints.append(("sh:minCount", "1"))
    if term.name not in MANY_VALUES:
        constraints.append(("sh:maxCount", "1"))
    many = term.name in MANY_VALUES
    count = ("at least one" if many else "exactly one") if needed else "any number" if many else ""
    words = [f"{term.label} ({term.name}) of {_article(label)}:", f"{count or 'one or none'},"]
    if term.is_object:
        constraints.append(("sh:nodeKind", "sh:IRI"))
        allowed = _code_list(term.range)
        if allowed:
            constraints.append(("sh:in", f"( {' '.join(allowed)} )"))
        words.append(f"one of {', '.join(allowed)}" if allowed else f"the IRI of a {term.range}")
    elif term.range == "xsd:date":
        constraints.append(("sh:or", "( [ sh:datatype xsd:date ] [ sh:datatype xsd:string ] )"))
        words.append("a date such as 2018-06-01")
    else:
        constraints.append(("sh:datatype", term.range))
        words.append(_DATATYPE_WORDS.get(term.range, f"a {term.range}"))
    constraints += _bounds(term)
    bounds = _bounds_words(term)
    message = " ".join(words) + (f", {bounds}" if bounds else "") + "."
    return Rule(term.name, message, tuple(constraints))


_DATATYPE_WORDS = {
    "xsd:double": "a finite number, typed xsd:double",
    "xsd:integer": "a whole number, typed xsd:integer",
    "xsd:string": "a text",
    "xsd:boolean": "true or false",
}


def _bounds(term: Term) -> list[tuple[str, str]]:
    if term.range not in ("xsd:double", "xsd:integer"):
        return []
    kind = "^^" + term.range
    low, high = term.minimum, term.maximum
    if term.range == "xsd:double":
        low = -_FINITE if low is None else low
        high = _FINITE if high is None else high
    result = []
    for name, bound in (("sh:minInclusive", low), ("sh:maxInclusive", high)):
        if bound is not None:
            text = repr(float(bound)) if term.range == "xsd:double" else str(int(bound))
            result.append((name, f'"{text}"{kind}'))
    return result


def _bounds_words(term: Term) -> str:
    if term.minimum is not None and term.maximum is not None:
        return f"from {term.minimum:g} to {term.maximum:g}"
    return "" if term.minimum is None else f"not below {term.minimum:g}"


def _code_list(name: str) -> list[str]:
    return [each.name for each in INDIVIDUALS if each.type == name]


def _values_rule(name: str, values: tuple[str, ...]) -> Rule:
    term = all_terms()[name]
    allowed = " ".join(quoted(value) for value in values)
    return Rule(
        name,
        f"{term.label} ({name}) is one of {', '.join(values)}.",
        (("sh:in", f"( {allowed} )"),),
    )


def _geometry_rules(cls: str, geometry: str) -> list[Rule]:
    kind = _WKT_KINDS[geometry]
    path = "( geo:hasDefaultGeometry geo:asWKT )"
    return [
        Rule(
            path,
            "The default geometry is in CRS84 (longitude before latitude); other CRS are further "
            "geometries.",
            (("sh:pattern", f'"{_CRS84}[A-Za-z]"'),),
        ),
        Rule(
            path,
            f"The geometry of a {cls} is a {geometry}.",
            (("sh:pattern", f'"^\\\\s*(<[^>]*>\\\\s*)?{kind}\\\\s*\\\\("'), ("sh:flags", '"i"')),
        ),
    ]


def _literal_rules() -> list[Rule]:
    crs = r"(OGC/1\\.3/CRS84|EPSG/0/[0-9]+)"
    return [
        Rule(
            "geo:asWKT",
            "A geometry has exactly one geo:asWKT, typed geo:wktLiteral.",
            (("sh:minCount", "1"), ("sh:maxCount", "1"), ("sh:datatype", "geo:wktLiteral")),
        ),
        Rule(
            "geo:asWKT",
            "The CRS of a WKT literal is CRS84 or an EPSG code, as an OGC IRI.",
            (
                (
                    "sh:pattern",
                    f'"^\\\\s*(<http://www\\\\.opengis\\\\.net/def/crs/{crs}>\\\\s*)?[A-Za-z]"',
                ),
            ),
        ),
        term_rule(all_terms()["geo:hasMetricSpatialAccuracy"], "geo:Geometry", "Geometry"),
    ]


def _detection_rules() -> list[Rule]:
    one_iri = (("sh:minCount", "1"), ("sh:maxCount", "1"), ("sh:nodeKind", "sh:IRI"))
    return [
        Rule("sosa:hasFeatureOfInterest", "A detection names one obstacle.", one_iri),
        Rule(
            "sosa:observedProperty",
            "A detection observes gf:obstaclePresence.",
            (("sh:minCount", "1"), ("sh:hasValue", "gf:obstaclePresence")),
        ),
        Rule(
            "sosa:hasSimpleResult",
            "The result of a detection is its confidence, a number from 0 to 1.",
            (
                ("sh:maxCount", "1"),
                ("sh:datatype", "xsd:double"),
                ("sh:minInclusive", '"0.0"^^xsd:double'),
                ("sh:maxInclusive", '"1.0"^^xsd:double'),
            ),
        ),
    ]


def _dataset_rules() -> list[Rule]:
    return [
        Rule(
            "dcterms:title",
            "A dataset needs one title (dcterms:title).",
            (("sh:minCount", "1"), ("sh:datatype", "xsd:string")),
        ),
        Rule(
            "gf:metricCrs",
            "The metric CRS is an OGC identifier of an EPSG code.",
            (
                ("sh:maxCount", "1"),
                ("sh:nodeKind", "sh:IRI"),
                ("sh:pattern", '"^http://www\\\\.opengis\\\\.net/def/crs/EPSG/0/[0-9]+$"'),
            ),
        ),
        Rule(
            "prov:wasGeneratedBy", "The run that made it is an IRI.", (("sh:nodeKind", "sh:IRI"),)
        ),
    ]


def _study_rules(study: dict[str, tuple[str, str]], label: str) -> list[Rule]:
    """The study's own properties; its pixels may be missing, numbers and positions not."""
    bounds = {"lat": 90, "lon": 180}
    names = {expand("xsd:int"): "xsd:int", expand("xsd:double"): "xsd:double"}
    rules = []
    for column, (predicate, datatype) in study.items():
        kind = names[datatype]
        constraints = [("sh:maxCount", "1"), ("sh:datatype", kind)]
        if not predicate.startswith(SVG_CIRCLE):
            constraints.append(("sh:minCount", "1"))
        if kind == "xsd:double":
            bound = float(bounds.get(column, 1e9))
            constraints.append(("sh:minInclusive", f'"{-bound!r}"^^xsd:double'))
            constraints.append(("sh:maxInclusive", f'"{bound!r}"^^xsd:double'))
        message = f"In the study's vocabulary a {label} has one <{predicate}>, typed {kind}."
        rules.append(Rule(f"<{predicate}>", message, tuple(constraints)))
    return rules


def _shape(cls: str, rules: list[Rule]) -> str:
    pairs = [("a", "sh:NodeShape"), ("sh:targetClass", cls), ("sh:nodeKind", "sh:IRI")]
    for rule in rules:
        inner = [("sh:path", rule.path), *rule.constraints, ("sh:message", quoted(rule.message))]
        lines = " ;\n        ".join(f"{p} {o}" for p, o in inner)
        pairs.append(("sh:property", f"[\n        {lines}\n    ]"))
    return block(_shape_name(cls), pairs)


def _shape_name(cls: str) -> str:
    if cls.startswith("<"):
        return "gf:StudyTreeShape" if STUDY_TREE in cls else "gf:StudyPointShape"
    return f"gf:{cls.partition(':')[2]}Shape"


def _article(label: str) -> str:
    return f"{'an' if label[0] in 'AEIOU' else 'a'} {label[0].lower()}{label[1:]}"


__all__ = ["REQUIRED", "Rule", "class_rules", "shapes_turtle", "value_iri"]
