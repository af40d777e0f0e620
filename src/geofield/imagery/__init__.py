"""Stage 1: from a GPS point to a georeferenced picture.

The names below load their modules when they are first used: who opens a picture that lies here
needs nothing of what fetches one from a server.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from geofield.late import late_names

if TYPE_CHECKING:
    from geofield.imagery.acquisition import Acquired, Where, acquire
    from geofield.imagery.facts import picture_facts, source_of
    from geofield.imagery.opening import FetchOptions
    from geofield.imagery.pictures import open_reader, pictures_digest
    from geofield.imagery.place_picture import Imagery, PlacePicture, is_own_picture
    from geofield.imagery.reader import SceneReader
    from geofield.imagery.scene import read_scene
    from geofield.imagery.sources import find_source
    from geofield.imagery.write import write_scene

__all__ = [
    "Acquired",
    "FetchOptions",
    "Imagery",
    "PlacePicture",
    "SceneReader",
    "Where",
    "acquire",
    "find_source",
    "is_own_picture",
    "open_reader",
    "picture_facts",
    "pictures_digest",
    "read_scene",
    "source_of",
    "write_scene",
]

__getattr__ = late_names(
    __name__,
    {
        "acquisition": "Acquired Where acquire",
        "facts": "picture_facts source_of",
        "opening": "FetchOptions",
        "pictures": "open_reader pictures_digest",
        "place_picture": "Imagery PlacePicture is_own_picture",
        "reader": "SceneReader",
        "scene": "read_scene",
        "sources": "find_source",
        "write": "write_scene",
    },
)
