"""The table of formats. Data only: `geofield.formats.registry` finds them in it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from geofield import schema
from geofield.formats.format import Drop, Format

_ALL = tuple(layer.name for layer in schema.LAYERS if not layer.working)
_MAP = ("field", "obstacles", "segments", "gaps", "headland_tracks", "turns")
_ORIGIN = Drop("settings and evidence", "provenance")
_OWN = Drop("columns of your own", "own")

#: Endings of GeoParquet.
PARQUET = (".parquet", ".geoparquet", ".pq")

_PASSED = Drop("obstacles that tracks run through", "passed")

_TERMINAL_DROPS = (
    _PASSED,
    Drop("obstacles that stand in holes of the field or outside it", "outside"),
    Drop("the status, radius and confidence of obstacles", "obstacles"),
    _OWN,
    _ORIGIN,
)
#: Of trees version 4 has points.
_KIND = Drop("which obstacles are trees", "obstacles")

#: A file for each layer.
_by_layer = partial(Format, layers=_ALL, reads_folders=True, fields="joined")
#: What shows a plan to people, on its picture.
_shown = partial(Format, drops=(_ORIGIN,), crs="metric", pictured=True)
_RDFXML = Format(
    "rdf",
    "RDF/XML linked data",
    ("obstacles.rdf", "tracks.rdf", "field.rdf"),
    _ALL,
    "geofield.formats.rdf.write:write_rdfxml",
    "geofield.formats.rdf.read:read",
    validator="geofield.formats.rdf.validate:check",
    suffixes=(".rdf", ".owl"),
    drops=(_OWN,),
    precision_m=0.0,
    options=("rdf_profile", "base_iri", "plan_name", "points"),
    tabular=False,
    fields="many",
)


def _linked(name: str, title: str, suffix: str) -> Format:
    """The triples of RDF/XML in another notation, as one file."""
    return replace(
        _RDFXML,
        name=name,
        title=f"{title} linked data",
        files=(f"{{stem}}{suffix}",),
        writer=f"geofield.formats.rdf.write:write_{name}",
        suffixes=(suffix,),
    )


_ISOXML = Format(
    "isoxml",
    "ISOXML version 4 (ISO 11783-10)",
    ("isoxml/TASKDATA/TASKDATA.XML",),
    ("field", "obstacles", "segments", "headland"),
    "geofield.formats.isoxml.write:write_v4",
    "geofield.formats.isoxml.read:read",
    drops=_TERMINAL_DROPS,
    precision_m=0.0002,
    options=("customer", "farm", "zip", "headland"),
    several="geofield.formats.isoxml.read:several",
    validator="geofield.formats.checks.isoxml:check",
    steers=True,
    tabular=False,
    reads_folders=True,
    fields="many",
)

#: In the order in which people see them.
CATALOGUE: tuple[Format, ...] = (
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
        options=("points", "project", "picture"),
        validator="geofield.formats.checks.gpkg:check",
        fields="joined",
    ),
    _by_layer(
        "geojson",
        "GeoJSON (RFC 7946)",
        ("geojson/<layer>.geojson",),
        writer="geofield.formats.geojson:write",
        reader="geofield.formats.geojson:read",
        suffixes=(".geojson", ".json"),
        drops=(_ORIGIN,),
        precision_m=0.012,
        asks_crs=True,
        validator="geofield.formats.checks.geojson:check",
    ),
    Format(
        "shapefile",
        "ESRI Shapefile",
        (
            "shapefile/boundary.shp",
            "shapefile/obstacles.shp",
            *(f"shapefile/obstacles_{status}.shp" for status in schema.NOT_AVOIDED),
            "shapefile/guidance.shp",
        ),
        ("field", "obstacles", "segments"),
        "geofield.formats.shapefile:write",
        "geofield.formats.shapefile:read",
        suffixes=(".shp",),
        drops=(Drop("columns of your own in tracks", "tracks.own"), _ORIGIN),
        precision_m=1e-6,
        options=("profile", "customer", "farm", "zip"),
        asks_crs=True,
        validator="geofield.formats.checks.shapefile:check",
        steers=True,
        reads_folders=True,
        fields="many",
    ),
    _by_layer(
        "geoparquet",
        "GeoParquet 1.1",
        ("geoparquet/<layer>.parquet",),
        writer="geofield.formats.geoparquet:write",
        reader="geofield.formats.geoparquet:read",
        suffixes=PARQUET,
        precision_m=0.0,
        crs="metric",
    ),
    _by_layer(
        "flatgeobuf",
        "FlatGeobuf",
        ("flatgeobuf/<layer>.fgb",),
        writer="geofield.formats.flatgeobuf:write",
        reader="geofield.formats.flatgeobuf:read",
        suffixes=(".fgb",),
        drops=(_ORIGIN,),
        precision_m=0.0,
        crs="metric",
    ),
    Format(
        "kml",
        "KML 2.2",
        ("{stem}.kml",),
        ("field", "obstacles", "tracks", "gaps"),
        "geofield.formats.kml:write",
        "geofield.formats.kml:read",
        suffixes=(".kml", ".kmz"),
        drops=(Drop("columns of your own in segments", "segments.own"), _ORIGIN),
        precision_m=0.0002,
        fields="many",
    ),
    Format(
        "gpx",
        "GPX 1.1",
        ("{stem}.gpx",),
        ("obstacles", "tracks", "segments"),
        "geofield.formats.gpx:write",
        "geofield.formats.gpx:read",
        suffixes=(".gpx",),
        precision_m=0.0002,
        drops=(
            _PASSED,
            Drop("the shape and status of obstacles (it has their centres)", "obstacles"),
            _OWN,
            _ORIGIN,
        ),
        validator="geofield.formats.checks.gdal:check",
        steers=True,
    ),
    Format(
        "csv",
        "CSV of track points and obstacles",
        ("csv/track_points.csv", "csv/obstacles.csv"),
        ("track_points", "obstacles"),
        "geofield.formats.tables_csv:write",
        "geofield.formats.table_positions:read",
        suffixes=(".csv", ".tsv"),
        precision_m=0.0002,
        asks_crs=True,
        reads_folders=True,
        drops=(Drop("the outlines of obstacles that are not round", "polygons"), _OWN, _ORIGIN),
    ),
    Format(
        "fiboa",
        "fiboa 0.3.0 (GeoJSON and GeoParquet)",
        ("fiboa/{stem}.geojson", "fiboa/{stem}.parquet"),
        ("field",),
        "geofield.formats.fiboa:write",
        drops=(_ORIGIN,),
        fields="many",
    ),
    Format(
        "dxf",
        "DXF of lines",
        ("{stem}.dxf", "{stem}.prj"),
        ("field", "obstacles", "segments", "gaps"),
        "geofield.formats.dxf:write",
        "geofield.formats.dxf:read",
        suffixes=(".dxf",),
        asks_crs=True,
        precision_m=1e-6,
        drops=(
            _PASSED,
            Drop("names, numbers and statuses", "field"),
            _OWN,
            _ORIGIN,
        ),
        crs="metric",
        validator="geofield.formats.checks.gdal:check",
        steers=True,
    ),
    _ISOXML,
    replace(
        _ISOXML,
        name="isoxml-v3",
        title="ISOXML version 3 (ISO 11783-10)",
        files=("isoxml-v3/TASKDATA/TASKDATA.XML",),
        layers=("field", "obstacles", "segments"),
        writer="geofield.formats.isoxml.write:write_v3",
        drops=(_KIND, *_TERMINAL_DROPS),
        options=("customer", "farm", "zip"),
    ),
    Format(
        "agopengps",
        "AgOpenGPS field folder",
        tuple(
            f"agopengps/Fields/<name>/{file}.txt"
            for file in ("Field", "Boundary", "Headland", "TrackLines", "Flags")
        ),
        ("field", "obstacles", "tracks", "headland"),
        "geofield.formats.agopengps.write:write",
        "geofield.formats.agopengps.read:read",
        drops=(
            Drop("the breaks in tracks (it has whole lines)", "gaps"),
            Drop("holes in obstacles", "polygons"),
            Drop("the headland's line around all but the field's largest part", "parts"),
            _KIND,
            *_TERMINAL_DROPS,
        ),
        precision_m=0.005,
        validator="geofield.formats.checks.agopengps:check",
        steers=True,
        tabular=False,
        reads_folders=True,
        fields="apart",
    ),
    _RDFXML,
    _linked("turtle", "Turtle", ".ttl"),
    _linked("jsonld", "JSON-LD", ".jsonld"),
    _linked("ntriples", "N-Triples", ".nt"),
    replace(
        _RDFXML,
        name="rdf-study",
        title="RDF/XML in the source study's vocabulary",
        writer="geofield.formats.rdf.write:write_study",
        suffixes=(),
        precision_m=0.008,
        options=("base_iri", "plan_name", "points"),
    ),
    Format(
        "study-xml",
        "Plain XML of the source study",
        ("obstacles.xml", "path.xml"),
        ("obstacles", "track_points"),
        "geofield.formats.study_xml:write_study_xml",
        drops=(
            _OWN,
            _ORIGIN,
            _PASSED,
            Drop("the outlines of obstacles that are not round", "polygons"),
            Drop("the status, safety margin and confidence of obstacles", "obstacles"),
        ),
    ),
    _shown(
        "scene",
        "Picture of the plan (cloud-optimised GeoTIFF)",
        ("scene.tif",),
        (),
        "geofield.products:write_scene",
        crs="the picture's own",
        automatic=True,
    ),
    _shown(
        "map",
        "Map picture",
        ("map.png",),
        (*_MAP[:4], "headland", *_MAP[4:]),
        "geofield.products:write_map",
        automatic=True,
    ),
    _shown(
        "map-svg",
        "Map as lines for drawing programs (SVG)",
        ("map.svg",),
        _MAP,
        "geofield.mapping.plot:write_svg",
        drawn_by="matplotlib",
    ),
    _shown(
        "map-pdf",
        "Map on a page for print (PDF)",
        ("map.pdf",),
        _MAP,
        "geofield.mapping.plot:write_pdf",
        drawn_by="matplotlib",
    ),
    Format(
        "report",
        "Report of counts, lengths, settings and terms (JSON)",
        ("report.json",),
        (),
        "geofield.products:write_report",
        automatic=True,
    ),
    _shown(
        "html",
        "Web page in one file",
        ("{stem}.html",),
        ("field", "obstacles", "segments", "gaps", "headland_tracks", "route", "turns"),
        "geofield.web.html:write",
        suffixes=(".html",),
    ),
)
