"""``geofield info``: what a file holds."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import click

from geofield.cli.console import echo_json
from geofield.cli.files import PATH
from geofield.errors import CRSError, FormatError, GridError, ImageryError
from geofield.strangers import picture_file


@click.command(
    epilog="""\b
Examples (on the project's own sample):
  geofield info sample_data/field_1.tif
  geofield info sample_data/field_1.gpkg --json
"""
)
@click.argument("file", type=PATH)
@click.option("--crs", help="CRS of a file that does not say its own, e.g. EPSG:32633.")
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON on stdout.")
def info(file: Path, crs: str | None, as_json: bool) -> None:
    """Show what FILE, a picture or vector file, holds: layers, rows, place, CRS, origin."""
    facts = _facts(file, crs)
    if as_json:
        echo_json(facts)
        return
    for key, value in facts.items():
        if isinstance(value, dict):
            click.echo(f"{key}:")
            for name, inner in value.items():
                click.echo(f"  {name}: {inner}")
        elif isinstance(value, list):
            click.echo("\n".join([f"{key}:", *(f"  {each}" for each in value)]))
        else:
            click.echo(f"{key}: {value}")


def _facts(file: Path, crs: str | None) -> dict[str, Any]:
    """What a file holds; one of no vector format that is known may be a picture of any kind."""
    from geofield.formats import detect
    from geofield.imagery.pictures import is_picture

    inner = picture_file(file) != file
    if inner or file.suffix.lower() in (".tif", ".tiff") or is_picture(file):
        return _picture(file)
    try:
        title = detect(file).title
    except FormatError as error:
        if not file.is_file():
            raise
        try:
            return _picture(file)
        except ImageryError:
            raise error from None
    return _vector(file, crs, title)


def _vector(file: Path, crs: str | None, title: str) -> dict[str, Any]:
    import numpy as np

    from geofield.crs import areas_anywhere_m2, authority_name
    from geofield.formats import read_dataset
    from geofield.formats.arrow import to_lonlat
    from geofield.model.field import Field
    from geofield.model.map_words import doubts_in_words

    dataset = read_dataset(file, crs=crs)
    field = dataset.table("field")
    facts: dict[str, Any] = {
        "file": str(file),
        "format": title,
        "name": dataset.name,
        "CRS" if len(field) > 1 else "metric CRS": (
            f"{authority_name(dataset.crs)} ({dataset.crs.name})"
        ),
        "rows": {
            layer.name: len(dataset.table(layer.name))
            for layer in dataset.layers(working=True)
            if dataset.has(layer.name)
        },
    }
    if len(field) > 1:
        areas_m2 = areas_anywhere_m2(field.geometry.to_numpy(), dataset.crs)
        facts["fields together"] = {"area (ha)": round(float(areas_m2.sum()) / 1e4, 4)}
    elif len(field):
        shape = field.geometry.iloc[0]
        # In metres: across 180 degrees the outline goes round the world in degrees.
        inside = np.array([shape.representative_point()], dtype=object)
        place = to_lonlat(inside, dataset.crs)[0]
        one = Field(shape, dataset.crs)
        facts["field"] = {
            "area (ha)": round(one.area_ha, 4),
            "perimeter (m)": round(one.perimeter_m, 1),
            "lat": round(place.y, 6),
            "lon": round(place.x, 6),
        }
    if len(field) and (told := doubts_in_words(dataset)):
        facts["check"] = told
    statuses = dataset.table("obstacles")["status"].value_counts(dropna=False).sort_index()
    if len(statuses):
        facts["obstacles"] = {
            key if isinstance(key, str) else "without a status": int(count)
            for key, count in statuses.items()
        }
    provenance = dataset.provenance
    source = provenance.source
    origin = {
        "software": provenance.software,
        "imagery": source.name,
        "date": source.date,
        "licence": source.licence,
        "attribution": source.attribution,
    }
    facts["origin"] = {key: text for key, text in origin.items() if text} or "not recorded"
    return facts


def _picture(file: Path) -> dict[str, Any]:
    from geofield.grid import Grid
    from geofield.imagery.gdal import gdal_env, open_picture, reading

    with gdal_env(str(file)), reading(str(file)), open_picture(str(file)) as picture:
        if not picture.count and picture.subdatasets:
            inner = list(picture.subdatasets)
            return {"file": str(file), "format": picture.driver, "pictures in it": inner}
        facts: dict[str, Any] = {
            "file": str(file),
            "format": picture.driver,
            "size": f"{picture.width} x {picture.height} px",
            "bands": ", ".join(
                f"{role.name} {kind}"
                for role, kind in zip(picture.colorinterp, picture.dtypes, strict=True)
            ),
            "CRS": str(picture.crs) if picture.crs else "not recorded",
        }
        tags = {key: value for key, value in picture.tags().items() if key != "AREA_OR_POINT"}
        if picture.transform.is_identity:
            # Pixels counted as metres would be a place, in the ocean.
            points = len(picture.gcps[0])
            facts["position"] = f"{points} ground control points" if points else "not recorded"
        elif picture.crs:
            # What has no place on the earth is shown without one.
            with suppress(CRSError, GridError):
                grid = Grid(picture.width, picture.height, picture.transform, picture.crs.to_wkt())
                lon, lat = grid.centre_lonlat
                facts |= {
                    "metres per pixel on the ground": round(grid.ground_resolution_m, 4),
                    "centre": {"lat": round(lat, 6), "lon": round(lon, 6)},
                }
    if tags:
        facts["tags"] = tags
    return facts
