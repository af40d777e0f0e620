"""Stage 2: the outline of the field around a point. Pure: arrays and values in and out."""

from geofield.field.boundary import field_from_boundary
from geofield.field.extract import METHODS, extract_field
from geofield.field.grow import grow_field, touches_edge
from geofield.field.study import StudyPictures, study_pictures

__all__ = [
    "METHODS",
    "StudyPictures",
    "extract_field",
    "field_from_boundary",
    "grow_field",
    "study_pictures",
    "touches_edge",
]
