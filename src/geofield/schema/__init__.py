"""Layers, columns, types and units: the one place that every reader and writer looks at.

A :class:`Layer` is a table of geometries with named columns (`columns`); `layers` has them all.
Writers take names, order, types, units and the short Shapefile names from there;
:func:`conform` (`tables`) brings any table into that shape.
"""

from geofield.schema.columns import Column, ColumnType, Layer
from geofield.schema.layers import (
    ALTERNATIVES,
    FIELD,
    GAPS,
    HEADLAND,
    HEADLAND_TRACKS,
    KINDS,
    LAYERS,
    NOT_AVOIDED,
    OBSTACLES,
    PLACES,
    REVIEWED,
    ROUTE,
    SEGMENTS,
    STATUSES,
    TRACK_POINTS,
    TRACKS,
    TURNS,
    layer,
)
from geofield.schema.meanings import meaning, unit_in_words
from geofield.schema.tables import (
    conform,
    empty,
    of_others,
    own_columns,
    own_names,
    own_type,
    table,
)

__all__ = [
    "ALTERNATIVES",
    "FIELD",
    "GAPS",
    "HEADLAND",
    "HEADLAND_TRACKS",
    "KINDS",
    "LAYERS",
    "NOT_AVOIDED",
    "OBSTACLES",
    "PLACES",
    "REVIEWED",
    "ROUTE",
    "SEGMENTS",
    "STATUSES",
    "TRACKS",
    "TRACK_POINTS",
    "TURNS",
    "Column",
    "ColumnType",
    "Layer",
    "conform",
    "empty",
    "layer",
    "meaning",
    "of_others",
    "own_columns",
    "own_names",
    "own_type",
    "table",
    "unit_in_words",
]
