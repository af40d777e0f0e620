"""The picture of one place as a path: the user's own, or one that more can be fetched of.

Nothing that fetches is loaded for one's own.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from geofield.errors import GeofieldError, ImageryWarning

if TYPE_CHECKING:
    from geofield.imagery.acquisition import Acquired


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
