"""What every file that GDAL reads must keep: it opens, has rows, and lies on the earth."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely
from pyproj import CRS

from geofield.formats.foreign import layer_names, read_vector
from geofield.formats.validation import Finding


def check(path: Path) -> Iterator[Finding]:
    """Findings in a file, layer by layer."""
    frames = {name: read_vector(path, name) for name in layer_names(path)}
    if not any(len(frame) for frame in frames.values()):
        yield Finding("warning", path.name, "it holds no shapes")
    for name, frame in frames.items():
        coordinates = shapely.get_coordinates(frame.geometry.to_numpy())
        if not np.isfinite(coordinates).all():
            yield Finding("error", name, "a coordinate is not a number")
        degrees = frame.crs is not None and CRS(frame.crs).is_geographic
        if degrees and np.any(np.abs(coordinates) > [180.0, 90.0]):
            yield Finding("error", name, "positions outside longitude 180, latitude 90")
