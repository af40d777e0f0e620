"""The generated reference pages say everything that is written."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs" / "scripts"))

from geofield.formats.rdf.graph import ontology
from geofield.formats.rdf.layers import layer_maps
from geofield.formats.rdf.namespaces import compact
from geofield.formats.rdf.query import queries
from linked_data import classes, individuals, ontology_page, queries_page


def test_the_ontology_page_explains_every_class_property_and_value():
    page, words = ontology_page(), ontology()
    assert len(classes()) == 16
    for cls in classes():
        assert f"### {compact(cls)}\n\n{words.value(cls, 'rdfs:comment')}" in page
        for value in individuals(cls):
            assert f"`{compact(value)}` | {words.value(value, 'rdfs:comment')}" in page
    for layer in layer_maps():
        assert f"| `{layer.layer.name}` | `{layer.cls}` |" in page
        for column, name in layer.properties():
            assert f"`{name}`" in page or name == "rdfs:label", column.name


def test_the_queries_page_shows_every_query():
    page = queries_page()
    for name, query in queries().items():
        assert f"## {name}\n" in page
        assert query.description in page
        assert query.needs in page
        assert "WHERE" in query.text
        assert f"`{next(iter(query.parameters), '')}`" in page or not query.parameters
