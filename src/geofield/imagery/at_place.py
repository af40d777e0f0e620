"""The picture of one place, fetched from its source for the moment."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from geofield.imagery.acquisition import Acquired, Where, acquire
from geofield.imagery.opening import FetchOptions
from geofield.imagery.place_picture import PlacePicture
from geofield.imagery.reader import MAX_SIDE_PX
from geofield.imagery.sources import PictureSource, Source

#: Pixels on a side where no size was asked for.
_SIDE_PX = 1024


@contextmanager
def picture_at(
    source: Source,
    *,
    lat: float,
    lon: float,
    size_m: float | None = None,
    bands: Sequence[str] | None = None,
    options: FetchOptions,
    progress: Callable[[int, int, str], None] | None = None,
) -> Iterator[PlacePicture]:
    """A source's picture around a place, and more of it where that is needed.

    Parameters
    ----------
    source : Source
        Its terms were checked.
    lat, lon : float
        Degrees, WGS 84.
    size_m : float, optional
        Side of the square on the ground.
    bands : sequence of str, optional
        What the bands show, by the user's word.
    options : FetchOptions
    progress : callable, optional

    Yields
    ------
    PlacePicture
        The source's own file or address, or files that are gone behind the block.
    """
    if isinstance(source, PictureSource) and (
        bands or source.terms.attribution + source.terms.licence == ""
    ):
        yield PlacePicture(source.path)
        return
    # What the settings say of a picture's terms must travel with it: as a file that says so.
    own = isinstance(source, PictureSource)
    most_px = source.most_px if own else min(source.most_px, MAX_SIDE_PX)
    first_px = None if own else int(min(_SIDE_PX, most_px))
    with tempfile.TemporaryDirectory(prefix="geofield-") as folder:

        def fetch(size_m: float | None) -> Acquired:
            path = Path(folder) / f"scene_{size_m or 0:.0f}.tif"
            where = Where(lat=lat, lon=lon, size_m=size_m, size_px=None if size_m else first_px)
            return acquire(source, where, path, options=options, progress=progress)

        first = fetch(size_m)
        most_m = (most_px + 0.5) * first.grid.ground_resolution_m
        yield PlacePicture(str(first.path), most_px < source.most_px, fetch, most_m)
