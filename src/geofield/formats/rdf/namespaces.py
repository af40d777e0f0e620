"""Namespaces, well-known terms and CRS identifiers of the linked data products."""

from __future__ import annotations

import json
import re
from functools import cache, lru_cache
from importlib.resources import files
from typing import Any, Final

import pyoxigraph as ox
from pyproj import CRS

#: The ontology's namespace.
GF: Final = "https://w3id.org/geofield#"
#: Under which features are named when the user sets no base of their own. `example.org`
#: belongs to nobody: whoever publishes data sets a base they control.
DEFAULT_BASE: Final = "https://example.org/geofield/"

#: The source of all words: written by hand, and held against the schema's columns by tests.
ONTOLOGY, SHAPES, CONTEXT = "ontology.ttl", "shapes.ttl", "context.jsonld"


def resource(name: str) -> str:
    """The text of one of the files in the package's folder ``data``."""
    return (files(__package__) / "data" / name).read_text(encoding="utf-8")


#: The JSON-LD context: prefixes, and a short term with its type for each property.
CONTEXT_TERMS: Final[dict[str, Any]] = json.loads(resource(CONTEXT))["@context"]
#: Prefixes of every product, by name.
PREFIXES: Final = {name: iri for name, iri in CONTEXT_TERMS.items() if isinstance(iri, str)}
#: The source study's vocabulary (METHOD.md, section 5).
STUDY_PREFIXES: Final[dict[str, str]] = {
    "po": "http://purl.obolibrary.org/obo/PO_0000003/hasNarrowSynonym#",
    "svg": "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd/circle#",
    "gml": "http://www.opengis.net/gml/",
    "obstacle": "http://www.DLC.org/Obstacle#",
    "trajectory": "http://www.DLC.org/trajectory#",
}
_TURTLE_PREFIX: Final = re.compile(r"^@prefix (\w+): <(.*)> \.$", re.MULTILINE)
#: Also those that the ontology, the shapes and the queries need.
SCHEMA_PREFIXES: Final[dict[str, str]] = dict(_TURTLE_PREFIX.findall(resource(ONTOLOGY)))

RDF: Final = PREFIXES["rdf"]
XSD: Final = PREFIXES["xsd"]
SH: Final = SCHEMA_PREFIXES["sh"]
GEOF: Final = SCHEMA_PREFIXES["geof"]
TYPE: Final = RDF + "type"
STRING: Final = XSD + "string"
DOUBLE: Final = XSD + "double"
INTEGER: Final = XSD + "integer"
BOOLEAN: Final = XSD + "boolean"

CRS84: Final = "http://www.opengis.net/def/crs/OGC/1.3/CRS84"
_LOCAL_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
EPSG: Final = "http://www.opengis.net/def/crs/EPSG/0/"


@cache
def expand(curie: str) -> str:
    """The full IRI of a prefixed name such as ``gf:Track``; a full IRI as it is."""
    prefix, _, name = curie.partition(":")
    if name.startswith("//"):
        return curie
    return (SCHEMA_PREFIXES.get(prefix) or STUDY_PREFIXES[prefix]) + name


@cache
def node(curie: str) -> ox.NamedNode:
    """The term of a prefixed name or a full IRI."""
    return ox.NamedNode(expand(curie))


@lru_cache(maxsize=4096)
def compact(iri: str) -> str:
    """An IRI as a prefixed name where it has one."""
    for prefix, namespace in SCHEMA_PREFIXES.items():
        if iri.startswith(namespace) and _LOCAL_NAME.fullmatch(iri, len(namespace)):
            return f"{prefix}:{iri[len(namespace) :]}"
    return iri


def crs_iri(crs: CRS) -> str | None:
    """The OGC identifier of a CRS, None where it has no EPSG code."""
    authority = crs.to_authority(auth_name="EPSG", min_confidence=100)
    return EPSG + str(authority[1]) if authority else None
