"""Stage 1: from a GPS point to a georeferenced picture.

The names below load their modules when they are first used: who opens a picture that lies here
needs nothing of what fetches one from a server.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from geofield.late import late_names

if TYPE_CHECKING:
    from geofield.imagery.acquisition import Acquired, FetchOptions, Where, acquire, with_provenance
    from geofield.imagery.at_place import is_own_picture, picture_at
    from geofield.imagery.pictures import open_reader
    from geofield.imagery.reader import SceneReader
    from geofield.imagery.scene import read_scene
    from geofield.imagery.sources import find_source
    from geofield.imagery.write import write_scene

_HOME = {
    "Acquired": "acquisition",
    "FetchOptions": "acquisition",
    "SceneReader": "reader",
    "Where": "acquisition",
    "acquire": "acquisition",
    "find_source": "sources",
    "is_own_picture": "at_place",
    "open_reader": "pictures",
    "picture_at": "at_place",
    "read_scene": "scene",
    "with_provenance": "acquisition",
    "write_scene": "write",
}

__all__ = [
    "Acquired",
    "FetchOptions",
    "SceneReader",
    "Where",
    "acquire",
    "find_source",
    "is_own_picture",
    "open_reader",
    "picture_at",
    "read_scene",
    "with_provenance",
    "write_scene",
]

__getattr__ = late_names(__name__, _HOME)
