"""GeoPackage, the home format: every layer, styles, project and origin in one file.

GDAL writes the layers from Arrow batches; the tables that GDAL has no words for (origin,
column titles and value lists, styles, the QGIS project) are added with SQLite. Everything
stamped with a time gets the date of the imagery, so that a second run is byte-identical.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

from geofield import schema
from geofield.formats import origin
from geofield.formats.arrow import gdal_config, write_layer
from geofield.formats.qgis.layer_style import qml
from geofield.formats.qgis.project import project_xml, qgz_bytes
from geofield.formats.qgis.sld import sld
from geofield.model import Dataset

#: GDAL 3.4 and QGIS 3.22 warn about 1.4.
GPKG_VERSION = "1.3"

_METADATA = """
CREATE TABLE gpkg_metadata (
  id INTEGER CONSTRAINT m_pk PRIMARY KEY ASC NOT NULL,
  md_scope TEXT NOT NULL DEFAULT 'dataset',
  md_standard_uri TEXT NOT NULL,
  mime_type TEXT NOT NULL DEFAULT 'text/xml',
  metadata TEXT NOT NULL DEFAULT ''
);
CREATE TABLE gpkg_metadata_reference (
  reference_scope TEXT NOT NULL,
  table_name TEXT,
  column_name TEXT,
  row_id_value INTEGER,
  timestamp DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
  md_file_id INTEGER NOT NULL,
  md_parent_id INTEGER,
  CONSTRAINT crmr_mfi_fk FOREIGN KEY (md_file_id) REFERENCES gpkg_metadata(id),
  CONSTRAINT crmr_mpi_fk FOREIGN KEY (md_parent_id) REFERENCES gpkg_metadata(id)
);
"""
_DATA_COLUMNS = """
CREATE TABLE gpkg_data_columns (
  table_name TEXT NOT NULL,
  column_name TEXT NOT NULL,
  name TEXT,
  title TEXT,
  description TEXT,
  mime_type TEXT,
  constraint_name TEXT,
  CONSTRAINT pk_gdc PRIMARY KEY (table_name, column_name),
  CONSTRAINT gdc_tn UNIQUE (table_name, name)
);
CREATE TABLE gpkg_data_column_constraints (
  constraint_name TEXT NOT NULL,
  constraint_type TEXT NOT NULL,
  value TEXT,
  min NUMERIC,
  min_is_inclusive BOOLEAN,
  max NUMERIC,
  max_is_inclusive BOOLEAN,
  description TEXT,
  CONSTRAINT gdcc_ntv UNIQUE (constraint_name, constraint_type, value)
);
"""
_STYLES = """
CREATE TABLE layer_styles (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  f_table_catalog TEXT(256),
  f_table_schema TEXT(256),
  f_table_name TEXT(256),
  f_geometry_column TEXT(256),
  styleName TEXT(30),
  styleQML TEXT,
  styleSLD TEXT,
  useAsDefault BOOLEAN,
  description TEXT,
  owner TEXT(30),
  ui TEXT(30),
  update_time DATETIME DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now'))
);
"""
_PROJECTS = "CREATE TABLE qgis_projects (name TEXT PRIMARY KEY, metadata BLOB, content BLOB);"


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``{stem}.gpkg`` and, over it, the QGIS project ``{stem}.qgz``.

    Options: ``points`` (default true) says whether the track points are written, which are
    streamed; ``project`` (default true) whether the ``.qgz`` is; ``picture`` (default true)
    whether the project shows the picture, which lies in the same folder then.
    """
    path = folder / f"{stem}.gpkg"
    stamp = origin.timestamp(dataset)
    # The file comes into place when it is whole: waiting for the disk after every layer and
    # statement would take most of the time. It is waited for once, at the end.
    with gdal_config(OGR_CURRENT_DATE=stamp, OGR_SQLITE_SYNCHRONOUS="OFF"):
        for layer in dataset.layers(working=True):
            write_layer(
                dataset,
                layer,
                path,
                "GPKG",
                points=bool(options.get("points", True)),
                dataset_options={"VERSION": GPKG_VERSION},
                layer_options={
                    "IDENTIFIER": layer.name,
                    "DESCRIPTION": layer.description,
                    "GEOMETRY_NAME": "geom",
                },
            )
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("PRAGMA synchronous = OFF")
        _add_origin(connection, dataset)
        _add_columns(connection, dataset)
        _add_styles(connection, dataset, stamp)
        shown = dataset if options.get("picture", True) else replace(dataset, scene_path=None)
        project = qgz_bytes(project_xml(shown, path.name), stem, stamp)
        _add_project(connection, stem, project, stamp)
    with path.open("r+b") as file:  # Windows waits for nothing that is open for reading alone
        os.fsync(file.fileno())
    if not options.get("project", True):
        return [path]
    beside = path.with_suffix(".qgz")
    beside.write_bytes(project)
    return [path, beside]


def _add_origin(connection: sqlite3.Connection, dataset: Dataset) -> None:
    connection.executescript(_METADATA)
    connection.execute(
        "INSERT INTO gpkg_metadata VALUES (1, 'dataset', ?, 'application/json', ?)",
        (origin.URI, origin.to_json(dataset)),
    )
    connection.execute(
        "INSERT INTO gpkg_metadata_reference VALUES ('geopackage', NULL, NULL, NULL, ?, 1, NULL)",
        (origin.timestamp(dataset),),
    )
    _register(connection, "metadata", "gpkg_metadata", "gpkg_metadata_reference")


def _add_columns(connection: sqlite3.Connection, dataset: Dataset) -> None:
    """Titles, meanings, units and value lists of the columns (the Schema extension)."""
    connection.executescript(_DATA_COLUMNS)
    described, allowed = [], []
    for layer in dataset.layers(working=True):
        for column in layer.columns:
            words = schema.meaning(layer, column)
            if column.unit:
                words += f" Unit (UCUM): {column.unit}"
            limit = f"{layer.name}_{column.name}" if column.values else None
            described.append((layer.name, column.name, column.name, column.title, words, limit))
            allowed += [(limit, value) for value in column.values]
    connection.executemany(
        "INSERT INTO gpkg_data_columns VALUES (?, ?, ?, ?, ?, NULL, ?)", described
    )
    connection.executemany(
        "INSERT INTO gpkg_data_column_constraints "
        "VALUES (?, 'enum', ?, NULL, NULL, NULL, NULL, NULL)",
        allowed,
    )
    _register(connection, "schema", "gpkg_data_columns", "gpkg_data_column_constraints")


def _register(connection: sqlite3.Connection, extension: str, *tables: str) -> None:
    page = f"http://www.geopackage.org/spec120/#extension_{extension}"
    connection.executemany(
        "INSERT INTO gpkg_extensions VALUES (?, NULL, ?, ?, 'read-write')",
        [(table, f"gpkg_{extension}", page) for table in tables],
    )


def _add_styles(connection: sqlite3.Connection, dataset: Dataset, timestamp: str) -> None:
    """The table `layer_styles`: one default style per layer, as QML and SLD."""
    connection.execute(_STYLES)
    for layer in dataset.layers(working=True):
        connection.execute(
            "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, "
            "f_geometry_column, styleName, styleQML, styleSLD, useAsDefault, description, owner, "
            "ui, update_time) VALUES ('', '', ?, 'geom', ?, ?, ?, 1, ?, '', NULL, ?)",
            (
                layer.name,
                layer.title[:30],
                qml(layer, dataset),
                sld(layer),
                layer.description,
                timestamp,
            ),
        )
    connection.execute(
        "INSERT INTO gpkg_contents (table_name, data_type, identifier, description, last_change, "
        "srs_id) VALUES ('layer_styles', 'attributes', 'layer_styles', 'Styles', ?, 0)",
        (timestamp,),
    )


def _add_project(connection: sqlite3.Connection, name: str, qgz: bytes, timestamp: str) -> None:
    """The table `qgis_projects` with one project: the hexadecimal text of a ``.qgz``."""
    connection.execute(_PROJECTS)
    metadata = {"last_modified_time": timestamp[:19], "last_modified_user": "geofield"}
    connection.execute(
        "INSERT INTO qgis_projects VALUES (?, ?, ?)",
        (name, json.dumps(metadata).encode(), qgz.hex().encode()),
    )
