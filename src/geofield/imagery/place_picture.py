"""The picture of one place as a path: the user's own, or one that more can be fetched of.

Nothing that fetches is loaded for one's own.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from geofield.errors import GeofieldError, ImageryWarning
from geofield.notes import warn
from geofield.strangers import picture_file

if TYPE_CHECKING:
    from geofield.imagery.acquisition import Acquired
    from geofield.imagery.opening import FetchOptions
    from geofield.imagery.sources import Source
    from geofield.settings import ImagerySettings

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
    fetch : callable, optional
        Fetches a square of a side in ground metres.
    most_m : float
        Side of the largest square that is fetched unasked, ground metres.
    """

    path: str
    offers_more: bool = False
    fetch: Callable[[float], Acquired] | None = None
    most_m: float = math.inf

    def wider(self, size_m: float) -> str | None:
        """The path of what shows a square of a side in ground metres; None where nothing does.

        Warns
        -----
        ImageryWarning
            When the source does not give it.
        """
        if self.fetch is None:
            return self.path  # all of the user's own picture
        if size_m > self.most_m:
            return None
        try:
            return str(self.fetch(size_m).path)
        except GeofieldError as error:
            self.offers_more = False
            warn(f"More of the picture could not be had: {error.message}", ImageryWarning)
            return None


@dataclass(frozen=True)
class Imagery:
    """Where pictures come from; a value that any worker can use.

    Attributes
    ----------
    path : str
        The user's own picture, or set of pictures; empty for a source.
    source : Source, optional
        Its terms were checked.
    options : FetchOptions, optional
        Of the source.
    digest : str
        Of what the user's own pictures show, where somebody looked.
    """

    path: str = ""
    source: Source | None = None
    options: FetchOptions | None = None
    digest: str = ""

    @contextmanager
    def at(
        self,
        lat: float,
        lon: float,
        settings: ImagerySettings,
        progress: Callable[[int, int, str], None] | None = None,
    ) -> Iterator[PlacePicture]:
        """The picture around a point, of the size and with the bands that settings say.

        Yields
        ------
        PlacePicture
            The user's own file or address, or files that are gone behind the block.
        """
        source, options = self.source, self.options
        if source is None or options is None:
            yield PlacePicture(self.path)
            return
        from geofield.imagery.acquisition import Where, acquire
        from geofield.imagery.reader import MAX_SIDE_PX
        from geofield.imagery.sources import PictureSource

        if isinstance(source, PictureSource):
            terms = source.terms
            if not (terms.attribution or terms.licence or source.date):
                yield PlacePicture(source.path)
                return
            source = replace(source, bands=settings.bands, crs=settings.crs)
        # What the settings say of a picture must travel with it: as a file that says so.
        own = isinstance(source, PictureSource)
        most_px = source.most_px if own else min(source.most_px, MAX_SIDE_PX)
        first_px = None if own else int(min(_SIDE_PX, most_px))
        with tempfile.TemporaryDirectory(prefix="geofield-") as folder:

            def fetch(size_m: float | None) -> Acquired:
                path = Path(folder) / f"scene_{size_m or 0}.tif"
                side_px = None if size_m else first_px
                where = Where(lat=lat, lon=lon, size_m=size_m, size_px=side_px)
                return acquire(source, where, path, options=options, progress=progress)

            first = fetch(settings.size_m)
            most_m = (most_px + 0.5) * first.grid.ground_resolution_m
            yield PlacePicture(str(first.path), most_px < source.most_px, fetch, most_m)


def is_own_picture(what: str) -> bool:
    """Whether what the user names is a picture or a set of pictures on a disk."""
    if not what or "{" in what:  # no name at all would be the working folder
        return False
    file = picture_file(what)
    return file.exists() and file.suffix.lower() != ".mbtiles"
