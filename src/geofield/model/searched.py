"""The ground that obstacles were searched on, and what an outline gained since."""

from __future__ import annotations

import shapely
from pyproj import CRS

from geofield.crs import LONLAT, ground_areas_m2, ground_scale_of, reproject
from geofield.model.field import Field

#: How the doubt begins that the outline gained ground after obstacles were searched.
UNSEARCHED = "Nobody searched"
#: Of latitude and longitude: a tenth of a millimetre.
_DECIMALS = 9
#: A strip that is narrower holds no obstacle of its own, metres: a border drawn a bit better.
_NARROW_M = 1.0


def searched_in(field: Field) -> str:
    """The outline that obstacles are searched in, as WKT of longitude and latitude."""
    return str(shapely.to_wkt(field.polygon_lonlat, rounding_precision=_DECIMALS))


def unsearched(searched: str | None, outline: shapely.Polygon, crs: CRS) -> str:
    """The doubt about ground that an outline gained, in words; empty where there is none.

    `searched` is of :func:`searched_in`, None where nobody recorded it; `crs` is the outline's.
    """
    if searched is None:
        return ""
    gained = outline.difference(reproject(shapely.from_wkt(searched), LONLAT, crs))
    inset = _NARROW_M / 2 * float(ground_scale_of(outline, crs))
    parts = [each for each in shapely.get_parts(gained) if not each.buffer(-inset).is_empty]
    if not parts:
        return ""
    ha = float(ground_areas_m2(parts, crs).sum()) / 10_000.0
    area = f"{ha:.2f} ha" if ha >= 0.1 else f"{ha * 10_000:.0f} m2"
    return f"{UNSEARCHED} {area} that the outline gained: what stands there is not known."
