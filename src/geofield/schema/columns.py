"""What a column and a layer are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from geofield.errors import FormatError

ColumnType = Literal["int", "float", "str", "date"]
GeometryType = Literal["Point", "LineString", "MultiLineString", "Polygon", "MultiPolygon"]


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a layer.

    Attributes
    ----------
    name : str
        Lower snake case, with the unit where there is one.
    type : {"int", "float", "str", "date"}
        Whole numbers and text may be missing; missing floats are NaN.
    title : str
        What a person reads as the column's heading.
    shapefile : str
        Its name in a Shapefile: at most ten characters, unique in its layer.
    unit : str
        UCUM code (``m``, ``har``, ``deg``), empty where there is none.
    values : tuple of str
        The only values allowed, where there is such a list.
    """

    name: str
    type: ColumnType
    title: str
    shapefile: str
    unit: str = ""
    values: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Layer:
    """A table of one geometry type.

    Attributes
    ----------
    name : str
        As in the GeoPackage.
    geometry : str
        The one geometry type of all rows.
    title, description : str
        For people.
    key : tuple of str
        The columns that together name a row; rows are sorted by them.
    columns : tuple of Column
    optional : bool
        Written only when the plan has it.
    working : bool
        For a person to decide by: only in the plan's own GeoPackage and its QGIS project.
    """

    name: str
    geometry: GeometryType
    title: str
    description: str
    key: tuple[str, ...]
    columns: tuple[Column, ...]
    optional: bool = False
    working: bool = False

    @property
    def column_names(self) -> list[str]:
        """Names in order, without the geometry."""
        return [column.name for column in self.columns]

    def column(self, name: str) -> Column:
        """The column of a name."""
        for column in self.columns:
            if column.name == name:
                return column
        raise FormatError(
            f"Layer {self.name!r} has no column {name!r}.",
            hint=f"Columns: {', '.join(self.column_names)}.",
        )
