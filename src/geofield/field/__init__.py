"""Stage 2: the outline of the field around a point. Pure: arrays and values in and out."""

from geofield.field.boundary import field_from_boundary
from geofield.field.extract import extract_field
from geofield.field.grow import grow_field, touches_edge

__all__ = ["extract_field", "field_from_boundary", "grow_field", "touches_edge"]
