"""Reading products and other people's files."""

from __future__ import annotations

from pathlib import Path

from pyproj import CRS

from geofield.crs import parse_crs
from geofield.errors import FormatError
from geofield.formats.registry import detect
from geofield.model import Dataset


def read_dataset(path: Path | str, *, crs: CRS | str | None = None) -> Dataset:
    """The dataset in a file or folder, in its metric CRS.

    Parameters
    ----------
    path : Path
        Of any format with a reader, recognised by suffix and content.
    crs : CRS or str, optional
        Of the coordinates, for files that do not say it (a Shapefile without ``.prj``).

    Raises
    ------
    FormatError
        When the file is not there, not known or damaged, or its CRS is in doubt.
    """
    place = Path(path)
    found = detect(place)
    reader = found.load_reader()
    if crs is None:
        return reader(place)
    if not found.asks_crs:
        raise FormatError(f"{found.title} files say their CRS themselves.", hint="Leave out --crs.")
    return reader(place, crs=parse_crs(crs))
