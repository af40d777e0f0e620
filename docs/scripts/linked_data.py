"""The reference pages of linked data: from the ontology, the shapes and the queries themselves."""

from __future__ import annotations

import rdflib
from rdflib.namespace import OWL, RDFS, SH

from geofield.formats.rdf.graph import ontology
from geofield.formats.rdf.layers import layer_maps
from geofield.formats.rdf.namespaces import (
    DEFAULT_BASE,
    GF,
    ONTOLOGY,
    SCHEMA_PREFIXES,
    SHAPES,
    compact,
    resource,
)
from geofield.formats.rdf.query import queries

_WORDS = rdflib.Graph().parse(data=resource(ONTOLOGY), format="turtle")
_SHAPES = rdflib.Graph().parse(data=resource(SHAPES), format="turtle")


def classes() -> list[str]:
    """The classes of geofield's own, in the order of the ontology."""
    return [iri for iri in ontology().of_type("owl:Class") if iri.startswith(GF)]


def individuals(cls: str) -> list[str]:
    """The values of a code list."""
    return ontology().of_type(cls)


def properties(cls: str) -> list[rdflib.term.Node]:
    """The property shapes of a class with one predicate as their path."""
    found = [
        prop
        for shape in _SHAPES.subjects(SH.targetClass, rdflib.URIRef(cls))
        for prop in _SHAPES.objects(shape, SH.property)
        if isinstance(_SHAPES.value(prop, SH.path), rdflib.URIRef)
    ]
    # A list of values is a second shape of the same property.
    first = {_SHAPES.value(prop, SH.path): prop for prop in reversed(found)}
    return [prop for prop in found if first[_SHAPES.value(prop, SH.path)] is prop]


def comment(iri: str) -> str:
    """What a word means."""
    return str(_WORDS.value(rdflib.URIRef(iri), RDFS.comment) or "")


def ontology_page() -> str:
    """Every class, property and code list value with its meaning."""
    version = _WORDS.value(rdflib.URIRef(GF.rstrip("#")), OWL.versionInfo)
    lines = [
        "# Ontology",
        "",
        "This page is generated from the ontology and the shapes.",
        "",
        f"Namespace `{GF}`, prefix `gf:`, version {version}. Features and geometries are "
        "GeoSPARQL 1.1, a field is also a SAREF4AGRI parcel, detections are SOSA observations, "
        "origins are PROV-O, the dataset is DCAT. The package holds the OWL 2 file "
        "`ontology.ttl`, the SHACL shapes `shapes.ttl` and the JSON-LD context "
        "`context.jsonld` in `geofield/formats/rdf/data/`. The namespace is a name: until it is "
        "registered with w3id.org nothing answers at that address, and nothing here asks it.",
        "",
        "## Names of things",
        "",
        f"Under a base of your own (`base_iri`; `{DEFAULT_BASE}` where you set none) a field is "
        "`{base}field/{field_id}`; an id that another program gave stands behind its place. "
        "A survey is `{field}/survey/{digest}`, a plan `{field}/plan/{digest}`, or "
        "`{field}/plan/{plan_name}` where you name it: digests of what they hold, so that two "
        "pictures, spacings or reviews never share a name.",
        "",
        "| layer | class | IRI |",
        "| --- | --- | --- |",
        *(
            f"| `{each.layer.name}` | `{each.cls}` | "
            f"`{'/'.join(filter(None, ['{plan}' if each.in_plan else '{survey}', each.path]))}` |"
            for each in layer_maps()
        ),
        "",
        "A geometry is `{feature}/geometry` (CRS84, the default) and `{feature}/geometry/EPSG-...` "
        "(the metric CRS).",
        "",
        "## Classes",
        "",
    ]
    for cls in classes():
        lines += [f"### {compact(cls)}", "", comment(cls), ""]
        parents = [
            f"`{compact(str(p))}`" for p in _WORDS.objects(rdflib.URIRef(cls), RDFS.subClassOf)
        ]
        lines += [f"Subclass of {', '.join(sorted(parents))}.", ""]
        values = individuals(cls)
        if values:
            lines += ["| value | meaning |", "| --- | --- |"]
            lines += [f"| `{compact(value)}` | {comment(value)} |" for value in values]
            lines.append("")
        rows = [_row(prop) for prop in properties(cls)]
        if rows:
            lines += ["| property | values | meaning |", "| --- | --- | --- |", *rows, ""]
    lines += ["## Prefixes", "", "| prefix | namespace |", "| --- | --- |"]
    lines += [f"| `{prefix}:` | `{iri}` |" for prefix, iri in SCHEMA_PREFIXES.items()]
    return "\n".join([*lines, ""])


def _row(prop: rdflib.term.Node) -> str:
    iri = rdflib.URIRef(str(_SHAPES.value(prop, SH.path)))
    name = compact(str(iri))
    least, most = _SHAPES.value(prop, SH.minCount), _SHAPES.value(prop, SH.maxCount)
    count = (
        ("one" if least else "at most one") if most else ("one or more" if least else "any number")
    )
    kind = _SHAPES.value(prop, SH.datatype) or _WORDS.value(iri, RDFS.range)
    named = f", `{compact(str(kind))}`" if isinstance(kind, rdflib.URIRef) else ""
    unit = _WORDS.value(iri, rdflib.URIRef(SCHEMA_PREFIXES["qudt"] + "hasUnit"))
    shown = f", `{compact(str(unit))}`" if unit else ""
    link = f"`{name}`" if name.startswith("gf:") else f"[`{name}`]({iri})"
    label = _WORDS.value(iri, RDFS.label) or name
    return f"| {link} | {count}{named}{shown} | {label}. {comment(str(iri))} |"


def queries_page() -> str:
    """Every query of the package with its SPARQL."""
    lines = [
        "# Queries",
        "",
        "This page is generated from the queries themselves.",
        "",
        "`geofield query FILE... NAME` answers them; `--set PARAMETER=VALUE` sets a parameter, "
        "`--show` prints the text with its prefixes, ready for any triple store, and what a store "
        "needs for it. Oxigraph and rdflib give the same answers.",
        "",
    ]
    for each in queries().values():
        body = "\n".join(line for line in each.text.splitlines() if not line.startswith("#"))
        lines += [f"## {each.name}", "", f"{each.title}. {each.description}", ""]
        if each.parameters:
            defaults = ", ".join(f"`{name}` ({value!r})" for name, value in each.parameters.items())
            lines += [f"Parameters: {defaults}.", ""]
        if each.needs:
            lines += [each.needs, ""]
        lines += ["```sparql", body, "```", ""]
    return "\n".join(lines)
