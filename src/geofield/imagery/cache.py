"""The tile cache: one MBTiles file per source, which QGIS and GDAL open as a layer.

Several processes may use one file at once (SQLite's locks, short transactions). A damaged
file is set aside and a new one begun.
"""

from __future__ import annotations

import hashlib
import math
import re
import sqlite3
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from geofield.errors import ImageryError, ImageryWarning
from geofield.notes import warn
from geofield.strangers import database

if TYPE_CHECKING:
    from geofield.imagery.sources.base import TileSource

T = TypeVar("T")

_SCHEMA = """
PRAGMA auto_vacuum = INCREMENTAL;
CREATE TABLE IF NOT EXISTS metadata (name TEXT PRIMARY KEY, value TEXT);
CREATE TABLE IF NOT EXISTS tiles (
    zoom_level INTEGER NOT NULL, tile_column INTEGER NOT NULL, tile_row INTEGER NOT NULL,
    tile_data BLOB NOT NULL, PRIMARY KEY (zoom_level, tile_column, tile_row));
CREATE TABLE IF NOT EXISTS fetched (
    zoom_level INTEGER NOT NULL, tile_column INTEGER NOT NULL, tile_row INTEGER NOT NULL,
    time_s INTEGER NOT NULL, bytes INTEGER NOT NULL,
    PRIMARY KEY (zoom_level, tile_column, tile_row)) WITHOUT ROWID;
"""
_BUSY_S = 60.0


@dataclass(frozen=True, slots=True)
class CacheInfo:
    """What a cache file holds."""

    path: Path
    source: str
    attribution: str
    tiles: int
    bytes: int
    zooms: tuple[int, int] | None
    oldest_s: int | None
    newest_s: int | None


class TileCache:
    """Tiles of one source on disk, in a folder that is made when missing.

    The oldest tiles go when there are more than `max_bytes` of tiles; those older than `max_age_s`
    are fetched again.
    """

    def __init__(
        self,
        folder: Path,
        source: TileSource,
        *,
        max_bytes: int | None = None,
        max_age_s: float | None = None,
    ) -> None:
        slug = re.sub(r"[^a-z0-9]+", "-", source.name.lower()).strip("-")[:40] or "source"
        differs = hashlib.sha256(source.identity.encode()).hexdigest()[:10]
        self.path = folder / f"{slug}-{differs}.mbtiles"
        self._pyramid = source.pyramid
        self._max_bytes = max_bytes
        self._max_age_s = max_age_s
        self._metadata = {
            "name": source.name,
            "type": "baselayer",
            "version": "1.3",
            "description": f"Tiles of {source.name}, kept by geofield",
            "attribution": source.terms.attribution,
            "licence": source.terms.licence,
        }
        if not source.pyramid.levels[0].wraps:
            # Tiles that are not Web Mercator's: only geofield reads those.
            self._metadata["crs"] = source.pyramid.crs.to_wkt()
        self._connection: sqlite3.Connection | None = None
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ImageryError(
                f"The cache folder {self.path.parent} cannot be made: {error.strerror}.",
                hint="Choose another with --cache-dir, or use --no-cache.",
            ) from None
        self._guarded(lambda db: None)

    def close(self) -> None:
        """Close the file."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def get_row(
        self, zoom: int, row: int, columns: Iterable[int], *, stale: bool = False
    ) -> dict[int, tuple[bytes, int]]:
        """The tiles of one row that are kept and fresh, or of any age (`stale`), by column.

        Each as its bytes and when it was fetched, seconds since 1970.
        """
        wanted = set(columns)
        if not wanted:
            return {}
        since = 0.0
        if self._max_age_s is not None and not stale:
            since = time.time() - self._max_age_s
        values = (*self._place(zoom, row), min(wanted), max(wanted), since)
        found = self._guarded(
            lambda db: db.execute(
                "SELECT t.tile_column, t.tile_data, COALESCE(f.time_s, 0) FROM tiles t "
                "LEFT JOIN fetched f USING (zoom_level, tile_column, tile_row) "
                "WHERE t.zoom_level = ? AND t.tile_row = ? AND t.tile_column BETWEEN ? AND ? "
                "AND COALESCE(f.time_s, 0) >= ?",
                values,
            ).fetchall()
        )
        return {column: (body, time_s) for column, body, time_s in found if column in wanted}

    def put(self, tiles: Iterable[tuple[int, int, int, bytes]]) -> None:
        """Keep tiles (zoom, column, row, bytes) in one transaction."""
        now = int(time.time())
        kept = []
        for zoom, column, row, body in tiles:
            kept_zoom, kept_row = self._place(zoom, row)
            kept.append((kept_zoom, column, kept_row, body))
        if not kept:
            return

        def insert(db: sqlite3.Connection) -> None:
            db.executemany("INSERT OR REPLACE INTO tiles VALUES (?, ?, ?, ?)", kept)
            db.executemany(
                "INSERT OR REPLACE INTO fetched VALUES (?, ?, ?, ?, ?)",
                [(z, c, r, now, len(body)) for z, c, r, body in kept],
            )
            form = _format(kept[0][3])
            db.execute("INSERT OR IGNORE INTO metadata VALUES ('format', ?)", (form,))
            # Readers trust these: they must tell what is here, not what the source has.
            db.execute(
                "INSERT OR REPLACE INTO metadata SELECT 'minzoom', MIN(zoom_level) FROM tiles "
                "UNION SELECT 'maxzoom', MAX(zoom_level) FROM tiles"
            )

        self._guarded(insert)

    def note_bounds(self) -> None:
        """Write the ground covered into the metadata: QGIS zooms to it."""

        def note(db: sqlite3.Connection) -> None:
            zoom, west, east, south, north = db.execute(
                "SELECT MAX(zoom_level), MIN(tile_column), MAX(tile_column) + 1, MIN(tile_row), "
                "MAX(tile_row) + 1 FROM tiles "
                "WHERE zoom_level = (SELECT MAX(zoom_level) FROM tiles)"
            ).fetchone()
            if zoom is None:
                return
            world = 2.0**zoom
            lons = [column / world * 360.0 - 180.0 for column in (west, east)]
            lats = [
                math.degrees(math.atan(math.sinh(math.pi * (2.0 * row / world - 1.0))))
                for row in (south, north)
            ]
            bounds = f"{lons[0]:.7f},{lats[0]:.7f},{lons[1]:.7f},{lats[1]:.7f}"
            db.execute("INSERT OR REPLACE INTO metadata VALUES ('bounds', ?)", (bounds,))

        if "crs" not in self._metadata:
            self._guarded(note)

    def trim(self) -> None:
        """Remove the oldest tiles until the size limit holds."""
        limit = self._max_bytes
        if limit is None:
            return

        def shrink(db: sqlite3.Connection) -> bool:
            gone = db.execute(
                "SELECT zoom_level, tile_column, tile_row FROM (SELECT *, SUM(bytes) OVER "
                "(ORDER BY time_s DESC ROWS UNBOUNDED PRECEDING) AS with_newer FROM fetched) "
                "WHERE with_newer > ?",
                (limit,),
            ).fetchall()
            where = "WHERE zoom_level = ? AND tile_column = ? AND tile_row = ?"
            db.executemany(f"DELETE FROM tiles {where}", gone)  # noqa: S608
            db.executemany(f"DELETE FROM fetched {where}", gone)  # noqa: S608
            return bool(gone)

        if self._guarded(shrink):
            self._guarded(lambda db: db.execute("PRAGMA incremental_vacuum").fetchall())

    # -- inside ----------------------------------------------------------------------------

    def _place(self, zoom: int, row: int) -> tuple[int, int]:
        """Zoom and row as MBTiles counts them."""
        level = self._pyramid.level(zoom)
        return level.scheme_zoom, level.rows - 1 - row

    def _connected(self) -> sqlite3.Connection:
        connection = sqlite3.connect(self.path, timeout=_BUSY_S, isolation_level="IMMEDIATE")
        try:
            connection.execute("PRAGMA synchronous = NORMAL")
            connection.executescript(_SCHEMA)
            with connection:
                connection.executemany(
                    "INSERT OR IGNORE INTO metadata VALUES (?, ?)", self._metadata.items()
                )
        except sqlite3.Error:
            connection.close()
            raise
        return connection

    def _guarded(self, work: Callable[[sqlite3.Connection], T]) -> T:
        """Do the work in one transaction, with a new file where this one is damaged."""
        try:
            return self._done(work)
        except sqlite3.DatabaseError as error:
            if not _is_damage(error):
                raise ImageryError(
                    f"The tile cache {self.path} cannot be used: {error}.",
                    hint="Check free space and rights there, choose another with --cache-dir, or "
                    "--no-cache.",
                ) from None
            self.close()
            self._set_aside()
            return self._done(work)

    def _done(self, work: Callable[[sqlite3.Connection], T]) -> T:
        if self._connection is None:
            self._connection = self._connected()
        with self._connection as connection:
            return work(connection)

    def _set_aside(self) -> None:
        number = 1
        while (aside := self.path.with_suffix(f".damaged-{number}")).exists():
            number += 1
        if self.path.exists():
            self.path.replace(aside)
        for ending in ("-journal", "-wal", "-shm"):
            Path(f"{self.path}{ending}").unlink(missing_ok=True)
        warn(
            f"The tile cache {self.path.name} was damaged. It is set aside as {aside.name} and a "
            "new one begun; you may delete the old one.",
            ImageryWarning,
        )


def cache_infos(folder: Path) -> list[CacheInfo]:
    """What each cache file of a folder holds."""
    return [_info(path) for path in sorted(folder.glob("*.mbtiles"))] if folder.is_dir() else []


def clear_cache(folder: Path, source: str | None = None) -> list[Path]:
    """Delete the cache files of a source, or all of them; which ones went."""
    gone = []
    for info in cache_infos(folder):
        if source is None or source in (info.source, info.path.stem, info.path.name):
            info.path.unlink(missing_ok=True)
            gone.append(info.path)
    if source is None and folder.is_dir():
        for path in folder.glob("*.damaged-*"):
            path.unlink(missing_ok=True)
            gone.append(path)
    return gone


def _info(path: Path) -> CacheInfo:
    try:
        with database(path, timeout_s=_BUSY_S) as db:
            words = dict(db.execute("SELECT name, value FROM metadata").fetchall())
            count, size, oldest, newest, low, high = db.execute(
                "SELECT COUNT(*), COALESCE(SUM(bytes), 0), MIN(time_s), MAX(time_s), "
                "MIN(zoom_level), MAX(zoom_level) FROM fetched"
            ).fetchone()
    except sqlite3.Error:
        said, size = "(damaged or not a tile cache)", path.stat().st_size
        return CacheInfo(path, said, "", 0, size, None, None, None)
    name, attribution = words.get("name", ""), words.get("attribution", "")
    zooms = None if low is None else (int(low), int(high))
    return CacheInfo(path, name, attribution, count, size, zooms, oldest, newest)


def _format(body: bytes) -> str:
    if body.startswith(b"\x89PNG"):
        return "png"
    if body[8:12] == b"WEBP":
        return "webp"
    return "jpg"


def _is_damage(error: sqlite3.DatabaseError) -> bool:
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF
    return code in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB) or "no such table" in str(error)
