"""Linked data: RDF in four syntaxes and two profiles, ontology, shapes, queries."""
