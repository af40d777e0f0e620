"""Rows of tracks and segments whose numbers another program lost, known by where they lie."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield import schema
from geofield.crs import ground_lengths_m
from geofield.errors import FormatWarning
from geofield.model.tracks_written import TracksWritten, run_alike, track_numbers
from geofield.model.written import SAME_M
from geofield.notes import warn
from geofield.wording import counted

if TYPE_CHECKING:
    import geopandas as gpd

#: A line without a number is that of the track beside which it lies so near, of the spacing.
_NEAR = 0.25


def known_by_shape(
    of: schema.Layer, rows: gpd.GeoDataFrame, written: TracksWritten
) -> gpd.GeoDataFrame:
    """The rows of a layer, each with the number of the track on which it was written.

    That is so where no row has a number, and where one has more lines than its track: a layer
    dissolved into one row. The layer is `tracks` or `segments`; its other columns of such rows are
    empty.
    """
    import pandas as pd

    rows = _once(of, rows)
    numbers, shapes = np.array(track_numbers(rows)), rows.geometry.to_numpy()
    most = [len(written.segments.get(no, ())) if of is schema.TRACKS else 1 for no in numbers]
    lost = shapely.get_num_geometries(shapes) > np.maximum(most, 1)
    unnumbered = not numbers.any()
    lost |= unnumbered
    if not lost.any() or not written.rows:
        return rows
    lines, row = shapely.get_parts(shapely.force_2d(shapes[lost]), return_index=True)
    lines, row = _rejoined(lines, np.flatnonzero(lost)[row], _lines_of(written)[1])
    near_m = _NEAR * written.spacing_m if unnumbered else 0.0
    number, lines = _numbered(lines, numbers[row], written, near_m)
    if unnumbered and not number.any():
        return rows  # all drawn anew
    first: NDArray[np.intp] = np.arange(len(lines))
    whole: Any = lines
    if of is schema.TRACKS:
        group = np.unique(np.where(number > 0, number, -1 - row), return_inverse=True)[1]
        first = np.unique(group, return_index=True)[1]
        order = np.argsort(group, kind="stable")
        whole = shapely.multilinestrings(lines[order], indices=group[order])
    names = schema.own_columns(of, rows)
    found = schema.table(
        of,
        {"track_no": [int(no) or None for no in number[first]]},
        whole,
        rows.crs,
        {name: rows[name].array[row[first]] for name in names},
    )
    return schema.conform(of, pd.concat([rows[~lost], found]), extras=True)


def _once(of: schema.Layer, rows: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """The rows without copies that say and are the same, as of two files in one, which is told."""
    import pandas as pd

    shapes = pd.Series(shapely.to_wkb(rows.geometry.to_numpy()), rows.index)
    if not shapes.duplicated().any():
        return rows
    said = rows[["track_no", *schema.own_columns(of, rows)]].astype("string").assign(shape=shapes)
    copy = (said.duplicated() & rows["track_no"].notna()).to_numpy(bool)
    if not copy.any():
        return rows
    warn(
        f"Layer {of.name!r}: {counted(int(copy.sum()), 'row is', 'rows are')} copied in place and "
        "count once.",
        FormatWarning,
    )
    return rows[~copy].reset_index(drop=True)


def numbered(tracks: gpd.GeoDataFrame, segments: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """Segments that all have numbers and lengths: of the track that they are of, else new ones.

    For files that keep no record of what was written: the tracks of the field, with their numbers,
    are it.
    """
    import pandas as pd

    if not segments[["track_no", "segment_no"]].isna().any(axis=None):
        return segments
    known = tracks[tracks["track_no"].notna()]
    lines, row = shapely.get_parts(known.geometry.to_numpy(), return_index=True)
    x, y = shapely.get_coordinates(lines).mean(axis=0) if len(lines) else (0.0, 0.0)
    written = TracksWritten.of(
        known["track_no"].to_numpy()[row],
        lines,
        heading_deg=0.0,
        spacing_m=0.0,
        middle=(float(x), float(y)),
    )
    rows = known_by_shape(schema.SEGMENTS, segments, written)
    numbers = np.array(track_numbers(rows))
    drawn = numbers < 1
    numbers[drawn] = max([*numbers, *written.segments, 0]) + 1 + np.arange(drawn.sum())
    rows = rows.assign(track_no=pd.array(numbers, dtype="Int64"))
    lost = rows["segment_no"].isna()
    of_lost = rows["track_no"].isin(rows["track_no"][lost])
    count = rows.groupby("track_no").cumcount() + 1
    length = ground_lengths_m(rows.geometry.to_numpy(), CRS(rows.crs))
    return rows.assign(
        segment_no=rows["segment_no"].where(~of_lost, count),
        length_m=rows["length_m"].where(~lost, length),
    )


def _lines_of(written: TracksWritten) -> tuple[list[int], NDArray[np.object_]]:
    """The segments that were written, and the numbers of their tracks."""
    every = [(no, one) for no, some in written.segments.items() for one in some]
    lines = np.array([shapely.LineString(one) for _, one in every], object)
    return [no for no, _ in every], lines


def _rejoined(
    lines: NDArray[np.object_], row: NDArray[np.intp], before: NDArray[np.object_]
) -> tuple[NDArray[np.object_], NDArray[np.intp]]:
    """Lines without the cuts that a dissolve makes where one that was drawn crosses others."""
    line, other = shapely.STRtree(before).query(lines, "dwithin", SAME_M)
    on = shapely.covered_by(lines[line], shapely.buffer(before[other], SAME_M))
    of = np.full(len(lines), -1)
    of[line[on]] = other[on]
    group = np.unique(np.column_stack([row, of]), axis=0, return_inverse=True)[1].ravel()
    cut = (of >= 0) & (np.bincount(group)[group] > 1)
    if not cut.any():
        return lines, row
    again = cut | ((of < 0) & np.isin(row, row[cut]))
    joined, rows = [lines[~again]], [row[~again]]
    for one in np.unique(group[again]):
        whole = shapely.line_merge(shapely.multilinestrings(lines[group == one]), directed=True)
        of_one = of[group == one][0]
        if of_one >= 0 and shapely.hausdorff_distance(whole, before[of_one]) <= SAME_M:
            whole = before[of_one]  # without the vertices where it was cut
        joined.append(shapely.get_parts(whole))
        rows.append(np.full(len(joined[-1]), row[group == one][0]))
    return np.concatenate(joined), np.concatenate(rows)


def _numbered(
    lines: NDArray[np.object_], numbers: NDArray[np.int64], written: TracksWritten, near_m: float
) -> tuple[NDArray[np.int64], NDArray[np.object_]]:
    """Numbers of lines, and the lines in the direction in which they were written."""
    numbers, lines = numbers.copy(), lines.copy()
    names, before = _lines_of(written)
    line, other = shapely.STRtree(before).query(lines, "dwithin", max(near_m, SAME_M))
    same = shapely.equals_exact(lines[line], before[other], SAME_M)
    same |= shapely.equals_exact(shapely.reverse(lines[line]), before[other], SAME_M)
    middle = shapely.line_interpolate_point(lines[line], 0.5, normalized=True)
    away = np.where(same, -1.0, shapely.distance(middle, before[other]))
    # One that was drawn across lies nowhere nearer to a track than where it meets it.
    away[~same & ~run_alike(lines[line], before[other])] = np.inf
    found: set[int] = set()
    taken: set[int] = set()
    # What is as it was written comes first: a line beside it was drawn.
    for at in np.argsort(away, kind="stable")[: int((away <= near_m).sum())].tolist():
        if line[at] in found or other[at] in taken:
            continue
        found.add(line[at])
        taken.add(other[at])
        numbers[line[at]] = names[other[at]]
        if same[at]:
            lines[line[at]] = before[other[at]]
    return numbers, lines
