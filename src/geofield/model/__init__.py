"""Values that the stages hand to each other: scene, field, obstacles, tracks, dataset."""

from geofield.model.dataset import Dataset, Provenance
from geofield.model.field import Alternative, Field, FieldQuality
from geofield.model.scene import ImagerySource, Scene
from geofield.model.tracks import Tracks

__all__ = [
    "Alternative",
    "Dataset",
    "Field",
    "FieldQuality",
    "ImagerySource",
    "Provenance",
    "Scene",
    "Tracks",
]
