"""The generated reference pages say everything that is written."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs" / "scripts"))

from geofield.formats.rdf.layers import all_terms, layer_maps
from geofield.formats.rdf.query import queries
from geofield.formats.rdf.vocabulary import CLASSES, INDIVIDUALS
from linked_data import ontology_page, queries_page


def test_the_ontology_page_explains_every_class_property_and_value():
    page = ontology_page()
    for each in CLASSES:
        assert f"### {each.name}\n\n{each.comment}" in page
    for name, term in all_terms().items():
        if set(term.domain) & {each.name for each in CLASSES}:
            assert f"`{name}`" in page, name
    for value in INDIVIDUALS:
        if value.type.startswith("gf:"):
            assert f"`{value.name}` | {value.comment}" in page
    for layer in layer_maps():
        assert f"| `{layer.layer.name}` | `{layer.cls}` |" in page


def test_the_queries_page_shows_every_query():
    page = queries_page()
    for name, query in queries().items():
        assert f"## {name}\n" in page
        assert query.description in page
        assert "WHERE" in query.text
        assert f"`{next(iter(query.parameters), '')}`" in page or not query.parameters
