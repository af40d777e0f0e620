"""What is written."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from geofield.settings.section import Section, words

#: The formats that can be written; held against the registry of formats by a test.
FormatName = Literal[
    "gpkg",
    "geojson",
    "shapefile",
    "geoparquet",
    "flatgeobuf",
    "kml",
    "gpx",
    "csv",
    "fiboa",
    "dxf",
    "isoxml",
    "isoxml-v3",
    "agopengps",
    "rdf",
    "turtle",
    "jsonld",
    "ntriples",
    "rdf-study",
    "study-xml",
    "scene",
    "map",
    "map-svg",
    "map-pdf",
    "report",
    "html",
]


class ExportSettings(Section):
    """What is written."""

    formats: Annotated[tuple[FormatName, ...], BeforeValidator(words)] = Field(
        ("gpkg", "geojson", "shapefile", "rdf"),
        description="Formats of the products.",
        json_schema_extra={"option": "--format"},
    )
    points: bool = Field(False, description="Track points in linked data, too: most of its bytes.")
