"""Ontology: geofield's words as OWL 2, in Turtle, made from the vocabulary tables."""

from __future__ import annotations

from collections.abc import Iterable

from geofield.formats.rdf.layers import all_terms
from geofield.formats.rdf.namespaces import GF, SCHEMA_PREFIXES
from geofield.formats.rdf.ntriples import escape_literal
from geofield.formats.rdf.vocabulary import CLASSES, INDIVIDUALS, Class, Individual, Term

#: Of the vocabulary, not of the software: changed when the meaning of a word changes.
VERSION = "1.0.0"
#: Properties of which a thing may have several.
MANY_VALUES = frozenset(
    {"geo:hasGeometry", "geo:sfWithin", "gf:causedBy", "gf:inField", "gf:inPlan", "rdfs:label"}
)


def ontology_turtle() -> str:
    """The whole ontology."""
    terms = [term for term in all_terms().values() if term.name.startswith("gf:")]
    parts = [prefix_lines(), _header(), _borrowed()]
    parts += [_class(each) for each in CLASSES]
    parts.append(_disjoint())
    parts += [_property(term) for term in terms]
    parts += [_individual(each) for each in INDIVIDUALS]
    return "\n".join(parts)


def prefix_lines() -> str:
    """The prefixes of the ontology, the shapes and the queries, in Turtle."""
    lines = (f"@prefix {prefix}: <{iri}> ." for prefix, iri in SCHEMA_PREFIXES.items())
    return "\n".join(lines) + "\n"


def block(subject: str, pairs: Iterable[tuple[str, str]]) -> str:
    """One Turtle block: a subject and its predicates."""
    return f"{subject}\n    " + " ;\n    ".join(f"{p} {o}" for p, o in pairs) + " .\n"


def quoted(text: str, language: str = "") -> str:
    """A Turtle literal."""
    return f'"{escape_literal(text)}"' + (f"@{language}" if language else "")


def _header() -> str:
    return block(
        f"<{GF.rstrip('#')}>",
        [
            ("a", "owl:Ontology"),
            ("dcterms:title", quoted("geofield ontology", "en")),
            (
                "dcterms:description",
                quoted(
                    "Fields, the obstacles in them and the tracks to drive: what a planner of farm "
                    "machines needs to exchange. Features and geometries are GeoSPARQL 1.1, "
                    "detections are SOSA observations, a field is a SAREF4AGRI parcel.",
                    "en",
                ),
            ),
            ("dcterms:license", "<https://creativecommons.org/licenses/by/4.0/>"),
            ("owl:versionIRI", f"<{GF.rstrip('#')}/{VERSION}>"),
            ("owl:versionInfo", quoted(VERSION)),
        ],
    )


def _borrowed() -> str:
    """Declare what comes from elsewhere, so that the file is OWL 2 DL without imports."""
    parents = {parent for each in CLASSES for parent in each.parents}
    ranges = {term.range for term in all_terms().values() if term.is_object}
    domains = {domain for term in all_terms().values() for domain in term.domain}
    classes = parents | ranges | domains | {each.type for each in INDIVIDUALS}
    foreign = sorted(c for c in classes if not c.startswith(("gf:", "rdfs:")))
    lines = [block(name, [("a", "owl:Class")]) for name in foreign]
    super_properties = {parent for term in all_terms().values() for parent in term.parents}
    lines += [block(name, [("a", "owl:ObjectProperty")]) for name in sorted(super_properties)]
    annotations = ("dcterms:title", "dcterms:description", "dcterms:license", "qudt:hasUnit")
    lines += [block(name, [("a", "owl:AnnotationProperty")]) for name in annotations]
    return "\n".join(lines)


def _class(each: Class) -> str:
    return block(
        each.name,
        [
            ("a", "owl:Class"),
            ("rdfs:subClassOf", ", ".join(each.parents)),
            *_words(each.label, each.comment),
        ],
    )


def _disjoint() -> str:
    """No thing is two of the features at once."""
    features = [each.name for each in CLASSES if "geo:Feature" in each.parents]
    members = " ".join(features)
    return f"[] a owl:AllDisjointClasses ;\n    owl:members ( {members} ) .\n"


def _property(term: Term) -> str:
    kinds = ["owl:ObjectProperty" if term.is_object else "owl:DatatypeProperty"]
    if term.name not in MANY_VALUES:
        kinds.append("owl:FunctionalProperty")
    pairs = [("a", ", ".join(kinds)), *_words(term.label, term.comment)]
    if term.parents:
        pairs.append(("rdfs:subPropertyOf", ", ".join(term.parents)))
    if term.domain:
        pairs.append(("rdfs:domain", _union(term.domain)))
    if term.range == "xsd:date":
        # A year or a month is all that is known of some pictures.
        pairs.append(("rdfs:range", "rdfs:Literal"))
    elif term.range != "rdfs:Resource":
        pairs.append(("rdfs:range", term.range))
    if term.unit:
        pairs.append(("qudt:hasUnit", term.unit))
    return block(term.name, pairs)


def _union(names: tuple[str, ...]) -> str:
    if len(names) == 1:
        return names[0]
    return f"[ a owl:Class ; owl:unionOf ( {' '.join(names)} ) ]"


def _individual(each: Individual) -> str:
    pairs = [("a", f"owl:NamedIndividual, {each.type}"), *_words(each.label, each.comment)]
    if each.see_also:
        pairs.append(("rdfs:seeAlso", ", ".join(each.see_also)))
    return block(each.name, pairs)


def _words(label: str, comment: str) -> list[tuple[str, str]]:
    return [
        ("rdfs:label", quoted(label, "en")),
        ("rdfs:comment", quoted(comment, "en")),
        ("rdfs:isDefinedBy", f"<{GF.rstrip('#')}>"),
    ]
