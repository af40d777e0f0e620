"""The user's own pictures of a farm: whether places lie in them at all."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geofield.errors import ImageryError
from geofield.farm.places import Places
from geofield.grid import Grid
from geofield.settings import Settings


def refuse_elsewhere(path: Path, places: Places, settings: Settings) -> None:
    """Refuse pictures that show none of the places, before the first of them.

    Single places outside fail by themselves; all of them outside is a slip.

    Raises
    ------
    ImageryError
        Saying whether latitude and longitude look swapped.
    """
    from geofield.imagery import open_reader

    if path.is_dir() or path.suffix.lower() not in (".tif", ".tiff", ".vrt", ".jp2", ".img"):
        return  # many pictures: each place looks for its own
    known = np.isfinite(places.lat) & np.isfinite(places.lon)
    lat, lon = places.lat[known], places.lon[known]
    imagery = settings.imagery
    grid = open_reader(
        str(path), bands=imagery.bands, crs=imagery.crs, allow=settings.fetch.allow
    ).grid
    if _inside(grid, lat, lon).any():
        return
    swapped = np.abs(lon) <= 90
    hint = "Check the CRS of both."
    if swapped.any() and _inside(grid, lon[swapped], lat[swapped]).any():
        hint = "With latitude and longitude swapped they are inside: exchange the columns."
    raise ImageryError(
        f"None of the {len(places)} places of {Path(places.path).name} lies in {path.name}.",
        hint=hint,
    )


def _inside(grid: Grid, lat: np.ndarray, lon: np.ndarray) -> np.ndarray:
    x, y = grid.from_lonlat(lon, lat)
    return np.asarray((x >= 0) & (y >= 0) & (x <= grid.width_px) & (y <= grid.height_px))
