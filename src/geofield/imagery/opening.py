"""Open options: what is known of a picture before it is opened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from geofield.imagery.reach import OWN_FOLDER, Reach
from geofield.model.scene import ImagerySource


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenOptions:
    """What is known of a picture or set of pictures better than its files know it.

    Attributes
    ----------
    lat, lon : float, optional
        The point of interest, degrees, WGS 84: where a reprojected picture is centred; of a set
        only what lies near it is taken.
    bands : sequence of str, optional
        What the bands show, in order: red, green, blue, nir, grey, alpha, other.
    crs : optional
        The CRS of a picture that does not name it.
    scaling : (float, float), optional
        File values that become 0 and 255.
    source : ImagerySource, optional
        Provenance that is known better than the file knows it.
    reach : Reach
        What a VRT, a tile index or a STAC file may lead to besides its own folder.
    """

    lat: float | None = None
    lon: float | None = None
    bands: Sequence[str] | None = None
    crs: Any = None
    scaling: tuple[float, float] | None = None
    source: ImagerySource | None = None
    reach: Reach = OWN_FOLDER

    @property
    def point(self) -> tuple[float, float] | None:
        """Longitude and latitude, degrees; None unless both are known."""
        return None if self.lat is None or self.lon is None else (self.lon, self.lat)
