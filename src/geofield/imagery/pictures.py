"""Opening whatever the user names as picture: file, address, folder, index or STAC file."""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from geofield.errors import ImageryError
from geofield.imagery.collection import open_collection
from geofield.imagery.facts import sampled
from geofield.imagery.gdal import display_name, gdal_env, is_remote, open_picture, reading
from geofield.imagery.opening import OpenOptions
from geofield.imagery.reach import Reach
from geofield.imagery.reader import SceneReader
from geofield.imagery.stac import is_stac, open_stac
from geofield.imagery.tags import source_from_tags
from geofield.strangers import PICTURES, check_vector, database

_PICTURES = frozenset({".tif", ".tiff", ".vrt", ".jp2", ".img", ".png", ".jpg", ".jpeg", ".webp"})
_INDEXES = frozenset({".gpkg", ".shp", ".fgb", ".geojson"})


def open_reader(path: str, *, allow: Sequence[str] = (), **known: Any) -> SceneReader:
    """A reader of any picture or set of pictures.

    Parameters
    ----------
    path : str
        A file, folder, tile index or STAC file, or an address.
    allow : sequence of str
        Files, folders and addresses that VRTs, indexes and STAC files may lead to besides
        their own folder.
    **known
        What is known of the picture: `lat`, `lon`, `bands`, `crs`, `scaling` and `source` of
        `OpenOptions`.

    Raises
    ------
    ImageryError
    """
    options = OpenOptions(**known, reach=Reach(tuple(allow)))
    if is_remote(path) and not path.lower().partition("?")[0].endswith((".json", ".geojson")):
        return SceneReader.open(path, options)
    file = Path(path)
    if _is_stac(file):
        return open_stac(file, options)
    several = _several(file, options.reach)
    if several:
        return open_collection(several, options, name=file.name)
    return SceneReader.open(path, options)


def pictures_digest(path: Path, *, allow: Sequence[str] = ()) -> str:
    """A fingerprint of what the user's own picture shows, and where; none of a set of them.

    It stays where the file is moved, packed anew or given overviews. To a set others may come: of
    fields that none showed.

    Raises
    ------
    ImageryError
        When the picture cannot be opened.
    """
    reach = Reach(tuple(allow))
    if _is_stac(path) or _several(path, reach):
        return ""
    name = str(path)
    with gdal_env(name), open_picture(name, reach.of(name)) as dataset:
        date = source_from_tags(dataset.tags(), name).date
        about = repr((dataset.shape, dataset.dtypes, tuple(dataset.transform), date)).encode()
        with suppress(ImageryError), reading(name):  # damage is told where it lies
            about += sampled(dataset, list(dataset.indexes)).tobytes()
    return hashlib.sha256(about).hexdigest()


def _is_stac(file: Path) -> bool:
    return file.suffix.lower() in (".json", ".geojson") and file.is_file() and is_stac(file)


def _several(file: Path, reach: Reach) -> list[str]:
    """The pictures of a folder or a tile index; empty for what is a picture itself."""
    if file.is_dir():
        return pictures_in(file)
    if file.suffix.lower() in _INDEXES and file.is_file() and not is_picture(file):
        located = pictures_of_index(file)
        for each in located:
            reach.of(file).require(each, file.name)
        return located
    return []


def pictures_in(folder: Path) -> list[str]:
    """The pictures of a folder and its sub-folders, in the order of their names."""
    found = sorted(
        str(file)
        for file in folder.rglob("*")
        if file.suffix.lower() in _PICTURES and file.is_file() and not file.name.startswith(".")
    )
    if not found:
        raise ImageryError(
            f"The folder {folder} holds no picture.",
            hint="Give a folder with GeoTIFF, VRT or JPEG 2000 files.",
        )
    return found


def is_picture(file: Path) -> bool:
    """Whether a file is a picture, whatever it is called; so are GeoPackages with tiles."""
    if file.is_file():
        with file.open("rb") as stream:
            if stream.read(16).startswith(PICTURES):
                return True
    if file.suffix.lower() != ".gpkg":
        return False
    asked = "SELECT 1 FROM gpkg_contents WHERE data_type IN ('tiles', '2d-gridded-coverage')"
    try:
        with database(file) as db:
            return db.execute(asked).fetchone() is not None
    except sqlite3.DatabaseError:
        return False


def pictures_of_index(index: Path) -> list[str]:
    """The pictures that a tile index (`gdaltindex`) lists; empty for other vector files."""
    check_vector(index)
    try:
        import fiona
        from fiona.errors import FionaError
    except ImportError as error:
        raise ImageryError(
            f"{display_name(index)} is read by fiona, which is not there for this Python.",
            hint="Name the folder of the pictures, or make a VRT of them: gdalbuildvrt.",
        ) from error
    try:
        with fiona.open(index, ignore_geometry=True) as table:
            names = {name.lower(): name for name in table.schema["properties"]}
            column = names.get("location") or names.get("path")
            if column is None:
                return []
            rows = [str(row["properties"][column]) for row in table]
    except (FionaError, ValueError) as error:  # the latter of a file that was cut off
        why = str(error).partition(": <")[0]
        raise ImageryError(
            f"The index {display_name(index)} cannot be read: {why}.", hint="Is the file whole?"
        ) from None
    return [
        row if is_remote(row) or Path(row).is_absolute() else str(index.parent / row)
        for row in rows
    ]
