"""Checking products: the rules of their format, and whether the plan in them fits together."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import shapely

from geofield import schema
from geofield.crs import ground_lengths_m
from geofield.errors import (
    EmptyFileError,
    FormatError,
    FormatWarning,
    GeofieldError,
    SeveralFieldsError,
)
from geofield.formats.clear_way import DRIVEN, WITHIN, driven_through, leaving
from geofield.formats.format import Format
from geofield.formats.importing import read_dataset
from geofield.formats.many import apart
from geofield.formats.registry import detect, product_files
from geofield.formats.zipped import unpacked
from geofield.model import Dataset
from geofield.model.evidence import Evidence
from geofield.model.field import refuse_no_areas
from geofield.model.obstacles import LINE_HALF_WIDTH_M, POINT_RADIUS_M
from geofield.model.resized import widened
from geofield.model.searched import unsearched
from geofield.notes import listening
from geofield.wording import counted

if TYPE_CHECKING:
    import geopandas as gpd

#: Sums and lengths may differ so much from what a column says, metres.
LENGTH_TOLERANCE_M = 0.05


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that is wrong (``error``) or worth a look (``warning``), and where."""

    level: Literal["error", "warning"]
    where: str
    message: str


def validate_file(path: Path | str) -> list[Finding]:
    """All findings in a product.

    Parameters
    ----------
    path : Path
        A file or folder of any format.

    Returns
    -------
    list of Finding
        The format's own rules first; empty when there is no fault.

    Raises
    ------
    FormatError
        When there is no such file or its format is not known.
    """
    place = Path(path)
    if place.suffix.lower() == ".zip" and place.is_file():
        with unpacked(place) as folder:
            return validate_file(folder)
    if place.suffix.lower() == ".qgz" and place.is_file():
        return [_of_project(place)]
    found = detect(place)
    place, *others = product_files(place, found)
    check = found.load_validator()
    findings: list[Finding] = []
    try:
        for file in (place, *others):
            findings.extend(() if check is None else check(file))
    except FormatError as error:
        findings.append(Finding("error", place.name, str(error)))
    if found.reader is None:
        if check is None:
            findings.append(Finding("warning", place.name, f"there is no check for {found.title}"))
        return findings
    # Where the format's own rules are broken already, that is why it cannot be read.
    broken = any(each.level == "error" for each in findings)
    try:
        readers = found.readers(place)
    except GeofieldError:
        readers = []  # the reader tells why
    if len(readers) < 2:
        return findings + _of_content(partial(read_dataset, place), place, found, broken=broken)
    of_each = ((name, _of_content(read, place, found, broken=broken)) for name, read in readers)
    return findings + [_in_field(name, each) for name, these in of_each for each in these]


def _of_content(
    read: Callable[[], Dataset], place: Path, found: Format, *, broken: bool
) -> list[Finding]:
    """What there is to say of what a file holds."""
    try:
        with listening() as heard:
            dataset = read()
            fields = _fields(dataset, place)
    except EmptyFileError:
        # As a layer of a plan without obstacles is: there is nothing that could not fit together.
        return [Finding("warning", place.name, "holds no geometries")]
    except SeveralFieldsError as error:
        words = f"{error} Each field's own rules were not checked."
        return [Finding("warning", place.name, words)]
    except GeofieldError as error:
        return [] if broken else [Finding("error", place.name, str(error))]
    findings = [
        Finding("warning", place.name, str(each).removeprefix(f"{place.name}: "))
        for each in heard
        if isinstance(each, FormatWarning)
    ]
    # Where there is no outline, obstacles are mere places: of unknown size, as in GPX.
    with_segments = {"field", "segments"} <= set(found.layers)
    for one in fields:
        of_one = check_dataset(one, with_segments=with_segments)
        findings += [_in_field(one.name, each) if len(fields) > 1 else each for each in of_one]
    return findings


def _in_field(name: str, finding: Finding) -> Finding:
    return replace(finding, where=f"{name}, {finding.where}")


def _of_project(project: Path) -> Finding:
    """What there is to say of a QGIS project: it shows the GeoPackage of the same name."""
    shown = project.with_suffix(".gpkg")
    if not shown.is_file():
        return Finding("error", project.name, f"{shown.name}, which it shows, is not beside it")
    return Finding(
        "warning",
        project.name,
        f"there is no check for QGIS projects; check {shown.name}, which it shows",
    )


def _fields(dataset: Dataset, place: Path) -> list[Dataset]:
    """The fields of a dataset, each by itself."""
    fields = apart(dataset)
    ids = fields[0].table(schema.FIELD.name)["field_id"]
    count = len(ids)
    if ids.dropna().duplicated().any():
        raise FormatError(
            f"{place.name} has several rows of one field.",
            hint="Merge or delete rows of its layer `field`.",
        )
    if count > 1:
        raise SeveralFieldsError(
            f"{place.name} holds {count} fields.", hint="Save each as a file of its own."
        )
    return fields


def check_dataset(dataset: Dataset, *, with_segments: bool = True) -> Iterator[Finding]:
    """Whether the tables of a plan fit together.

    `with_segments` is false for formats that hold whole lines, which do cross obstacles.
    """
    for name, table in dataset.tables.items():
        layer = schema.layer(name)
        yield from _check_rows(layer, table)
    if schema.FIELD.name in dataset.tables:
        yield from _check_outlines(dataset.table(schema.FIELD.name))
    if dataset.has(schema.OBSTACLES.name):
        yield from _check_areas(dataset.table(schema.OBSTACLES.name))
    if with_segments:
        yield from _check_obstacles(dataset)
        yield from _check_searched(dataset)
        yield from _check_tracks(dataset)


def _check_outlines(fields: gpd.GeoDataFrame) -> Iterator[Finding]:
    if not len(fields):
        yield Finding("error", schema.FIELD.name, "no row has an outline")
    try:
        refuse_no_areas(fields.geometry.dropna())
    except GeofieldError as error:
        yield Finding("error", schema.FIELD.name, str(error))


def _check_rows(layer: schema.Layer, table: gpd.GeoDataFrame) -> Iterator[Finding]:
    shapes = np.asarray(table.geometry.to_numpy(), dtype=object)
    bad = ~shapely.is_valid(shapes)
    for row in np.flatnonzero(bad)[:5]:
        yield Finding(
            "error",
            f"{layer.name}, row {row + 1}",
            f"the shape is not valid: {shapely.is_valid_reason(shapes[row])}",
        )
    if len(shapes) and not np.isfinite(shapely.get_coordinates(shapes)).all():
        yield Finding("error", layer.name, "a coordinate is not a number")
    keys = table[list(layer.key)]
    missing = keys.isna().any(axis=1)
    if missing.any():
        yield Finding(
            "warning",
            layer.name,
            f"{counted(int(missing.sum()), 'row has', 'rows have')} no "
            f"{', '.join(layer.key)}: drawn by a person?",
        )
    # In a file of several fields each numbers its own.
    owner = ["field_id"] if "field_id" in table.columns.difference(layer.key) else []
    double = table[[*owner, *layer.key]][~missing].duplicated()
    if double.any():
        first = keys[~missing][double].iloc[0].to_dict()
        yield Finding("error", layer.name, f"two rows have the same key {first}")
    for column in layer.columns:
        if column.values:
            values = set(table[column.name].dropna()) - set(column.values)
            if values:
                yield Finding(
                    "error",
                    f"{layer.name}.{column.name}",
                    f"{sorted(values)[0]!r} is none of {', '.join(column.values)}",
                )


def _check_areas(obstacles: gpd.GeoDataFrame) -> Iterator[Finding]:
    """What counts as an area though it is drawn as none."""
    dimension = shapely.get_dimensions(np.asarray(obstacles.geometry.to_numpy(), dtype=object))
    for of, words in (
        (0, f"is a point: a circle of radius_m ({POINT_RADIUS_M:g} m where empty) and buffer_m"),
        (1, f"is a line: a strip of radius_m (at least {LINE_HALF_WIDTH_M:g} m) and buffer_m to "
            "both sides"),
    ):  # fmt: skip
        for row in np.flatnonzero(dimension == of)[:5]:
            yield Finding("warning", f"{schema.OBSTACLES.name}, row {row + 1}", words)


def _check_obstacles(dataset: Dataset) -> Iterator[Finding]:
    if dataset.has(schema.OBSTACLES.name):
        with listening(FormatWarning):  # sizes are found already
            areas = widened(dataset.table(schema.OBSTACLES.name))
        dataset = replace(dataset, tables={**dataset.tables, schema.OBSTACLES.name: areas})
    for layer, (number, one, _) in DRIVEN.items():
        lines = dataset.table(layer)
        for line, obstacle in driven_through(dataset, layer)[:5]:
            row = lines.iloc[line]
            segment = f", segment {row['segment_no']}" if "segment_no" in lines else ""
            yield Finding(
                "error",
                f"{layer}, {one} {row[number]}{segment}",
                f"runs through {obstacle}: plan the tracks again (geofield tracks)",
            )


def _check_searched(dataset: Dataset) -> Iterator[Finding]:
    """Whether obstacles were searched in all of the outline."""
    field = dataset.table(schema.FIELD.name)
    searched = Evidence.from_json(dataset.provenance.evidence).searched
    if len(field) == 1 and field.geometry.is_valid.all():
        gained = unsearched(searched, field.geometry.iloc[0], dataset.crs)
        if gained:
            yield Finding("warning", schema.FIELD.name, f"{gained} Search it (geofield obstacles)")


def _check_tracks(dataset: Dataset) -> Iterator[Finding]:
    for layer in WITHIN:
        outside = leaving(dataset, layer)
        if len(outside):
            yield Finding(
                "error",
                layer,
                f"{len(outside)} leave the field: plan the tracks again (geofield tracks)",
            )
    segments = dataset.table("segments")
    tracks = dataset.table("tracks")
    if not len(tracks) or not len(segments):
        return
    sums = (
        segments.assign(length=ground_lengths_m(segments.geometry.to_numpy(), dataset.crs))
        .groupby("track_no")["length"]
        .sum()
    )
    # Several fields number theirs alike.
    told = tracks.groupby("track_no")["length_m"].sum(min_count=1).astype("float64")
    both = told.index.intersection(sums.index)
    off = (told[both] - sums[both]).abs() > LENGTH_TOLERANCE_M
    for number in both[off][:5]:
        yield Finding(
            "error",
            f"tracks, track {number}",
            f"length_m is {told[number]:.2f}, its segments measure {sums[number]:.2f}",
        )
    apart = (
        ("segments", sums.index.difference(told.index), "is not in layer tracks"),
        ("tracks", told.index.difference(sums.index), "has no segments"),
    )
    for layer, numbers, what in apart:
        for number in numbers[:5]:
            yield Finding(
                "error", layer, f"track {number} {what}: plan the tracks again (geofield tracks)"
            )
