"""Stage 2: the outline of the field around a point. Pure: arrays and values in and out."""

from geofield.field.extract import extract_field
from geofield.field.study import StudyPictures, study_pictures

__all__ = ["StudyPictures", "extract_field", "study_pictures"]
