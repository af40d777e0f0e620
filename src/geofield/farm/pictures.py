"""The user's own pictures of a farm: where they are, and whether places lie in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapely

from geofield.crs import LONLAT, reproject
from geofield.errors import ImageryError, ImageryWarning
from geofield.farm.folder import Record
from geofield.farm.places import Places
from geofield.farm.store import Store
from geofield.grid import Grid
from geofield.imagery import pictures_digest
from geofield.notes import warn
from geofield.settings import Settings
from geofield.windows import grid_of
from geofield.wording import none_of


def refuse_elsewhere(path: Path, places: Places, settings: Settings) -> None:
    """Refuse pictures that show none of the places, before the first of them.

    Single places outside fail by themselves; all of them outside is a slip.

    Raises
    ------
    ImageryError
        Saying whether latitude and longitude look swapped.
    """
    if path.is_dir() or path.suffix.lower() not in (".tif", ".tiff", ".vrt", ".jp2", ".img"):
        return  # many pictures: each place looks for its own
    lat, lon = places.lat[places.known], places.lon[places.known]
    grid = grid_of(path, settings)
    if _inside(grid, lat, lon).any() or _shows_outlines(grid, places):
        return
    swapped = np.abs(lon) <= 90
    hint = "Check the CRS of both."
    if swapped.any() and _inside(grid, lon[swapped], lat[swapped]).any():
        hint = "With latitude and longitude swapped they are inside: exchange the columns."
    raise ImageryError(
        f"{none_of(len(places), 'place')} of {Path(places.path).name} lies in {path.name}.",
        hint=hint,
    )


def _shows_outlines(grid: Grid, places: Places) -> bool:
    """Whether a picture shows ground of a parcel, be its middle elsewhere."""
    if places.outlines is None:
        return False
    shapes = shapely.from_wkb(places.outlines.to_numpy(zero_copy_only=False))
    frame = shapely.Polygon(grid.corners_lonlat())
    return bool(shapely.intersects(reproject(shapes, places.crs, LONLAT), frame).any())


def _inside(grid: Grid, lat: np.ndarray, lon: np.ndarray) -> np.ndarray:
    x, y = grid.from_lonlat(lon, lat)
    return np.asarray((x >= 0) & (y >= 0) & (x <= grid.width_px) & (y <= grid.height_px))


def pictures_of(folder: Path) -> Path | None:
    """The pictures that the farm was planned on, beside it or in the current folder.

    Warns
    -----
    ImageryWarning
        Of others that are called the same, where those are not there.
    """
    record = Record.read(Store.of(folder)) or Record()
    name, digest = (str(record.imagery.get(key, "")) for key in ("imagery", "imagery_digest"))
    places = (folder.parent / name, Path(name)) if name else ()
    there = [place for place in places if place.exists()]
    for place in there:
        if not digest or _shows(place, digest):
            return place
    if there:
        warn(
            f"{there[0]} is not what the farm was planned on, though it is called the same: it is "
            "not shown. Put its picture there, or have it planned on this one: geofield batch ... "
            "--fresh.",
            ImageryWarning,
        )
    return None


def _shows(path: Path, digest: str) -> bool:
    """Whether a picture shows what another did; not known of a set, nor of one that is damaged."""
    try:
        return pictures_digest(path) in ("", digest)
    except ImageryError:
        return True
