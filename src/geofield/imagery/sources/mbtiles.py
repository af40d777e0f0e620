"""MBTiles: a whole pyramid of tiles in one SQLite file."""

from __future__ import annotations

import io
import math
import sqlite3
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

from PIL import Image, UnidentifiedImageError

from geofield.errors import ImageryError, MissingFileError
from geofield.imagery.client import BrokenBodyError
from geofield.imagery.terms import Terms
from geofield.imagery.tiling import Tile, TilePyramid
from geofield.strangers import database

_BUSY_S = 30.0


@dataclass(frozen=True, slots=True)
class MBTilesSource:
    """Tiles of a file here; a picklable value, the file is opened for each tile."""

    #: Side of the largest picture that it gives, pixels.
    most_px: ClassVar[float] = math.inf
    name: str
    path: str
    terms: Terms
    pyramid: TilePyramid
    date: str | None = None

    @classmethod
    def open(cls, path: str | Path, terms: Terms | None = None) -> MBTilesSource:
        """Look at an MBTiles file; its metadata say who made it where the terms do not."""
        file = Path(path)
        if not file.is_file():
            raise MissingFileError(f"There is no file {path}.", hint="Check the path.")
        try:
            with database(file, timeout_s=_BUSY_S) as db:
                words = dict(db.execute("SELECT name, value FROM metadata").fetchall())
                low, high = db.execute(
                    "SELECT MIN(zoom_level), MAX(zoom_level) FROM tiles"
                ).fetchone()
                sample = db.execute("SELECT tile_data FROM tiles LIMIT 1").fetchone()
        except sqlite3.DatabaseError as error:
            raise ImageryError(
                f"{file.name} is not an MBTiles file: {error}.", hint="Give raster MBTiles."
            ) from None
        if low is None or sample is None:
            raise ImageryError(f"The MBTiles file {file.name} holds no tiles.")
        if words.get("format") in ("pbf", "mvt"):
            raise ImageryError(f"{file.name} holds vector tiles.", hint="Give MBTiles of pictures.")
        try:
            with Image.open(io.BytesIO(sample[0])) as image:
                tile_px = image.width
        except UnidentifiedImageError:
            raise ImageryError(f"The tiles in {file.name} are not pictures.") from None
        known = terms or Terms(may_cache=True)
        credit = known.attribution or words.get("attribution", "")
        known = replace(
            known, attribution=credit, licence=known.licence or words.get("licence", "")
        )
        pyramid = TilePyramid.web_mercator(int(low), int(high), tile_px)
        return cls(words.get("name") or file.name, str(file), known, pyramid)

    def read(self, tile: Tile) -> bytes | None:
        """The bytes of a tile, or None; `BrokenBodyError` where the file is damaged."""
        row = 2**tile.zoom - 1 - tile.row
        try:
            with database(Path(self.path), timeout_s=_BUSY_S) as db:
                found = db.execute(
                    "SELECT tile_data FROM tiles WHERE zoom_level = ? AND tile_column = ? "
                    "AND tile_row = ?",
                    (tile.zoom, tile.column, row),
                ).fetchone()
        except sqlite3.DatabaseError as error:
            raise BrokenBodyError(f"the file is damaged there: {error}") from None
        return None if found is None else bytes(found[0])
