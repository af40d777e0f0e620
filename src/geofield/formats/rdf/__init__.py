"""Linked data: RDF in four syntaxes and two profiles, ontology, shapes, queries.

Where to look, in the order of the data:

- words: `vocabulary` and `terms` (classes, properties), `layers` (which column means what),
  `namespaces`, `iris` (how things are named); `ontology`, `shapes` and `publish` make the files
  in ``data/`` from them;
- out: `describe` and `features` (a dataset as nodes), `study` (the source study's words),
  `nodes` (many nodes as columns), `ntriples`, `turtle`, `rdfxml`, `jsonld` (columns as text),
  `write`; `study_xml` (the study's plain XML);
- in: `guard` (hostile files), `parse`, `wkt`, `origin`, `complete`, `read`;
- questions: `validate` with `quick` and `checks`, `query` with `geosparql` and ``queries/``.

A new column of the schema becomes a property by itself; an entry in `terms` gives it a better
name or comment, one in `layers` another meaning. Run ``python -m geofield.formats.rdf.publish``
afterwards.
"""
