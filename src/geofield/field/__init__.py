"""Stage 2: the outline of the field around a point. Pure: arrays and values in and out.

In comes a scene and points, out a `Field`. Begin with `extract` (what a user calls), then
`auto` (one pass: search, rank, carry), `search` (where outlines come from) and `ranking`
(which one is taken, and how certain that is).
"""

from geofield.field.boundary import field_from_boundary
from geofield.field.extract import extract_field, prepare_field
from geofield.field.grow import grow_field
from geofield.field.views import FieldSearch

__all__ = [
    "FieldSearch",
    "extract_field",
    "field_from_boundary",
    "grow_field",
    "prepare_field",
]
