"""Fields as rows of the layers `field` and `alternatives`, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import shapely

from geofield import schema
from geofield.crs import ground_areas_m2
from geofield.errors import FormatError
from geofield.model.dataset import Dataset
from geofield.model.evidence import quality_from_json
from geofield.model.field import Alternative, Field, refuse_no_areas
from geofield.model.own_values import first_of
from geofield.model.rows import Rows

if TYPE_CHECKING:
    import geopandas as gpd


def alternatives_rows(field: Field) -> Rows:
    """Layer `alternatives`: the outlines that may be meant."""
    polygons = [one.polygon for one in field.alternatives]
    return Rows(
        schema.ALTERNATIVES,
        {
            "alternative_no": list(range(1, len(polygons) + 1)),
            "area_ha": ground_areas_m2(polygons, field.crs) / 10_000.0,
            "certainty": [one.certainty for one in field.alternatives],
        },
        polygons,
        field.crs,
    )


def field_from_row(rows: gpd.GeoDataFrame, dataset: Dataset, evidence: Mapping[str, Any]) -> Field:
    """The field that a row of the layer `field` describes, edited or not."""
    row = rows.iloc[0]

    def text(name: str) -> str:
        value = row.get(name)
        return value if isinstance(value, str) else ""

    return Field(
        polygon=_single_polygon(row.geometry),
        crs=dataset.crs,
        name=text("name"),
        field_id=text("field_id"),
        method=text("method") or "given",
        quality=quality_from_json(evidence),
        imagery=text("imagery"),
        imagery_date=text("imagery_date") or None,
        licence=text("licence"),
        own=tuple((name, first_of(rows[name])) for name in schema.own_columns(schema.FIELD, rows)),
        alternatives=_alternatives(dataset.tables.get(schema.ALTERNATIVES.name)),
    )


def _alternatives(rows: gpd.GeoDataFrame | None) -> tuple[Alternative, ...]:
    """The alternatives that were written, by number."""
    if rows is None or not len(rows):
        return ()
    rows = rows.sort_values("alternative_no")
    pairs = zip(rows.geometry, rows["certainty"], strict=True)
    return tuple(Alternative(_single_polygon(shape), float(sure)) for shape, sure in pairs)


def _single_polygon(geometry: shapely.Geometry) -> shapely.Polygon:
    """The one polygon of a geometry: editors like to save multi-polygons."""
    parts = shapely.get_parts(geometry) if geometry is not None else []
    if len(parts) != 1:
        raise FormatError(
            f"The field's outline has {len(parts)} parts; a plan needs one polygon.",
            hint="Delete or merge parts in the field layer.",
        )
    refuse_no_areas(parts)
    return shapely.Polygon(parts[0])
