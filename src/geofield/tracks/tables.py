"""From pieces in the track frame to the layers `tracks`, `segments` and `gaps`."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield import schema
from geofield.model.rows import Rows
from geofield.model.tracks import points_per_segment
from geofield.tracks.clip import Crossings, Pieces
from geofield.tracks.frame import FloatArray, TrackFrame
from geofield.tracks.losses import gap_causes
from geofield.tracks.shapes import IntArray

BORDER, BY_HAND = -(1 << 62), 1 - (1 << 62)
"""Among obstacle numbers, and none of a table's: the field's border, what a person took out."""


def segment_ends(pieces: Pieces, positions: FloatArray, frame: TrackFrame) -> FloatArray:
    """Ends of the pieces in the CRS: array of shape (pieces, 2 ends, 2 coordinates)."""
    return _ends(pieces.start, pieces.end, positions[pieces.track], frame)


def _ends(start: FloatArray, end: FloatArray, v: FloatArray, frame: TrackFrame) -> FloatArray:
    out = np.empty((len(start), 2, 2))
    out[:, 0, 0], out[:, 0, 1] = frame.to_crs(start, v)
    out[:, 1, 0], out[:, 1, 1] = frame.to_crs(end, v)
    return out


def segment_table(
    ends: FloatArray, track_no: IntArray, segment_no: IntArray, length_m: FloatArray, crs: CRS
) -> Rows:
    """Layer `segments`."""
    return Rows(
        schema.SEGMENTS,
        {"track_no": track_no, "segment_no": segment_no, "length_m": length_m},
        _lines(ends),
        crs,
    )


def line_table(
    ends: FloatArray,
    track_no: IntArray,
    length_m: FloatArray,
    *,
    heading_deg: float,
    step_m: float,
    crs: CRS,
) -> Rows:
    """Layer `tracks`: one row for each track with at least one segment."""
    columns, first = line_columns(track_no, length_m, step_m)
    columns["heading_deg"] = np.full(len(first), heading_deg)
    return Rows(schema.TRACKS, columns, _multi_lines(ends, first), crs)


def line_columns(
    track_no: IntArray, length_m: FloatArray, step_m: float
) -> tuple[dict[str, Any], IntArray]:
    """What segments, in the order of their tracks, tell of these; and the first one of each."""
    numbers, first, count = np.unique(track_no, return_index=True, return_counts=True)
    points = points_per_segment(length_m, step_m)
    return {
        "track_no": numbers,
        "segment_count": count,
        "gap_count": count - 1,
        "point_count": np.add.reduceat(points, first) if len(first) else points,
        "length_m": np.add.reduceat(length_m, first) if len(first) else length_m,
    }, first


def gap_table(
    pieces: Pieces,
    crossings: Crossings,
    positions: FloatArray,
    frame: TrackFrame,
    *,
    obstacle_no: IntArray,
    crs: CRS,
) -> Rows:
    """Layer `gaps`, each with its causes in words and its lowest obstacle number."""
    # Pieces that are followed by another one of the same track.
    before = np.flatnonzero(pieces.track[1:] == pieces.track[:-1])
    start, end = pieces.end[before], pieces.start[before + 1]
    track = pieces.track[before]
    gap_of_piece = np.zeros(len(pieces), dtype=np.int64)
    gap_of_piece[before] = np.arange(len(before))
    piece, owner = gap_causes(pieces, crossings)
    causes, lowest = _in_words(gap_of_piece[piece], owner, obstacle_no, len(before))
    return Rows(
        schema.GAPS,
        {
            "track_no": track + 1,
            "gap_no": _count_within(track),
            "length_m": end - start,
            "cause": causes,
            "obstacle_no": lowest,
        },
        _lines(_ends(start, end, positions[track], frame)),
        crs,
    )


def _in_words(
    gap: IntArray, owner: IntArray, obstacle_no: IntArray, count: int
) -> tuple[list[str], list[int | None]]:
    numbers: list[list[int]] = [[] for _ in range(count)]
    # The owner of the border comes last, too: counted from behind.
    number = np.append(obstacle_no, BORDER)[owner]
    for at, no in zip(gap.tolist(), number.tolist(), strict=True):
        numbers[at].append(no)
    told = [cause_in_words(each) for each in numbers]
    return [words for words, _ in told], [lowest for _, lowest in told]


def cause_in_words(numbers: Collection[int]) -> tuple[str, int | None]:
    """The causes of a gap, and the lowest number among them; the border's where there is none."""
    # Parts of one obstacle share its number.
    each = sorted(set(numbers) - {BORDER, BY_HAND})
    words = ["border"] if BORDER in numbers else []
    if each:
        words.append(f"obstacle{'s' if len(each) > 1 else ''} {', '.join(map(str, each))}")
    if BY_HAND in numbers:
        words.append("by hand")
    return ", ".join(words) or "border", each[0] if each else None


def _count_within(track: IntArray) -> IntArray:
    """1, 2, ... within each run of equal values."""
    if not len(track):
        return track
    new = np.append(True, track[1:] != track[:-1])
    index = np.arange(len(track))
    return np.asarray(index - np.maximum.accumulate(np.where(new, index, 0)) + 1)


def number_segments(pieces: Pieces) -> tuple[IntArray, IntArray]:
    """Track and segment numbers of the pieces, both from 1."""
    return pieces.track + 1, _count_within(pieces.track)


def _multi_lines(ends: FloatArray, first: IntArray) -> NDArray[np.object_]:
    """One multi-line per track, from the index of the first segment of each."""
    if not len(ends):
        return np.empty(0, dtype=object)
    # Many times faster than collecting lines that were made one by one.
    offsets = (np.arange(len(ends) + 1) * 2, np.append(first, len(ends)))
    kind = shapely.GeometryType.MULTILINESTRING
    return np.asarray(shapely.from_ragged_array(kind, ends.reshape(-1, 2), offsets))


def _lines(ends: FloatArray) -> NDArray[np.object_]:
    if not len(ends):
        return np.empty(0, dtype=object)
    return np.asarray(shapely.linestrings(ends))
