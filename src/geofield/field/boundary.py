"""Boundary: the user's own parcel instead of an extracted outline."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from pyproj import CRS
from shapely import Polygon

from geofield import schema
from geofield.crossings import in_words, mended
from geofield.crs import LONLAT, ground_areas_m2, metric_crs, reproject, transformer
from geofield.datum import datum_notes
from geofield.errors import CRSError, FieldError, FieldWarning
from geofield.finite import MEND_IT, finite
from geofield.model import Field, FieldQuality
from geofield.model.own_values import first_of
from geofield.notes import warn
from geofield.parts import in_parts
from geofield.wording import SWAP, cell_text, counted, none_of

if TYPE_CHECKING:
    import geopandas as gpd

_EXCHANGE = f"Exchange them in the file (`{SWAP}`)."
#: Columns that name a parcel, in the order they are looked for.
_NAME_COLUMNS = ("name", "Name", "NAME", "field_name", "field_id", "id", "fid")


def field_from_boundary(
    parcels: gpd.GeoDataFrame,
    *,
    lat: float | None = None,
    lon: float | None = None,
    name: str | None = None,
) -> Field:
    """The parcel that contains a point, the one of a name, or the only one.

    Parameters
    ----------
    parcels : GeoDataFrame
        Polygons in any CRS, or, where there are none, closed lines; other geometries are passed
        over.
    lat, lon : float, optional
        A point in the field, degrees, WGS 84; not needed for one parcel, or with its name.
    name : str, optional
        Take the parcel of this name or id instead; with this value in any other column, where
        none has it there. A point, too, tells those of one name apart.

    Returns
    -------
    Field
        Method ``boundary``, in the metric CRS of the point, or of a place in the parcel.

    Raises
    ------
    CRSError
        When the parcels have no CRS.
    FieldError
        When no parcel, or more than one of different outline, fits.
    """
    shaped = parcels[~(parcels.geometry.isna() | parcels.geometry.is_empty)]
    rows = shapes = in_parts(shaped.reset_index(drop=True))
    points = int((rows.geometry.geom_type == "Point").sum())
    rows = _outlines(rows)
    if rows.empty:
        found = f", but {counted(points, 'point')}" if points else ""
        join = "Join the points in their order (QGIS: Points to path), then close the"
        raise FieldError(
            f"The boundary file holds no polygon and no closed line{found}.",
            hint=f"{join if points else 'Close the'} outline where it begins (QGIS: Lines to "
            "polygons).",
        )
    if parcels.crs is None:
        raise CRSError(
            "The boundary file has no coordinate reference system.",
            hint="Assign one, for instance with `ogr2ogr -a_srs EPSG:25832 parcels.gpkg FILE`.",
        )
    own = CRS(parcels.crs)
    west, south, east, north = rows.total_bounds
    if own.is_geographic and max(-south, north) > 90.0:
        swapped = max(-west, east) <= 90.0
        wrong = "they look swapped with longitudes" if swapped else "they are none"
        raise FieldError(
            f"The boundary file has latitudes from {south:.4f} to {north:.4f}: {wrong}.",
            hint=_EXCHANGE if swapped else "Check the CRS: the data may be in another one.",
        )
    rows = _somewhere(rows)
    if name is not None:
        chosen = _of_name(rows, own, name, lat, lon)
    elif lat is not None and lon is not None:
        chosen = _around(rows, own, lat, lon)
    else:
        chosen = _only(rows)
    _tell_inside(shapes, chosen)
    if lat is not None and lon is not None:
        _tell_parts(rows, chosen)
        return _field(chosen, own, lat, lon, pointed=True)
    inside = chosen.geometry.iloc[0].representative_point()
    lon, lat = transformer(own, LONLAT).transform(inside.x, inside.y)
    return _field(chosen, own, lat, lon, pointed=False)


def _tell_inside(shapes: gpd.GeoDataFrame, chosen: gpd.GeoDataFrame) -> None:
    """Tell what else the file has in the parcel: ponds, fences, wells."""
    parcel = chosen.geometry.iloc[0]
    near = shapes[finite(shapes.geometry.to_numpy())]
    near = near[near.geometry.intersects(shapely.envelope(parcel))]
    other = near.geometry.to_numpy()
    lines = shapely.get_dimensions(other) == 1
    middles = np.where(
        lines,
        shapely.line_interpolate_point(np.where(lines, other, None), 0.5, normalized=True),
        shapely.point_on_surface(other),
    )
    # Its border may lie there as a line again, the same parcel as of another year.
    off = shapely.distance(middles, parcel.boundary) > 0.01 * np.sqrt(parcel.area)
    there = shapely.within(middles, parcel) & off & (shapely.area(other) < 0.5 * parcel.area)
    if not there.any():
        return
    count = int(there.sum())
    lie = "1 more shape lies" if count == 1 else f"{count} more shapes lie"
    warn(
        f"{lie} in this parcel of the boundary file without being driven around: `geofield import` "
        "takes such as obstacles.",
        FieldWarning,
    )


def _tell_parts(rows: gpd.GeoDataFrame, chosen: gpd.GeoDataFrame) -> None:
    """Tell that a parcel of several parts is taken in one alone."""
    count = int((rows.index == chosen.index[0]).sum())
    if count > 1:
        warn(
            f"The parcel has {count} parts: only the one with the point is taken. Each is a field "
            "of its own; `geofield batch` plans them all.",
            FieldWarning,
        )


def _outlines(rows: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """The polygons; where there are none those that closed lines enclose, as CAD writes them."""
    polygons = rows[rows.geometry.geom_type == "Polygon"]
    if len(polygons):
        return polygons
    rings = rows[rows.geometry.is_ring]
    return rings.set_geometry([Polygon(line) for line in rings.geometry], crs=rows.crs)


def _somewhere(rows: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """The parcels without those that are nowhere, which is told."""
    good = finite(rows.geometry.to_numpy())
    if good.all():
        return rows
    are = counted(int((~good).sum()), "polygon", "polygons")
    if not good.any():
        raise FieldError(
            f"The boundary file holds {are}, with coordinates that are no finite numbers.",
            hint=MEND_IT,
        )
    warn(
        f"{are} of the boundary file with coordinates that are no finite numbers: left out.",
        FieldWarning,
    )
    return rows[good]


def _of_name(
    rows: gpd.GeoDataFrame, own: CRS, name: str, lat: float | None, lon: float | None
) -> gpd.GeoDataFrame:
    """The parcel of a name, or with that value in another of its columns."""
    chosen = rows[_named(rows, name)]
    if chosen.empty:
        raise _none_of(rows, f"is named {name!r}")
    if len(chosen) == 1:
        return chosen
    if len(chosen.index.unique()) == 1:
        raise FieldError(f"The parcel {name!r} has {len(chosen)} parts; a field is one.")
    if lat is not None and lon is not None:
        return _around(chosen, own, lat, lon)
    smallest = _smallest(chosen)
    if not chosen.intersects(smallest.geometry.iloc[0].representative_point()).all():
        raise FieldError(
            f"{len(chosen)} parcels of the boundary file are named {name!r}.",
            hint="Say which: --lat and --lon of a point in it, or another of its values.",
        )
    return smallest


def _around(rows: gpd.GeoDataFrame, own: CRS, lat: float, lon: float) -> gpd.GeoDataFrame:
    """The parcel that contains a point."""
    x, y = transformer(LONLAT, own).transform(lon, lat)
    # Longitudes of a parcel across 180 degrees may run on beyond that.
    at = shapely.multipoints([(x, y), (x + 360.0, y)]) if own.is_geographic else shapely.Point(x, y)
    chosen = rows[rows.geometry.intersects(at)]
    if len(chosen):
        return _smallest(chosen)
    what = f"contains lat {lat}, lon {lon}"
    there = transformer(LONLAT, own).transform(lat, lon) if abs(lon) <= 90 else (np.inf, np.inf)
    if rows.geometry.intersects(shapely.Point(there)).any():
        raise FieldError(
            f"{none_of(len(rows), 'polygon')} in the boundary file {what}, but one does with "
            "latitude and longitude swapped.",
            hint=f"{_EXCHANGE[:-1]}, or in --lat and --lon where the point is wrong.",
        )
    raise _none_of(rows, what)


def _only(rows: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """The one parcel that there is."""
    if len(rows) > 1:
        raise FieldError(
            f"The boundary file holds {len(rows)} polygons.",
            hint="Say which is the field: --lat and --lon of a point in it, or --boundary-name.",
        )
    return rows


def _none_of(rows: gpd.GeoDataFrame, what: str) -> FieldError:
    return FieldError(
        f"{none_of(len(rows), 'polygon')} in the boundary file {what}.",
        hint="Check the point and the file's CRS, or name a parcel with --boundary-name.",
    )


def _smallest(chosen: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Of nested or overlapping parcels the smallest is the most exact statement."""
    return chosen.iloc[[int(np.argmin(shapely.area(chosen.geometry.to_numpy())))]]


def _field(row: gpd.GeoDataFrame, own: CRS, lat: float, lon: float, *, pointed: bool) -> Field:
    target = metric_crs(lon, lat, own=own)
    polygon = shapely.force_2d(row.geometry.iloc[0])
    for note in datum_notes(own, *shapely.get_coordinates(polygon)[0]):
        warn(f"The boundary: {note}", FieldWarning)
    reasons: tuple[str, ...] = ()
    if not polygon.is_valid:
        point = shapely.Point(transformer(LONLAT, own).transform(lon, lat)) if pointed else None
        polygon, reasons = _repaired(polygon, point, own, target)
    # Long sides bend in another projection: points between keep them where they are.
    if own != target and own.is_geographic:
        polygon = shapely.segmentize(polygon, 0.001)
    polygon = reproject(polygon, own, target)
    there = [name for name in _NAME_COLUMNS if name in row and row[name].notna().iloc[0]]
    known = {name: cell_text(row[name].iloc[0]) for name in there}
    label = next(iter(known), "")
    others = row[schema.of_others(row.columns)].columns
    further = others.difference([label, "field_id", "fid", row.geometry.name], sort=False)
    return Field(
        polygon,
        target,
        name=known.get(label, ""),
        field_id=known.get("field_id", ""),
        method="boundary",
        quality=FieldQuality(1.0 if not reasons else 0.4, reasons, trusted=not reasons),
        own=tuple(
            (new, first_of(row[name]))
            for new, name in zip(schema.own_names(schema.FIELD, further), further, strict=True)
        ),
    )


def _repaired(
    polygon: Polygon, point: shapely.Point | None, own: CRS, metric: CRS
) -> tuple[Polygon, tuple[str, ...]]:
    """Of the parts of an outline that crosses itself the one of the point, or else the largest."""
    parts = np.array([p for p in shapely.get_parts(mended(polygon)) if isinstance(p, Polygon)])
    if not len(parts):
        raise FieldError("The boundary has no area.", hint="Draw the outline anew.")
    areas = ground_areas_m2(reproject(parts, own, metric), metric)
    at = int(np.argmax(areas))
    if point is not None and (around := shapely.intersects(parts, point)).any():
        at = int(np.argmax(around))
    sizes = in_words(areas[at], areas.sum() - areas[at])
    why = shapely.is_valid_reason(polygon)
    return parts[at], (f"the boundary was not valid ({why}) and was repaired: {sizes}",)


def _named(rows: gpd.GeoDataFrame, name: str) -> np.ndarray:
    """Rows of a name: by the first column that has it, those that name parcels before others."""
    others = [c for c in rows.columns if c != rows.geometry.name and c not in _NAME_COLUMNS]
    hit = np.zeros(len(rows), bool)
    for column in [c for c in _NAME_COLUMNS if c in rows.columns] + others:
        hit = np.array([cell_text(value) == name for value in rows[column]], dtype=bool)
        if hit.any():
            break
    return hit
