"""Field: the polygon of the target field, in the metric CRS, with its evidence."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS
from shapely import MultiPolygon, Polygon

from geofield.crs import (
    LONLAT,
    authority_name,
    ground_areas_m2,
    ground_scale_of,
    is_metric,
    parse_crs,
    reproject,
    transformer,
)
from geofield.errors import CRSError, FieldError, FormatError
from geofield.grid import Grid
from geofield.model.card import card, field_drawn, words
from geofield.model.place import place_id
from geofield.wording import counted

#: The next step where something else stands for a field.
MAKE_ONE = "Of a polygon in a metric CRS make one: gf.Field(polygon, crs)."


def refuse_no_areas(outlines: Iterable[Any]) -> None:
    """Refuse points and lines that stand where an outline does.

    Raises
    ------
    FormatError
    """
    for each in outlines:
        if not isinstance(each, Polygon | MultiPolygon):
            raise FormatError(
                f"The field's outline is a {each.geom_type}; a plan needs a polygon.",
                hint="Draw it as a polygon in the layer `field` (QGIS: Lines to polygons).",
            )


def _text(value: Any) -> str:
    """A name as text, also of a column of numbers; none where it is missing there."""
    if isinstance(value, str):
        return value
    import pandas as pd

    return "" if pd.isna(value) else str(value)


@dataclass(frozen=True, slots=True)
class FieldQuality:
    """How far an outline can be trusted, and why.

    Attributes
    ----------
    score : float
        0 (do not trust) to 1.
    reasons : tuple of str
        What speaks against the outline, in plain words; empty when nothing does.
    figures : tuple of (str, float)
        The measured evidence, by name.
    trusted : bool
        False when a person should look before a machine drives.
    """

    score: float = 1.0
    reasons: tuple[str, ...] = ()
    figures: tuple[tuple[str, float], ...] = ()
    trusted: bool = True

    @property
    def certainty(self) -> float | None:
        """The probability that the outline is right, 0 to 1; None where nobody measured it."""
        return self.score if "certainty" in dict(self.figures) else None


@dataclass(frozen=True, slots=True)
class Alternative:
    """An outline that may be meant.

    Attributes
    ----------
    polygon : shapely.Polygon
        In the field's CRS.
    certainty : float
        Probability that it is right.
    """

    polygon: Polygon
    certainty: float


@dataclass(frozen=True, eq=False, repr=False)
class Field:
    """A field.

    >>> import shapely
    >>> box = shapely.box(500000, 3900000, 500200, 3900100)
    >>> gf.Field(box, "EPSG:32636", name="North")
    <Field 'North'
      area 2.00 ha, perimeter 600 m, found by given, CRS EPSG:32636>

    Parameters
    ----------
    polygon : shapely.Polygon
        Valid and not empty, in `crs`; may have holes.
    crs : CRS
        Projected, in metres (see `geofield.crs.ground_scale`).
    name, field_id : str
        For people and files; `field_id` is made from the place where none is given.
    method : str
        How the outline came to be: ``study``, ``auto``, ``boundary``, ``drawn``, ...
    quality : FieldQuality or None
        None for an outline that nobody measured.
    imagery, licence : str
        Name and licence of the picture behind it.
    imagery_date : str or None
        ISO 8601.
    own : tuple of (str, value)
        The columns that the user added to the layer `field`.
    alternatives : tuple of Alternative
        The most likely different outlines, the one that was taken first; empty where nobody
        searched.
    """

    polygon: Polygon
    crs: CRS
    name: str = ""
    field_id: str = ""
    method: str = "given"
    quality: FieldQuality | None = None
    imagery: str = ""
    imagery_date: str | None = None
    licence: str = ""
    own: tuple[tuple[str, Any], ...] = ()
    alternatives: tuple[Alternative, ...] = ()

    if TYPE_CHECKING:  # made from anything that says a CRS, which its own type does not tell

        def __init__(
            self,
            polygon: Polygon,
            crs: Any,
            name: str = "",
            field_id: str = "",
            method: str = "given",
            quality: FieldQuality | None = None,
            imagery: str = "",
            imagery_date: str | None = None,
            licence: str = "",
            own: tuple[tuple[str, Any], ...] = (),
            alternatives: tuple[Alternative, ...] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        crs = parse_crs(self.crs)
        object.__setattr__(self, "crs", crs)
        if not is_metric(crs):
            raise CRSError(
                f"A field is measured in metres; {authority_name(crs)} is not a metric CRS.",
                hint="Reproject to the UTM zone: GeoSeries.to_crs(series.estimate_utm_crs()).",
            )
        given: Any = self.polygon
        parts = list(given.geoms) if isinstance(given, MultiPolygon) else []
        if len(parts) == 1:  # as tables of many programs have it
            object.__setattr__(self, "polygon", parts[0])
        if not isinstance(self.polygon, Polygon) or self.polygon.is_empty:
            raise FieldError(
                "A field is one polygon that is not empty.",
                hint=f"Of {len(parts)} parts each is a field." if parts else None,
            )
        if not self.polygon.is_valid:
            raise FieldError(
                f"The field's outline is not valid: {shapely.is_valid_reason(self.polygon)}.",
                hint="Repair it with shapely.make_valid, or Fix geometries in QGIS.",
            )
        object.__setattr__(self, "polygon", shapely.force_2d(shapely.orient_polygons(self.polygon)))
        for name in ("name", "field_id"):
            object.__setattr__(self, name, _text(getattr(self, name)))
        if not self.field_id:
            object.__setattr__(self, "field_id", place_id(self.polygon, crs))
        if not self.name:
            object.__setattr__(self, "name", self.field_id)

    def __eq__(self, other: object) -> bool:
        """Whether outline, names, origin, quality and own columns are the same.

        Other outlines that were merely proposed do not count, as between plans.
        """
        if not isinstance(other, Field):
            return NotImplemented
        return self._values() == other._values()

    def __hash__(self) -> int:
        return hash((self.field_id, self.polygon))

    def _values(self) -> tuple[Any, ...]:
        """What is the same in equal fields."""
        picture = (self.imagery, self.imagery_date, self.licence)
        names = (self.name, self.field_id, self.method)
        return (self.crs, self.polygon, names, picture, self.own, self.quality)

    @property
    def certainty(self) -> float | None:
        """As `FieldQuality.certainty`: None of a parcel of one's own, and by method ``study``."""
        return None if self.quality is None else self.quality.certainty

    @property
    def doubts(self) -> tuple[str, ...]:
        """What speaks against the outline, in words."""
        return () if self.quality is None else self.quality.reasons

    def __repr__(self) -> str:
        return words(f"Field {self.name!r}", self._facts())

    def _repr_html_(self) -> str:
        return card(f"Field {self.name}", self._facts(), [field_drawn(self.polygon)])

    def _facts(self) -> dict[str, str]:
        facts = {
            "area": f"{self.area_ha:.2f} ha",
            "perimeter": f"{self.perimeter_m:.0f} m",
            "found by": self.method,
            "CRS": authority_name(self.crs),
        }
        if self.quality is not None:
            if self.certainty is not None:
                facts["certainty"] = f"{self.certainty:.2f}"
            facts["doubts"] = str(len(self.quality.reasons))
        return facts

    def choose(self, number: int) -> Field:
        """The field with one of its alternatives as outline, by a person's word.

        Parameters
        ----------
        number : int
            1 is the outline that was taken.

        Raises
        ------
        FieldError
            When there is no such alternative.
        """
        if not 1 <= number <= len(self.alternatives):
            raise FieldError(
                f"There is no outline {number} to choose: this field has "
                f"{counted(len(self.alternatives), 'alternative')}.",
                hint="Show them with `geofield field --alternatives`.",
            )
        polygon = self.alternatives[number - 1].polygon
        return replace(self, polygon=polygon, method="chosen", quality=None)

    @property
    def area_ha(self) -> float:
        """Area without holes, hectares on the ground."""
        return float(ground_areas_m2([self.polygon], self.crs)[0]) / 10_000.0

    @property
    def perimeter_m(self) -> float:
        """Length of the outer ring, metres on the ground."""
        return float(self.polygon.exterior.length / ground_scale_of(self.polygon, self.crs))

    @property
    def polygon_lonlat(self) -> Polygon:
        """The polygon in longitude and latitude, degrees."""
        polygon: Polygon = reproject(self.polygon, self.crs, LONLAT)
        return polygon

    @property
    def inside_lonlat(self) -> tuple[float, float]:
        """Longitude and latitude of a place in it, degrees; also where 180 degrees runs through."""
        inside = self.polygon.representative_point()
        lon, lat = transformer(self.crs, LONLAT).transform(inside.x, inside.y)
        return float(lon), float(lat)

    def polygon_px(self, grid: Grid) -> Polygon:
        """The polygon in the pixel coordinates of `grid`."""
        return shapely.transform(
            self.polygon, lambda c: np.column_stack(grid.from_crs(c[:, 0], c[:, 1], self.crs))
        )

    def mask(self, grid: Grid, *, holes: bool = True) -> NDArray[np.bool_]:
        """Pixels of a grid whose centre lies in the field (rows, columns).

        Parameters
        ----------
        grid : Grid
        holes : bool
            False fills the holes: what stage 3 searches.
        """
        from rasterio.features import rasterize

        polygon = self.polygon_px(grid)
        if not holes:
            polygon = Polygon(polygon.exterior)
        return np.asarray(rasterize([(polygon, 1)], out_shape=grid.shape, dtype="uint8"), bool)
