"""What is known of a dataset's origin, as JSON: for formats with a place for it."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from typing import Any

from affine import Affine
from pyproj import CRS

from geofield.errors import FormatError
from geofield.grid import Grid
from geofield.model import Dataset, ImagerySource, Provenance

#: Version of this JSON.
VERSION = 1
#: Names this JSON where a format wants a URI.
URI = "https://geofield.dev/ns/origin/1"
#: Stands for an unknown day where a file must have one.
UNDATED = "1980-01-01"


def to_json(dataset: Dataset) -> str:
    """Name, CRS, grid and provenance of a dataset; the same text for the same dataset."""
    try:
        return json.dumps(content_of(dataset), ensure_ascii=False, indent=1)
    except (TypeError, ValueError) as error:
        raise FormatError(
            f"The provenance is not plain JSON: {error}.",
            hint="Settings and evidence are texts, numbers, lists and mappings.",
        ) from error


def content_of(dataset: Dataset) -> dict[str, Any]:
    """What the JSON says, as plain values."""
    grid = dataset.grid
    return {
        "version": VERSION,
        "name": dataset.name,
        "crs": dataset.crs.to_wkt(),
        "grid": None
        if grid is None
        else {
            "width_px": grid.width_px,
            "height_px": grid.height_px,
            "transform": list(grid.transform[:6]),
            "crs": grid.crs.to_wkt(),
        },
        "scene": None if dataset.scene_path is None else dataset.scene_path.name,
        "software": dataset.provenance.software,
        "source": dataclasses.asdict(dataset.provenance.source),
        "settings": dict(dataset.provenance.settings),
        "evidence": dict(dataset.provenance.evidence),
    }


@dataclasses.dataclass(frozen=True, slots=True)
class Origin:
    """The content of the JSON."""

    name: str
    crs: CRS
    grid: Grid | None
    scene: str | None
    provenance: Provenance


def from_json(text: str) -> Origin:
    """The content of the JSON.

    Raises
    ------
    FormatError
        When it is damaged or of a later version.
    """
    try:
        return from_content(json.loads(text))
    except ValueError as error:
        raise _damaged(error) from error


def from_content(content: Mapping[str, Any]) -> Origin:
    """The same from what the JSON says."""
    try:
        if content["version"] > VERSION:
            raise FormatError(
                "The file was written by a later version of geofield.", hint="Update geofield."
            )
        grid = content["grid"]
        source = dict(content["source"])
        source["details"] = tuple((str(k), str(v)) for k, v in source.get("details", ()))
        return Origin(
            content["name"],
            CRS.from_wkt(content["crs"]),
            None
            if grid is None
            else Grid(
                grid["width_px"],
                grid["height_px"],
                Affine(*grid["transform"]),
                CRS.from_wkt(grid["crs"]),
            ),
            content.get("scene"),
            Provenance(
                content["software"],
                ImagerySource(**source),
                content["settings"],
                content["evidence"],
            ),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise _damaged(error) from error


def _damaged(error: Exception) -> FormatError:
    what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
    return FormatError(
        f"What geofield noted in the file is damaged: {what}.",
        hint="Go on from the file as it was before. A copy without that note (ogr2ogr copy.gpkg "
        "FILE) is read as one of another program.",
    )


def restored(dataset: Dataset, record: Origin | None) -> Dataset:
    """A dataset read from tables with the origin that stood beside them.

    The grid comes back only where the coordinates are still those it was made for.
    """
    if record is None:
        return dataset
    return dataclasses.replace(
        dataset,
        provenance=record.provenance,
        grid=record.grid if record.crs == dataset.crs else None,
    )


def lineage(dataset: Dataset) -> str:
    """One line for people: the picture, its date, licence, attribution, what it did not show."""
    source = dataset.provenance.source
    words = [
        f"Imagery: {source.name}" if source.name else "",
        f"of {source.date}" if source.date else "",
        f"licence: {source.licence}" if source.licence else "",
        source.attribution,
        dataset.provenance.software,
        *dataset.provenance.obstacle_doubts,
    ]
    return "; ".join(word for word in words if word)


def timestamp(dataset: Dataset) -> str:
    """The time stamped where a file must have one, so that a second run is identical.

    Midnight UTC of the imagery's day, ISO 8601. Where nobody knows that day it is the earliest
    that ZIP archives can say, as the tools of reproducible builds write it.
    """
    return f"{dataset.provenance.source.day or UNDATED}T00:00:00.000Z"
