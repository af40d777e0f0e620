"""Grow: widen the window until the field's outline no longer touches it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from geofield.errors import SettingsError
from geofield.field.extract import extract_field
from geofield.grid import Grid
from geofield.model import Field, Scene
from geofield.model.frame import along_frame
from geofield.notes import listening, warn


def grow_field(
    read: Callable[[float], Scene],
    *,
    lat: float,
    lon: float,
    size_m: float = 400.0,
    largest_m: float = 6400.0,
    **options: Any,
) -> tuple[Field, Scene]:
    """Extract a field of unknown size.

    Parameters
    ----------
    read : callable
        Reads the picture around the point in a window of a given side, metres.
    lat, lon : float
        A point in the field, degrees, WGS 84.
    size_m, largest_m : float
        Side of the first window, which doubles, and of the last one, metres.
    **options
        For `extract_field`.

    Returns
    -------
    (Field, Scene)
        The outline and the window it was found in. Where the picture ends before the field
        does, `field.quality` says so.

    Warns
    -----
    FieldWarning
        When the outline should not be trusted unseen.
    """
    if not 0 < size_m <= largest_m:
        raise SettingsError(f"The window must grow from {size_m} m to {largest_m} m.")
    covered: Grid | None = None
    field: Field | None = None
    while True:
        scene = read(size_m)
        # Two windows narrower than a pixel are the same pixel, not all of the picture.
        is_all = scene.grid == covered and scene.valid.size > 1
        if field is not None and is_all:
            break  # it was searched
        ended = is_all or size_m >= largest_m
        # A window of one pixel, or of evenly white ground, is no empty picture yet.
        if ended or not scene.is_blank:
            with listening() as heard:
                field = extract_field(scene, lat=lat, lon=lon, **options)
            if ended or not along_frame(field.polygon, field.crs, scene.grid):
                break
        covered = scene.grid
        size_m = min(2 * size_m, largest_m)
    for note in heard:
        warn(str(note), type(note))
    return field, scene
