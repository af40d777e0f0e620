"""Rules of GeoPackage 1.3 that readers stumble over."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from geofield.formats.validation import Finding
from geofield.strangers import database
from geofield.wording import counted

_APPLICATION_ID = 0x47504B47  # "GPKG"
_REQUIRED = ("gpkg_spatial_ref_sys", "gpkg_contents", "gpkg_geometry_columns")


def check(path: Path) -> Iterator[Finding]:
    """Findings in a GeoPackage's own structure."""
    try:
        with database(path) as connection:
            yield from _check(connection, path.name)
    except sqlite3.DatabaseError as error:
        yield Finding("error", path.name, f"not a database that SQLite can read: {error}")


def _check(connection: sqlite3.Connection, name: str) -> Iterator[Finding]:
    (result,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if result != "ok":
        yield Finding("error", name, f"the database is damaged: {result}")
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    if application != _APPLICATION_ID:
        yield Finding("error", name, "the application id is not GPKG")
    tables = {row[0] for row in connection.execute("SELECT name FROM sqlite_master")}
    for required in _REQUIRED:
        if required not in tables:
            yield Finding("error", name, f"the table {required} is missing")
            return
    (mode,) = connection.execute("PRAGMA journal_mode").fetchone()
    if mode == "wal":
        yield Finding(
            "warning", name, "it is open in QGIS or was not closed there (write-ahead log)"
        )
    layers = connection.execute(
        "SELECT c.table_name, c.data_type, g.column_name, g.srs_id, c.srs_id "
        "FROM gpkg_contents c LEFT JOIN gpkg_geometry_columns g USING (table_name)"
    ).fetchall()
    yield from _check_layers(connection, layers, tables)


def _check_layers(
    connection: sqlite3.Connection, layers: list[tuple[Any, ...]], tables: set[str]
) -> Iterator[Finding]:
    for table, kind, column, srs, contents_srs in layers:
        if table not in tables:
            yield Finding("error", table, "is in gpkg_contents, but there is no such table")
        elif kind == "features" and column is None:
            yield Finding("error", table, "has no entry in gpkg_geometry_columns")
        elif kind == "features":
            if srs != contents_srs:
                yield Finding("error", table, "has two different srs_id")
            if f"rtree_{table}_{column}" not in tables:
                yield Finding("warning", table, "has no spatial index: slow in large fields")
            yield from _check_rows(connection, table, column)


def _check_rows(connection: sqlite3.Connection, table: str, column: str) -> Iterator[Finding]:
    table_sql, column_sql = (name.replace('"', '""') for name in (table, column))
    (empty,) = connection.execute(
        f'SELECT count(*) FROM "{table_sql}" WHERE "{column_sql}" IS NULL'  # noqa: S608
    ).fetchone()
    if empty:
        yield Finding("warning", table, f"{counted(empty, 'row has', 'rows have')} no geometry")
