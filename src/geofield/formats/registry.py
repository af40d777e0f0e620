"""The formats: what each is called, what it carries, what it drops, who writes and reads it.

The table is data only: nothing heavy is imported before a format is used.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

from geofield import schema
from geofield.errors import FormatError
from geofield.model import Dataset

Writer = Callable[..., list[Path]]
Reader = Callable[..., Dataset]
Validator = Callable[[Path], Iterable[Any]]


@dataclass(frozen=True, slots=True)
class Drop:
    """Something that a format cannot carry.

    Attributes
    ----------
    words : str
        For people: "the confidence of obstacles".
    when : str
        Which datasets have it: a layer (``gaps``), a column with values
        (``obstacles.confidence``), ``provenance``, ``holes`` (of the field) or
        ``polygons`` (obstacles that are not circles).
    """

    words: str
    when: str

    def __str__(self) -> str:
        return self.words


@dataclass(frozen=True, slots=True)
class Format:
    """One product format.

    Attributes
    ----------
    name : str
        As the user writes it.
    title : str
        For people.
    files : tuple of str
        What is written, relative to the output folder; ``{stem}`` is the product's name.
    layers : tuple of str
        The layers of `geofield.schema` that it carries.
    writer : str
        ``module:function`` with the signature
        ``write(dataset, folder, *, stem, options) -> list[Path]``: writes into the empty
        staging folder and returns what it wrote.
    reader : str or None
        ``module:function`` with the signature ``read(path) -> Dataset``; None where the
        format cannot be imported.
    suffixes : tuple of str
        By which a file is recognised; with the dot, lower case.
    drops : tuple of Drop
        What it cannot carry, besides the layers that are not in `layers`.
    precision_m : float or None
        How far a coordinate may move on the way out and back, metres; None where there is
        no way back.
    crs : str
        ``metric`` or ``WGS 84``.
    options : tuple of str
        The options its writer understands.
    asks_crs : bool
        Whether its reader takes a ``crs`` for files that do not say theirs.
    reads_folders : bool
        Whether its reader takes a folder of files; else a folder must hold just one.
    validator : str or None
        ``module:function`` with the signature ``check(path) -> Iterable[Finding]``: the rules
        of the format itself.
    """

    name: str
    title: str
    files: tuple[str, ...]
    layers: tuple[str, ...]
    writer: str
    reader: str | None = None
    suffixes: tuple[str, ...] = ()
    drops: tuple[Drop, ...] = ()
    precision_m: float | None = None
    crs: str = "WGS 84"
    options: tuple[str, ...] = ()
    asks_crs: bool = False
    validator: str | None = None
    reads_folders: bool = False

    def load_writer(self) -> Writer:
        """The writer, imported."""
        return _load(self.writer)  # type: ignore[no-any-return]

    def load_reader(self) -> Reader:
        """The reader, imported.

        Raises
        ------
        FormatError
            When the format cannot be imported.
        """
        if self.reader is None:
            readable = ", ".join(each.name for each in FORMATS.values() if each.reader)
            raise FormatError(
                f"{self.title} can be written, not read.", hint=f"These can be read: {readable}."
            )
        return _load(self.reader)  # type: ignore[no-any-return]

    def load_validator(self) -> Validator | None:
        """The check of the format's own rules, imported; None where there is none."""
        return None if self.validator is None else _load(self.validator)


def _load(reference: str) -> Any:
    module, _, function = reference.partition(":")
    return getattr(import_module(module), function)


_ALL = tuple(layer.name for layer in schema.LAYERS)
_RDF_OPTIONS = ("rdf_profile", "base_iri", "plan_name")

_TERMINAL_DROPS = (
    Drop("rejected obstacles and the status, radius and confidence of the others", "obstacles"),
    Drop("settings and evidence", "provenance"),
)

_FORMATS = (
    Format(
        "gpkg",
        "GeoPackage 1.3",
        ("{stem}.gpkg", "{stem}.qgz"),
        _ALL,
        "geofield.formats.gpkg:write",
        "geofield.formats.gpkg_read:read",
        suffixes=(".gpkg",),
        precision_m=0.0,
        crs="metric",
        options=("points", "project"),
        validator="geofield.formats.checks.gpkg:check",
    ),
    Format(
        "geojson",
        "GeoJSON (RFC 7946)",
        ("geojson/<layer>.geojson",),
        _ALL,
        "geofield.formats.geojson:write",
        "geofield.formats.geojson:read",
        suffixes=(".geojson", ".json"),
        drops=(Drop("settings and evidence", "provenance"),),
        precision_m=0.012,
        asks_crs=True,
        validator="geofield.formats.checks.geojson:check",
        reads_folders=True,
    ),
    Format(
        "shapefile",
        "ESRI Shapefile",
        ("shapefile/boundary.shp", "shapefile/obstacles.shp", "shapefile/guidance.shp"),
        ("field", "obstacles", "segments"),
        "geofield.formats.shapefile:write",
        "geofield.formats.shapefile:read",
        suffixes=(".shp",),
        drops=(Drop("settings and evidence", "provenance"),),
        precision_m=1e-6,
        options=("profile", "customer", "farm", "zip"),
        asks_crs=True,
        validator="geofield.formats.checks.shapefile:check",
        reads_folders=True,
    ),
    Format(
        "geoparquet",
        "GeoParquet 1.1",
        ("geoparquet/<layer>.parquet",),
        _ALL,
        "geofield.formats.geoparquet:write",
        "geofield.formats.geoparquet:read",
        suffixes=(".parquet",),
        precision_m=0.0,
        crs="metric",
        reads_folders=True,
    ),
    Format(
        "flatgeobuf",
        "FlatGeobuf",
        ("flatgeobuf/<layer>.fgb",),
        _ALL,
        "geofield.formats.flatgeobuf:write",
        "geofield.formats.flatgeobuf:read",
        suffixes=(".fgb",),
        drops=(Drop("settings and evidence", "provenance"),),
        precision_m=0.0,
        crs="metric",
        reads_folders=True,
    ),
    Format(
        "kml",
        "KML 2.2",
        ("{stem}.kml",),
        ("field", "obstacles", "tracks", "gaps"),
        "geofield.formats.kml:write",
        "geofield.formats.kml:read",
        suffixes=(".kml", ".kmz"),
        drops=(Drop("settings and evidence", "provenance"),),
        precision_m=0.0002,
    ),
    Format(
        "gpx",
        "GPX 1.1",
        ("{stem}.gpx",),
        ("tracks", "segments"),
        "geofield.formats.gpx:write",
        suffixes=(".gpx",),
        drops=(
            Drop("the shape and status of obstacles (it has their centres)", "obstacles"),
            Drop("settings and evidence", "provenance"),
        ),
        validator="geofield.formats.checks.gdal:check",
    ),
    Format(
        "csv",
        "CSV of track points and obstacles",
        ("csv/track_points.csv", "csv/obstacles.csv"),
        ("track_points", "obstacles"),
        "geofield.formats.tables_csv:write",
        drops=(Drop("settings and evidence", "provenance"),),
    ),
    Format(
        "fiboa",
        "fiboa 0.3.0 (GeoJSON and GeoParquet)",
        ("fiboa/{stem}.geojson", "fiboa/{stem}.parquet"),
        ("field",),
        "geofield.formats.fiboa:write",
        drops=(Drop("settings and evidence", "provenance"),),
    ),
    Format(
        "dxf",
        "DXF of lines",
        ("{stem}.dxf", "{stem}.prj"),
        ("field", "obstacles", "segments", "gaps"),
        "geofield.formats.dxf:write",
        suffixes=(".dxf",),
        drops=(
            Drop("names, numbers and statuses", "field"),
            Drop("settings and evidence", "provenance"),
        ),
        crs="metric",
        validator="geofield.formats.checks.gdal:check",
    ),
    Format(
        "isoxml",
        "ISOXML version 4 (ISO 11783-10)",
        ("isoxml/TASKDATA/TASKDATA.XML",),
        ("field", "obstacles", "segments", "headland"),
        "geofield.formats.isoxml:write_v4",
        "geofield.formats.isoxml:read",
        drops=_TERMINAL_DROPS,
        precision_m=0.0002,
        options=("customer", "farm"),
        validator="geofield.formats.checks.isoxml:check",
        reads_folders=True,
    ),
    Format(
        "isoxml-v3",
        "ISOXML version 3 (ISO 11783-10)",
        ("isoxml-v3/TASKDATA/TASKDATA.XML",),
        ("field", "obstacles", "segments"),
        "geofield.formats.isoxml:write_v3",
        "geofield.formats.isoxml:read",
        drops=_TERMINAL_DROPS,
        precision_m=0.0002,
        options=("customer", "farm"),
        validator="geofield.formats.checks.isoxml:check",
        reads_folders=True,
    ),
    Format(
        "agopengps",
        "AgOpenGPS field folder",
        tuple(
            f"agopengps/Fields/<name>/{file}.txt"
            for file in ("Field", "Boundary", "TrackLines", "Flags")
        ),
        ("field", "obstacles", "tracks"),
        "geofield.formats.agopengps:write",
        "geofield.formats.agopengps:read",
        drops=(
            Drop("the breaks in tracks (it has whole lines)", "gaps"),
            Drop("holes in obstacles", "polygons"),
            *_TERMINAL_DROPS,
        ),
        precision_m=0.005,
        validator="geofield.formats.checks.agopengps:check",
        reads_folders=True,
    ),
    Format(
        "rdf",
        "RDF/XML linked data",
        ("obstacles.rdf", "tracks.rdf", "field.rdf"),
        _ALL,
        "geofield.formats.rdf.write:write_rdfxml",
        "geofield.formats.rdf.read:read",
        validator="geofield.formats.rdf.validate:check",
        suffixes=(".rdf", ".owl"),
        precision_m=0.0,
        options=_RDF_OPTIONS,
    ),
    Format(
        "turtle",
        "Turtle linked data",
        ("{stem}.ttl",),
        _ALL,
        "geofield.formats.rdf.write:write_turtle",
        "geofield.formats.rdf.read:read",
        validator="geofield.formats.rdf.validate:check",
        suffixes=(".ttl",),
        precision_m=0.0,
        options=_RDF_OPTIONS,
    ),
    Format(
        "jsonld",
        "JSON-LD linked data",
        ("{stem}.jsonld",),
        _ALL,
        "geofield.formats.rdf.write:write_jsonld",
        "geofield.formats.rdf.read:read",
        validator="geofield.formats.rdf.validate:check",
        suffixes=(".jsonld",),
        precision_m=0.0,
        options=_RDF_OPTIONS,
    ),
    Format(
        "ntriples",
        "N-Triples linked data",
        ("{stem}.nt",),
        _ALL,
        "geofield.formats.rdf.write:write_ntriples",
        "geofield.formats.rdf.read:read",
        validator="geofield.formats.rdf.validate:check",
        suffixes=(".nt",),
        precision_m=0.0,
        options=_RDF_OPTIONS,
    ),
    Format(
        "rdf-study",
        "RDF/XML in the source study's vocabulary",
        ("obstacles.rdf", "tracks.rdf", "field.rdf"),
        _ALL,
        "geofield.formats.rdf.write:write_study",
        "geofield.formats.rdf.read:read",
        validator="geofield.formats.rdf.validate:check",
        precision_m=0.0,
        options=("base_iri", "plan_name"),
    ),
    Format(
        "study-xml",
        "Plain XML of the source study",
        ("obstacles.xml", "path.xml"),
        ("obstacles", "track_points"),
        "geofield.formats.rdf.study_xml:write_study_xml",
        drops=(
            Drop("settings and evidence", "provenance"),
            Drop("the outlines of obstacles that are not round", "polygons"),
            Drop("the confidence of obstacles", "obstacles.confidence"),
        ),
    ),
)

#: Every format by its name.
FORMATS: Mapping[str, Format] = MappingProxyType({each.name: each for each in _FORMATS})


def format_named(name: str) -> Format:
    """The format of a name.

    Raises
    ------
    FormatError
        When there is none; says which name is nearest.
    """
    key = name.strip().lower()
    if key in FORMATS:
        return FORMATS[key]
    names = {each: each for each in FORMATS}
    names |= {suffix.lstrip("."): f.name for f in FORMATS.values() for suffix in f.suffixes}
    names |= {f.title.lower(): f.name for f in FORMATS.values()}
    near = difflib.get_close_matches(key, list(names), n=1, cutoff=0.5)
    hint = f"Did you mean {names[near[0]]!r}? " if near else ""
    raise FormatError(f"There is no format {name!r}.", hint=f"{hint}Formats: {', '.join(FORMATS)}.")


def detect(path: Path | str) -> Format:
    """The format of a file or folder, by its suffix and content.

    Raises
    ------
    FormatError
        When there is no such file, or nothing here reads it.
    """
    place = Path(path)
    if not place.exists():
        raise FormatError(f"There is no file {place}.", hint="Check the path.")
    if place.is_dir():
        return _detect_folder(place)
    suffix = place.suffix.lower()
    if suffix == ".xml" and _is_taskdata(place):
        return format_named("isoxml")
    for each in FORMATS.values():
        if suffix in each.suffixes:
            return each
    if place.name in ("Field.txt", "Boundary.txt", "TrackLines.txt"):
        return format_named("agopengps")
    raise FormatError(
        f"The format of {place} is not known.",
        hint=f"Known: {', '.join(sorted(s for f in FORMATS.values() for s in f.suffixes))}.",
    )


def product_file(place: Path, found: Format) -> Path:
    """What a format's reader is given for a path: the path, or the one file in that folder.

    Raises
    ------
    FormatError
        When the folder holds several.
    """
    if not place.is_dir() or found.reads_folders:
        return place
    files = sorted(file for file in place.iterdir() if file.suffix.lower() in found.suffixes)
    if len(files) != 1:
        raise FormatError(
            f"{place} holds {len(files)} {found.title} files.", hint="Name one of them."
        )
    return files[0]


def _detect_folder(folder: Path) -> Format:
    names = {path.name.upper() for path in folder.iterdir()}
    if "TASKDATA.XML" in names or "TASKDATA" in names:
        return format_named("isoxml")
    if {"FIELD.TXT", "BOUNDARY.TXT"} & names or any(folder.glob("*/Field.txt")):
        return format_named("agopengps")
    suffixes = {Path(name).suffix.lower() for name in names}
    for each in FORMATS.values():
        if each.reader is not None and suffixes & set(each.suffixes):
            return each
    raise FormatError(
        f"{folder} holds no product that is known.", hint="Name one of its files instead."
    )


def _is_taskdata(path: Path) -> bool:
    with path.open("rb") as file:
        return b"ISO11783_TaskData" in file.read(4096)
