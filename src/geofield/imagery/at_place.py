"""The picture of one place as a path: the user's own, or one fetched for the moment."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from geofield.errors import GeofieldError, ImageryWarning
from geofield.imagery.acquisition import Acquired, Where, acquire
from geofield.imagery.opening import FetchOptions
from geofield.imagery.reader import MAX_SIDE_PX
from geofield.imagery.sources import PictureSource, Source
from geofield.imagery.sources.google import MAX_FRAME_PX, GoogleStaticSource

#: Pixels on a side where no size was asked for.
_SIDE_PX = 1024


@dataclass
class PlacePicture:
    """The picture of one place; of a source, more of it can be had.

    Attributes
    ----------
    path : str
        What `read_scene` reads.
    offers_more : bool
        Whether the source may have more than was fetched, for who asks by size.
    """

    path: str
    offers_more: bool = False
    #: Fetches a square of a side in ground metres.
    _fetch: Callable[[float], Acquired] | None = None
    #: Side of the largest square that is fetched unasked, ground metres.
    _most_m: float = field(default=float("inf"))

    def wider(self, size_m: float) -> str | None:
        """The path of what shows a square of a side in ground metres; None where nothing does.

        Warns
        -----
        ImageryWarning
            When the source does not give it.
        """
        if self._fetch is None:
            return self.path  # all of the user's own picture
        if size_m > self._most_m:
            return None
        try:
            return str(self._fetch(size_m).path)
        except GeofieldError as error:
            self.offers_more = False
            warnings.warn(
                f"More of the picture could not be had: {error.message}",
                ImageryWarning,
                stacklevel=2,
            )
            return None


def is_own_picture(what: str) -> bool:
    """Whether what the user names is a picture or a set of pictures on a disk."""
    if not what or "{" in what:  # no name at all would be the working folder
        return False
    return Path(what).exists() and Path(what).suffix.lower() != ".mbtiles"


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
    framed = isinstance(source, GoogleStaticSource)
    with tempfile.TemporaryDirectory(prefix="geofield-") as folder:

        def fetch(size_m: float | None) -> Acquired:
            size_px = None if size_m or own or framed else _SIDE_PX
            path = Path(folder) / f"scene_{size_m or 0:.0f}.tif"
            where = Where(lat=lat, lon=lon, size_m=size_m, size_px=size_px)
            return acquire(source, where, path, options=options, progress=progress)

        first = fetch(size_m)
        most_px = float("inf") if own else MAX_FRAME_PX if framed else MAX_SIDE_PX
        most_m = (most_px + 0.5) * first.grid.ground_resolution_m
        yield PlacePicture(str(first.path), not (own or framed), fetch, most_m)
