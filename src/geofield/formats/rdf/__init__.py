"""Linked data: RDF in four syntaxes and two profiles, ontology, shapes, queries.

Where to look, in the order of the data:

- words: ``data/`` (the ontology, the shapes, the context: the source), `namespaces`, `layers`
  (which column means what), `names` (how things are named);
- out: `describe` and `features` (a dataset as nodes), `study` (the source study's words),
  `triples`, `jsonld`, `repeated`, `write` (by pyoxigraph; a graph of rdflib);
- in: `guard` (hostile files and questions), `parse`, `repeated`, `graph`, `geosparql`, `scope`
  (which plan is meant), `origin`, `complete`, `read`;
- questions: `validate` with `shapes` and `checks`, `query` with `geosparql` and ``queries/``.

A new column of the schema becomes a property by itself: `layers` may give it a better name, and
tests ask for its words in ``data/``.
"""
