"""The reference pages of linked data: the ontology and the queries, from their tables."""

from __future__ import annotations

from geofield.formats.rdf.layers import all_terms, layer_maps
from geofield.formats.rdf.namespaces import DEFAULT_BASE, GF, SCHEMA_PREFIXES, expand
from geofield.formats.rdf.ontology import MANY_VALUES, VERSION
from geofield.formats.rdf.query import queries
from geofield.formats.rdf.shapes import REQUIRED
from geofield.formats.rdf.vocabulary import CLASSES, INDIVIDUALS, Term


def ontology_page() -> str:
    """Every class, property and code list value with its meaning."""
    lines = [
        "# Ontology",
        "",
        "This page is generated from the code it describes.",
        "",
        f"Namespace `{GF}`, prefix `gf:`, version {VERSION}. Features and geometries are "
        "GeoSPARQL 1.1, a field is also a SAREF4AGRI parcel, detections are SOSA observations, "
        "origins are PROV-O, the dataset is DCAT. The package holds the OWL 2 file "
        "`ontology.ttl`, the SHACL shapes `shapes.ttl` and the JSON-LD context "
        "`context.jsonld` in `geofield/formats/rdf/data/`. The namespace is a name: until it is "
        "registered with w3id.org nothing answers at that address, and nothing here asks it.",
        "",
        "## Names of things",
        "",
        f"Under a base of your own (`base_iri`; `{DEFAULT_BASE}` where you set none):",
        "",
        "| layer | class | IRI |",
        "| --- | --- | --- |",
        *(
            f"| `{each.layer.name}` | `{each.cls}` | "
            f"`{'/'.join(filter(None, ['{base}field/{field_id}', each.path]))}` |"
            for each in layer_maps()
        ),
        "",
        "A geometry is `{feature}/geometry` (CRS84, the default) and `{feature}/geometry/EPSG-...` "
        "(the metric CRS). With a `plan_name`, tracks and what belongs to them stand below "
        "`{field}/plan/{plan_name}/`; obstacles never do.",
        "",
        "## Classes",
        "",
    ]
    for each in CLASSES:
        terms = [term for term in all_terms().values() if each.name in term.domain]
        lines += [f"### {each.name}", "", each.comment, ""]
        lines += [f"Subclass of {', '.join(f'`{parent}`' for parent in each.parents)}.", ""]
        values = [value for value in INDIVIDUALS if value.type == each.name]
        if values:
            lines += ["| value | meaning |", "| --- | --- |"]
            lines += [f"| `{value.name}` | {value.comment} |" for value in values]
            lines.append("")
        if terms:
            lines += ["| property | values | meaning |", "| --- | --- | --- |"]
            lines += [_row(term, each.name) for term in terms]
            lines.append("")
    lines += ["## Prefixes", "", "| prefix | namespace |", "| --- | --- |"]
    lines += [f"| `{prefix}:` | `{iri}` |" for prefix, iri in SCHEMA_PREFIXES.items()]
    return "\n".join([*lines, ""])


def _row(term: Term, cls: str) -> str:
    needed = term.name in REQUIRED.get(cls, ()) or term.name == "geo:hasDefaultGeometry"
    count = ("one" if needed else "at most one") if term.name not in MANY_VALUES else "any number"
    unit = f", `{term.unit}`" if term.unit else ""
    link = f"[`{term.name}`]({expand(term.name)})" if term.name[:3] != "gf:" else f"`{term.name}`"
    return f"| {link} | {count}, `{term.range}`{unit} | {term.label}. {term.comment} |"


def queries_page() -> str:
    """Every query of the package with its SPARQL."""
    lines = [
        "# Queries",
        "",
        "This page is generated from the code it describes.",
        "",
        "`geofield query FILE... NAME` answers them; `--set PARAMETER=VALUE` sets a parameter, "
        "`--show` prints the text with its prefixes, ready for any triple store. Queries with "
        "`geof:` functions need a store that knows GeoSPARQL, or geofield.",
        "",
    ]
    for each in queries().values():
        body = "\n".join(line for line in each.text.splitlines() if not line.startswith("#"))
        lines += [f"## {each.name}", "", f"{each.title}. {each.description}", ""]
        if each.parameters:
            defaults = ", ".join(f"`{name}` ({value!r})" for name, value in each.parameters.items())
            lines += [f"Parameters: {defaults}.", ""]
        lines += ["```sparql", body, "```", ""]
    return "\n".join(lines)
