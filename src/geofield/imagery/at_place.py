"""The picture of one place as a path: the user's own, or one fetched for the moment."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from geofield.imagery.acquisition import Where, acquire
from geofield.imagery.opening import FetchOptions
from geofield.imagery.sources import PictureSource, Source

#: Pixels on a side where no size was asked for.
_SIDE_PX = 1024


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
) -> Iterator[str]:
    """A path that `read_scene` reads, of a source's picture around a place.

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
    str
        The source's own file or address, or a file that is gone behind the block.
    """
    size_px = None if size_m else _SIDE_PX
    if isinstance(source, PictureSource):
        if bands or source.terms.attribution + source.terms.licence == "":
            yield source.path
            return
        # What the settings say of its terms must travel with it: as a file that says so.
        size_px = None
    where = Where(lat=lat, lon=lon, size_m=size_m, size_px=size_px)
    with tempfile.TemporaryDirectory(prefix="geofield-") as folder:
        done = acquire(
            source, where, Path(folder) / "scene.tif", options=options, progress=progress
        )
        yield str(done.path)
