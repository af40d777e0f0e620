"""Publish: the files made from the vocabulary tables, and where the package keeps them.

``python -m geofield.formats.rdf.publish`` writes them anew after a table has changed; a test
sees to it that they are not forgotten.
"""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path

from geofield.formats.rdf.jsonld import json_context
from geofield.formats.rdf.namespaces import PREFIXES
from geofield.formats.rdf.ontology import ontology_turtle
from geofield.formats.rdf.shapes import shapes_turtle

#: File names in the package's folder ``data``.
ONTOLOGY, SHAPES, CONTEXT = "ontology.ttl", "shapes.ttl", "context.jsonld"


def resource(name: str) -> str:
    """The text of one of the package's files."""
    return (files(__package__) / "data" / name).read_text(encoding="utf-8")


def published() -> dict[str, str]:
    """Each file's name and what it must hold."""
    context = {"@context": json_context(PREFIXES)}
    return {
        ONTOLOGY: ontology_turtle(),
        SHAPES: shapes_turtle(),
        CONTEXT: json.dumps(context, indent=1, ensure_ascii=False) + "\n",
    }


def write_published(folder: Path) -> None:
    """Write the files."""
    for name, text in published().items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_published(Path(__file__).parent / "data")
