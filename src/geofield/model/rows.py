"""Rows of a layer that become a table only when somebody asks for one.

A GeoDataFrame takes a millisecond or two to make and as long to take apart, which for a small
field is most of the work. Of ten thousand fields nobody looks at the tables: their columns go
from the planner to the files as they are.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pyproj import CRS

from geofield import schema

if TYPE_CHECKING:
    import geopandas as gpd

_Class = TypeVar("_Class")


class Rows:
    """The rows of a layer.

    Parameters
    ----------
    layer : Layer
    columns : mapping
        Values by column name: float and int arrays, else lists with None for what is missing.
        Columns that are not there are missing values.
    geometry : sequence of shapely geometries
    crs : CRS
    own : mapping, optional
        The user's own columns.
    """

    __slots__ = ("_columns", "_frame", "_geometry", "_own", "crs", "layer")

    def __init__(
        self,
        layer: schema.Layer,
        columns: Mapping[str, Any],
        geometry: Any,
        crs: CRS,
        own: Mapping[str, Any] | None = None,
    ) -> None:
        self.layer = layer
        self.crs = crs
        self._columns: Mapping[str, Any] = columns
        self._geometry = np.empty(len(geometry), dtype=object)
        self._geometry[:] = geometry
        self._own: Mapping[str, Any] = own or {}
        self._frame: gpd.GeoDataFrame | None = None

    @classmethod
    def of(cls, layer: schema.Layer, frame: gpd.GeoDataFrame) -> Rows:
        """The rows of a table."""
        rows = cls(layer, {}, (), frame.crs)
        rows._frame = frame
        return rows

    def __len__(self) -> int:
        return len(self._geometry if self._frame is None else self._frame)

    @property
    def frame(self) -> gpd.GeoDataFrame:
        """The table; the same each time, and from then on what is changed in it holds."""
        if self._frame is None:
            self._frame = schema.table(
                self.layer, dict(self._columns), self._geometry, self.crs, self._own
            )
        return self._frame

    @property
    def geometry(self) -> NDArray[np.object_]:
        """The geometries."""
        if self._frame is None:
            return self._geometry
        return np.asarray(self._frame.geometry.array, dtype=object)

    def column(self, name: str) -> Any:
        """A column of the layer: an array, a list, or a pandas series where there is a table."""
        if self._frame is not None:
            return self._frame[name]
        values = self._columns.get(name)
        return [None] * len(self) if values is None else values

    @property
    def own(self) -> list[str]:
        """Names of the user's own columns."""
        if self._frame is None:
            return list(self._own)
        return schema.own_columns(self.layer, self._frame)

    def own_values(self, name: str) -> list[Any]:
        """One of the user's columns, with None for what is missing, which all may be."""
        import pandas as pd

        values: Any = self._own.get(name)
        if self._frame is not None and name in self._frame.columns:
            values = self._frame[name].tolist()
        if values is None:
            return [None] * len(self)
        # Of a list `isna` asks each part.
        scalar = pd.api.types.is_scalar
        return [None if scalar(value) and pd.isna(value) else value for value in values]


class _Table:
    """A field of a class that is given as rows or as a table, and read as a table."""

    def __init__(self, layer: schema.Layer, name: str) -> None:
        self.layer = layer
        self.name = name

    def __get__(self, of: Any, owner: type | None = None) -> Any:
        if of is None:
            return self
        rows = vars(of)[self.name]
        return None if rows is None else rows.frame

    def __set__(self, of: Any, value: Any) -> None:
        given = value is None or isinstance(value, Rows)
        vars(of)[self.name] = value if given else Rows.of(self.layer, value)


def tables_when_asked(**layers: schema.Layer) -> Callable[[type[_Class]], type[_Class]]:
    """Have fields of a dataclass take :class:`Rows` too, and make tables when they are read.

    The layer of each such field is given by the field's name.
    """

    def change(owner: type[_Class]) -> type[_Class]:
        for name, layer in layers.items():
            setattr(owner, name, _Table(layer, name))
        return owner

    return change


def replaced(of: _Class, **changes: Any) -> _Class:
    """The same with other values, as `dataclasses.replace`; rows stay rows, not tables."""
    value: Any = of
    names = [name for name, each in vars(type(of)).items() if isinstance(each, _Table)]
    same: _Class = dataclasses.replace(value, **{name: vars(of)[name] for name in names} | changes)
    return same


def rows_of(of: Any) -> dict[str, Rows]:
    """The rows of all those fields of an object that are not None, by layer."""
    fields = (each for each in vars(type(of)).values() if isinstance(each, _Table))
    found = {each.layer.name: vars(of)[each.name] for each in fields}
    return {name: rows for name, rows in found.items() if rows is not None}
