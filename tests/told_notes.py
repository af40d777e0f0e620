"""What the program tells of tracks, and why it refuses some, in its own words."""

from __future__ import annotations

from typing import Any

import pytest
import shapely
from pyproj import CRS
from shapely.geometry.base import BaseGeometry

from geofield.errors import TrackError
from geofield.model.searched import unsearched
from geofield.notes import listening
from geofield.tracks import plan_route, plan_tracks


def notes_of_tracks() -> list[str]:
    """One of each kind, from fields that give cause for it."""
    square, wall = shapely.box(0, 0, 100, 60), shapely.box(48, -5, 52, 65)
    ring = shapely.Point(50, 30).buffer(20).difference(shapely.Point(50, 30).buffer(15))
    asked: list[tuple[list[BaseGeometry], dict[str, Any]]] = [
        ([ring], {"spacing_m": 5}),
        ([], {"spacing_m": 6, "width_m": 4}),
        ([], {"spacing_m": 6, "headland_m": 9}),
        ([], {"spacing_m": 90, "last_strip": "leave"}),
        ([square.buffer(1)], {"spacing_m": 5}),
    ]
    with listening() as heard:
        for obstacles, settings in asked:
            plan_tracks(square, obstacles, crs=32636, direction=90, **settings)
        parted = plan_tracks(square, [wall], crs=32636, spacing_m=6, headland_m=12)
        plan_route(parted)
        plan_route(plan_tracks(square, crs=32636, spacing_m=30), pattern="skip")
        bowtie = shapely.Polygon([(40, 20), (60, 30), (60, 20), (40, 30)])
        for odd in ([bowtie], [bowtie, bowtie], [shapely.Point()], [shapely.Point()] * 2):
            plan_tracks(square, odd, crs=32636, spacing_m=9)
    notes = [str(note) for note in heard]
    assert len(set(notes)) >= 11
    refused: list[dict[str, Any]] = [
        {"spacing_m": 1e-4},
        {"spacing_m": 0.01, "step_m": 0.01},
        {"spacing_m": 9, "offset_m": 150},
    ]
    for settings in refused:
        with pytest.raises(TrackError) as error:
            plan_tracks(square, crs=32636, **settings)
        notes.append(error.value.message)
    notes.append(unsearched("POLYGON EMPTY", square, CRS(32636)))
    return notes
