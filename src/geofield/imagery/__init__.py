"""Stage 1: from a GPS point to a georeferenced picture."""

from geofield.imagery.reader import SceneReader
from geofield.imagery.scene import read_scene
from geofield.imagery.write import write_scene

__all__ = ["SceneReader", "read_scene", "write_scene"]
