"""Styles and project inside a GeoPackage, where QGIS looks for them."""

from __future__ import annotations

import json
import sqlite3

from geofield.formats.qgis.layer_style import qml
from geofield.formats.qgis.sld import sld
from geofield.model import Dataset

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


def add_styles(connection: sqlite3.Connection, dataset: Dataset, timestamp: str) -> None:
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


def add_project(connection: sqlite3.Connection, name: str, qgz: bytes, timestamp: str) -> None:
    """The table `qgis_projects` with one project: the hexadecimal text of a ``.qgz``."""
    connection.execute(_PROJECTS)
    metadata = {"last_modified_time": timestamp[:19], "last_modified_user": "geofield"}
    connection.execute(
        "INSERT INTO qgis_projects VALUES (?, ?, ?)",
        (name, json.dumps(metadata).encode(), qgz.hex().encode()),
    )
