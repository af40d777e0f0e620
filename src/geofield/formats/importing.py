"""Reading products and other people's files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import parse_crs
from geofield.errors import FormatError, FormatWarning, SeveralFieldsError
from geofield.formats.foreign_tables import obstacle_table
from geofield.formats.registry import detect, passed_over, product_files, products
from geofield.formats.zipped import unpacked
from geofield.model import Dataset
from geofield.model.obstacles import numbered
from geofield.model.review import reconcile
from geofield.notes import warn
from geofield.wording import some_of


def read_dataset(path: Path | str, *, crs: CRS | str | None = None) -> Dataset:
    """The dataset in a file or folder, in its metric CRS.

    Parameters
    ----------
    path : Path
        Of any format with a reader, recognised by suffix and content; also in a ZIP archive.
    crs : CRS or str, optional
        Of the coordinates, for files that do not say it (a Shapefile without ``.prj``).

    Raises
    ------
    FormatError
        When the file is not there, not known or damaged, or its CRS is in doubt.
    """
    place = Path(path)
    if place.suffix.lower() == ".zip" and place.is_file():
        with unpacked(place) as folder:
            inside = read_dataset(folder, crs=crs)
            if inside.points is None:
                return inside
            # Their file will be gone.
            points = {schema.TRACK_POINTS.name: inside.table(schema.TRACK_POINTS.name)}
            return replace(inside, tables={**inside.tables, **points}, points=None)
    found = detect(place)
    if place.is_dir() and (others := passed_over(place, found)):
        warn(
            f"Of {place} all {found.title} files are read, and nothing else: "
            f"{some_of(others, 5)} must be named to be read, too.",
            FormatWarning,
        )
    place = product_files(place, found)[0]
    reader = found.load_reader()
    if crs is None:
        return reader(place)
    if not found.asks_crs:
        raise FormatError(f"{found.title} files say their CRS themselves.", hint="Leave out --crs.")
    return reader(place, crs=parse_crs(crs))


def read_together(
    paths: Sequence[Path], *, crs: CRS | str | None = None, name: str | None = None
) -> Dataset:
    """The dataset of one field in several files, which together say what each of them holds.

    Several polygons of a file that could be outlines are obstacles where they lie in the one
    outline of another. Files that are read along with one of the others are read once.

    Raises
    ------
    FormatError
        As of `read_dataset` and `merged`.
    """
    read: list[Dataset] = []
    named = products(paths)
    doubtful: list[tuple[SeveralFieldsError, Dataset]] = []
    for path in named:
        try:
            read.append(read_dataset(path, crs=crs))
        except SeveralFieldsError as error:
            if error.as_obstacles is None or len(named) == 1:
                raise
            read.append(error.as_obstacles())
            doubtful.append((error, read[-1]))
    outlines = [each for each in read if each.has(schema.FIELD.name)]
    for several, dataset in doubtful:
        places = dataset.table(schema.OBSTACLES.name)
        around = [
            each for each in outlines if places.to_crs(each.crs).covered_by(_outer(each)).all()
        ]
        if len(around) != 1:
            raise several
    return merged(read, name=name)


def merged(datasets: Sequence[Dataset], *, name: str | None = None) -> Dataset:
    """One dataset from several: each layer from the one that has it, in the first's CRS.

    Parameters
    ----------
    datasets : sequence of Dataset
        Of the same field; obstacles of all are put together and numbered again when their
        numbers clash. An outline that lies in another one is an obstacle.
    name : str, optional
        The field's name.

    Raises
    ------
    FormatError
        When two of them have a field, or the same layer of tracks.
    """
    if len(datasets) == 1 and name is None:
        return datasets[0]
    first = datasets[0]
    notes = [note for dataset in datasets for note in dataset.notes]
    tables: dict[str, Any] = {}
    for dataset in _with_inner_fields_as_obstacles(datasets, first.crs, notes):
        for layer, table in dataset.tables.items():
            if not len(table):
                continue
            if layer not in tables:
                tables[layer] = table
            elif layer == schema.OBSTACLES.name:
                tables[layer] = pd.concat([tables[layer], table], ignore_index=True)
                if tables[layer]["obstacle_no"].duplicated().any():
                    tables[layer]["obstacle_no"] = pd.array(range(1, len(tables[layer]) + 1))
            else:
                raise FormatError(
                    f"Two of the files have a layer {layer!r}.", hint="Import one of them."
                )
    named = next((each for each in datasets if each.has(schema.FIELD.name)), first)
    if schema.FIELD.name in tables:
        row = tables[schema.FIELD.name]
        name = name or str(row["name"].iloc[0] if row["name"].notna().iloc[0] else named.name)
        tables[schema.FIELD.name] = row.assign(name=name)
    return replace(
        named,
        tables=tables,
        crs=first.crs,
        name=name or named.name,
        points=first.points,
        notes=tuple(notes),
    )


def _outer(dataset: Dataset) -> shapely.Polygon:
    """The outline of a dataset's field, whatever holes it has."""
    return shapely.Polygon(dataset.table(schema.FIELD.name).geometry.iloc[0].exterior)


def recorded(dataset: Dataset) -> Dataset:
    """A dataset with a record of its obstacles, by which it is known what is edited of them later.

    Of several fields, and where there is one already, it is handed back as it is.
    """
    evidence, table = dataset.provenance.evidence, dataset.table(schema.OBSTACLES.name)
    if "written" in evidence or not len(table) or not dataset.tracks_stand:
        return dataset
    obstacles, written = reconcile(table, None, dataset.grid)
    known = replace(dataset.provenance, evidence={**evidence, "written": written.to_json()})
    tables = {**dataset.tables, schema.OBSTACLES.name: obstacles}
    return replace(dataset, tables=tables, provenance=known)


def _with_inner_fields_as_obstacles(
    datasets: Sequence[Dataset], crs: CRS, notes: list[str]
) -> list[Dataset]:
    """The datasets in one CRS; of outlines that lie in another one, obstacles are made."""
    moved = [
        replace(each, crs=crs, tables={k: t.to_crs(crs) for k, t in each.tables.items()})
        for each in datasets
    ]
    fields = [each.table(schema.FIELD.name) for each in moved]
    outer = [_outer(each) if each.has(schema.FIELD.name) else None for each in moved]
    for number, shape in enumerate(outer):
        around = [other for other in outer if other is not None and other is not shape]
        if shape is None or not any(
            other.covers(shape) and other.area > shape.area for other in around
        ):
            continue
        dataset = moved[number]
        rest = {k: t for k, t in dataset.tables.items() if k != schema.FIELD.name}
        own = schema.own_columns(schema.FIELD, fields[number])
        # Its own name, or that of its file, is all that tells what it is.
        inner = obstacle_table(fields[number][["name", *own, "geometry"]], crs, Path(dataset.name))
        standing = [table for table in (dataset.table(schema.OBSTACLES.name), inner) if len(table)]
        inner["obstacle_no"] = pd.NA  # behind those that have numbers
        whole = numbered(pd.concat(standing, ignore_index=True))
        moved[number] = replace(
            dataset,
            tables={
                **rest,
                schema.OBSTACLES.name: schema.conform(schema.OBSTACLES, whole, extras=True),
            },
        )
        notes.append(f"{dataset.name}: its polygon lies in another one: taken as an obstacle")
    return moved
