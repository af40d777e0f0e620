"""What a person keeps in a plan's GeoPackage beside the plan: layers, tables, styles, projects.

A plan is written as a new file. What in the file before it is not geofield's comes along as it
was, row for row and byte for byte.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path

from geofield import schema
from geofield.errors import FormatError, FormatWarning
from geofield.formats import origin
from geofield.formats.gpkg_read import own_layers
from geofield.formats.qgis.as_written import is_as_written, is_project_as_written
from geofield.notes import warn
from geofield.staging.generations import keep_earlier
from geofield.strangers import for_reading

#: Of QGIS: their rows are brought one by one.
_OF_QGIS = {"layer_styles", "qgis_projects"}
#: Tables of the standard and of GDAL in which a layer has rows, by its `table_name`.
_REGISTERS = (
    "gpkg_contents",
    "gpkg_geometry_columns",
    "gpkg_extensions",
    "gpkg_ogr_contents",
    "gpkg_data_columns",
)


def replace_plan(there: Path, new: Path) -> None:
    """Prepare that `new`, in a staging folder, takes the place of the plan's file that is there.

    That one stays beside it as the earlier one; what a person keeps in it comes along, and so does
    the project beside it that a person saved. Errors and warnings are those of
    :func:`bring_guests` and :func:`keep_project`.
    """
    earlier = keep_earlier(there, new.parent)
    if earlier is not None:
        bring_guests(earlier, new)
    keep_project(there.with_suffix(".qgz"), new.with_suffix(".qgz"))


def bring_guests(earlier: Path, plan_file: Path, *, further: bool = False) -> None:
    """Copy what is not geofield's from an earlier plan's file into the new one.

    Layers with features or attributes alone come with their reference system, index and triggers;
    plain tables and views as they are; styles and projects where the new file has none of the
    name, or a person saved theirs over geofield's; metadata of all layers that are there. A style
    that a person made the default of a layer stays so. Files that are no plan bring nothing. Into
    a file that a person edited, too, comes what that has nothing of (`further`).

    Raises
    ------
    FormatError
        With the names of what cannot come along.
    """
    with closing(sqlite3.connect(plan_file, isolation_level=None, uri=True)) as connection:
        connection.execute("PRAGMA synchronous = OFF")
        connection.execute("ATTACH ? AS old", (for_reading(earlier),))
        try:
            kinds = dict(connection.execute("SELECT table_name, data_type FROM old.gpkg_contents"))
        except sqlite3.DatabaseError:
            return  # not a GeoPackage
        if schema.FIELD.name not in kinds:
            return
        ours = own_layers(connection, "old") | _OF_QGIS
        if further:
            ours |= {name for name in kinds if _has(connection, "main", name)}
        left = _bring_tables(connection, kinds, ours)
        _bring_styles(connection)
        _bring_projects(connection)
        _bring_metadata(connection)
    if left:
        raise FormatError(
            f"{', '.join(left)} cannot be taken along from the {plan_file.name} that is there: "
            "nothing was written.",
            hint="Export it into a file of its own (or give it another name, where the plan has a "
            "layer of that name now), delete it there, and repeat.",
        )


def _bring_tables(
    connection: sqlite3.Connection, kinds: Mapping[str, str], ours: set[str]
) -> list[str]:
    """All layers, tables and views but ours; the names of those that cannot come."""
    plain = connection.execute(
        "SELECT name FROM old.sqlite_master WHERE type IN ('table', 'view') "
        "AND name NOT IN (SELECT name FROM main.sqlite_master) "
        "AND NOT (name GLOB 'gpkg_*' OR name GLOB 'rtree_*' OR name GLOB 'sqlite_*')"
    ).fetchall()
    left = []
    for name in sorted({*kinds, *(name for (name,) in plain)} - ours):
        if name not in kinds and _has(connection, "main", name):
            continue  # came with another one, as what a text index keeps
        connection.execute("BEGIN")
        try:
            _bring_layer(connection, name, kinds.get(name, "attributes"))
            connection.execute("COMMIT")
        except sqlite3.DatabaseError:
            connection.execute("ROLLBACK")
            left.append(name)
    return left


def keep_project(there: Path, new: Path) -> None:
    """Leave the project beside a plan as a person saved it; its layers are those of the plan.

    Warns
    -----
    FormatWarning
        That `new`, a staged one, does not take its place.
    """
    if not (new.is_file() and there.is_file()) or is_project_as_written(there.read_bytes()):
        return
    new.unlink()
    warn(
        f"{there.name} is as it was saved in QGIS: it stays, and shows the plan as it is now. To "
        "have that of geofield anew, rename yours and repeat.",
        FormatWarning,
    )


def _bring_layer(connection: sqlite3.Connection, name: str, kind: str) -> None:
    """One layer with all that belongs to it; an error of SQLite's where that cannot be."""
    if kind not in ("features", "attributes"):
        raise sqlite3.DatabaseError(f"{kind} of {name}")
    _bring_system(connection, name)
    _create(connection, "type IN ('table', 'view') AND name = ?", name)
    if not _has(connection, "old", name, "view"):
        _fill(connection, name)
    for index in _indexes(connection, name):
        _create(connection, "type = 'table' AND name = ?", index)
        _fill(connection, index)
    _create(connection, "type IN ('index', 'trigger') AND tbl_name = ?", name)
    for register in _REGISTERS:
        if _has(connection, "old", register) and _has(connection, "main", register):
            # Triggers may have counted the rows already.
            connection.execute(f'DELETE FROM main."{register}" WHERE table_name = ?', (name,))  # noqa: S608
            _fill(connection, register, "WHERE table_name = ?", name)


def _bring_system(connection: sqlite3.Connection, name: str) -> None:
    """The layer's reference system, where the new file lacks it."""
    query = (
        "SELECT upper(organization), organization_coordsys_id, definition "
        "FROM {}.gpkg_spatial_ref_sys WHERE srs_id = ?"
    )
    for (number,) in connection.execute(
        "SELECT srs_id FROM old.gpkg_contents WHERE table_name = ? AND srs_id IS NOT NULL", (name,)
    ).fetchall():
        old, new = (
            connection.execute(query.format(of), (number,)).fetchone() for of in ("old", "main")
        )
        if new is None:
            _fill(connection, "gpkg_spatial_ref_sys", "WHERE srs_id = ?", number)
        elif old[:2] != new[:2] or (old[0] not in ("EPSG", "NONE") and old != new):
            raise sqlite3.DatabaseError(f"another reference system has the number {number}")


def _indexes(connection: sqlite3.Connection, name: str) -> Iterator[str]:
    """The spatial indexes of a layer."""
    for (column,) in connection.execute(
        "SELECT column_name FROM old.gpkg_geometry_columns WHERE table_name = ?", (name,)
    ).fetchall():
        if _has(connection, "old", f"rtree_{name}_{column}"):
            yield f"rtree_{name}_{column}"


def _bring_styles(connection: sqlite3.Connection) -> None:
    """Styles that geofield did not write; a default one makes the one here none."""
    if not _has(connection, "old", "layer_styles"):
        return
    connection.create_function("as_written", 1, is_as_written, deterministic=True)
    key = "coalesce(f_table_name, '') || '/' || styleName"
    mine = f"WHERE {key} NOT IN (SELECT {key} FROM main.layer_styles)"  # noqa: S608
    mine += " AND f_table_name IN (SELECT table_name FROM main.gpkg_contents)"
    connection.execute("BEGIN")
    connection.execute(
        f"DELETE FROM main.layer_styles WHERE as_written(styleQML) AND {key} IN "  # noqa: S608
        f"(SELECT {key} FROM old.layer_styles WHERE NOT as_written(styleQML))"
    )
    connection.execute(
        "UPDATE main.layer_styles SET useAsDefault = 0 WHERE f_table_name IN "  # noqa: S608
        f"(SELECT f_table_name FROM old.layer_styles {mine} AND useAsDefault)"
    )
    _fill(connection, "layer_styles", mine, without="id")
    connection.execute("COMMIT")


def _bring_projects(connection: sqlite3.Connection) -> None:
    if not _has(connection, "old", "qgis_projects"):
        return
    for name, old, new in connection.execute(
        "SELECT name, old.content, main.content "
        "FROM old.qgis_projects AS old JOIN main.qgis_projects AS main USING (name)"
    ).fetchall():
        if _is_own_project(new) and not _is_own_project(old):
            connection.execute("DELETE FROM main.qgis_projects WHERE name = ?", (name,))
    new = "(SELECT name FROM main.qgis_projects)"
    _fill(connection, "qgis_projects", f"WHERE name NOT IN {new}")


def _bring_metadata(connection: sqlite3.Connection) -> None:
    """What a person noted of the file, or of layers that are there, under new numbers."""
    if not _has(connection, "old", "gpkg_metadata_reference"):
        return
    numbers: dict[int, int] = {}
    for number, *row in connection.execute(
        "SELECT id, md_scope, md_standard_uri, mime_type, metadata FROM old.gpkg_metadata AS told "
        # GDAL puts all other rows into one of its own, when it writes.
        "WHERE md_standard_uri <> ? AND metadata NOT LIKE '%\"GPKG_METADATA_ITEM_%' "
        "AND EXISTS (SELECT 1 FROM old.gpkg_metadata_reference "
        "WHERE md_file_id = told.id AND (table_name IS NULL OR table_name IN "
        "(SELECT table_name FROM main.gpkg_contents))) ORDER BY id",
        (origin.URI,),
    ).fetchall():
        numbers[number] = (
            connection.execute(
                "INSERT INTO main.gpkg_metadata (md_scope, md_standard_uri, mime_type, metadata) "
                "VALUES (?, ?, ?, ?)",
                row,
            ).lastrowid
            or 0
        )
    for *row, number, parent in connection.execute(
        "SELECT reference_scope, table_name, column_name, row_id_value, timestamp, md_file_id, "
        "md_parent_id FROM old.gpkg_metadata_reference WHERE table_name IS NULL OR table_name IN "
        "(SELECT table_name FROM main.gpkg_contents)"
    ).fetchall():
        if number in numbers:
            connection.execute(
                "INSERT INTO main.gpkg_metadata_reference VALUES (?, ?, ?, ?, ?, ?, ?)",
                (*row, numbers[number], numbers.get(parent)),
            )


def _is_own_project(content: bytes | str | None) -> bool:
    """Whether geofield wrote a project in a GeoPackage: the hexadecimal text of a ``.qgz``."""
    text = content.decode("latin-1") if isinstance(content, bytes) else content or ""
    try:
        return is_project_as_written(bytes.fromhex(text))
    except ValueError:
        return False


def _create(connection: sqlite3.Connection, which: str, name: str) -> None:
    """Make anew what the earlier file's schema says."""
    for (text,) in connection.execute(
        f"SELECT sql FROM old.sqlite_master WHERE {which} AND sql IS NOT NULL ORDER BY rowid",  # noqa: S608
        (name,),
    ).fetchall():
        connection.execute(text)


def _fill(
    connection: sqlite3.Connection, table: str, where: str = "", *values: object, without: str = ""
) -> None:
    """Copy rows, the columns that both files' tables have."""
    one, other = (
        [row[1] for row in connection.execute(f"PRAGMA {of}.table_info({_quoted(table)})")]
        for of in ("main", "old")
    )
    columns = ", ".join(_quoted(name) for name in one if name in other and name != without)
    connection.execute(
        f"INSERT INTO main.{_quoted(table)} ({columns}) "  # noqa: S608
        f"SELECT {columns} FROM old.{_quoted(table)} {where}",
        values,
    )


def _has(connection: sqlite3.Connection, of: str, name: str, *kinds: str) -> bool:
    query = f"SELECT type FROM {of}.sqlite_master WHERE type IN ('table', 'view') AND name = ?"  # noqa: S608
    found = connection.execute(query, (name,)).fetchone()
    return found is not None and found[0] in (kinds or ("table", "view"))


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'
