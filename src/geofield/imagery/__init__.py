"""Stage 1: from a GPS point to a georeferenced picture."""

from geofield.imagery.acquire import Acquired, FetchOptions, Where, acquire, with_provenance
from geofield.imagery.at_place import is_own_picture, picture_at
from geofield.imagery.pictures import open_reader
from geofield.imagery.reader import SceneReader
from geofield.imagery.scene import read_scene
from geofield.imagery.sources import find_source
from geofield.imagery.write import write_scene

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
