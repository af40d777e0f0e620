"""What a person changed of the tracks, and how it survives every re-run.

A person deletes a track or a piece of one in an editor, moves or bends one, draws a new one: in the
layer of tracks or in that of their segments. The difference from the record of what was written
is a word on the layout's line that it changed, and stays one while the layout has that line.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import shapely
from pyproj import CRS

from geofield import schema
from geofield.crs import reproject, transformer
from geofield.model.own_values import own_values
from geofield.model.segment_values import SegmentValues, values_in
from geofield.model.tracks_written import (
    Place,
    TracksWritten,
    Vertices,
    among,
    as_text,
    track_numbers,
)

if TYPE_CHECKING:
    import geopandas as gpd


class TrackEdit(NamedTuple):
    """What a person made of one track."""

    track_no: int
    #: The track as drawn, whatever stands in it: a MultiLineString as WKT, metric CRS.
    drawn: str | None = None
    #: Pieces of the layout's line that are not driven: the same.
    cut: str | None = None
    #: Of the layout's line; None for a track that was added.
    place: Place | None = None
    #: Values of a person's own columns, plain JSON.
    own: Mapping[str, Any] | None = None

    @property
    def away(self) -> bool:
        """Whether the whole track was taken away."""
        return self.drawn is None and self.cut is None and self.own is None


@dataclass(frozen=True, slots=True)
class TrackEdits:
    """All that a person changed of a field's tracks.

    Attributes
    ----------
    edits : tuple of TrackEdit
        By track number.
    apart : tuple of TrackEdit
        Of lines that the layout in use does not have: they wait for the one that has them.
    beside : tuple of SegmentValues
        What stands in columns of a person's own beside segments.
    """

    edits: tuple[TrackEdit, ...] = ()
    apart: tuple[TrackEdit, ...] = ()
    beside: tuple[SegmentValues, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.edits or self.apart or self.beside)

    @property
    def by_number(self) -> dict[int, TrackEdit]:
        """The edits in use by their tracks' numbers."""
        return {each.track_no: each for each in self.edits}

    def in_words(self) -> str:
        """What is in use, one line for people; empty where nothing was changed."""
        kinds = (
            ("taken away", [one for one in self.edits if one.away]),
            ("shortened", [one for one in self.edits if one.cut is not None]),
            ("drawn", [one for one in self.edits if one.drawn is not None]),
        )
        words = [f"{_numbers(some)} {what}" for what, some in kinds if some]
        return f"tracks of yours kept: {', '.join(words)}" if words else ""

    def reprojected(self, source: CRS, target: CRS) -> TrackEdits:
        """The same in another metric CRS."""
        if source == target or not self:
            return self
        project = transformer(source, target)

        def moved(text: str | None) -> str | None:
            return text and as_text(reproject(shapely.from_wkt(text), source, target))

        def there(place: Place | None) -> Place | None:
            return place and Place(*project.transform(place.x, place.y), *place[2:])

        def all_of(some: tuple[TrackEdit, ...]) -> tuple[TrackEdit, ...]:
            return tuple(
                one._replace(drawn=moved(one.drawn), cut=moved(one.cut), place=there(one.place))
                for one in some
            )

        beside = tuple(
            one._replace(line=as_text(reproject(shapely.from_wkt(one.line), source, target)))
            for one in self.beside
        )
        return TrackEdits(all_of(self.edits), all_of(self.apart), beside)

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values; see :meth:`from_json`."""
        beside = [[one.line, dict(one.own)] for one in self.beside]
        return {"edits": _listed(self.edits), "apart": _listed(self.apart), "beside": beside}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> TrackEdits:
        """The edits that were written with :meth:`to_json`."""
        edits, apart = (_unlisted(value.get(name, ())) for name in ("edits", "apart"))
        beside = tuple(SegmentValues(str(line), own) for line, own in value.get("beside", ()))
        return cls(edits, apart, beside)


def edits_in(
    lines: gpd.GeoDataFrame,
    segments: gpd.GeoDataFrame,
    written: TracksWritten,
    known: TrackEdits,
) -> TrackEdits:
    """Read what a person changed since the tracks were written, after what was known before.

    A layer without any row of a planned track is no word on any one of them, as if it were as it
    was written; what was drawn in it counts, and so does all that was changed in the other. Where
    one track was changed in both, its segments count: they are what is driven.
    """
    if written.are(lines, segments) and not any(one.own for one in known.edits):
        return replace(known, beside=values_in(segments, known.beside, written.spacing_m))
    parts, row_of, loose_rows = _rows_by_number(lines, written)
    as_lines = {no: parts[row] for no, row in row_of.items()}
    as_segments, loose = _segments_by_number(segments)
    own = own_values(schema.TRACKS, lines)
    said: dict[int, Mapping[str, Any]] = {no: own[row] for no, row in row_of.items() if row in own}
    if not as_lines:
        as_lines = dict(written.segments)
        said |= {one.track_no: one.own for one in known.edits if one.own}
    if not as_segments:
        as_segments = dict(written.segments)
    # Columns of a track that has a row are read anew: they may say something else.
    edits = {
        no: one._replace(own=None) if no in written.segments else one
        for no, one in known.by_number.items()
        if no not in written.segments or one.own is None or one.drawn or one.cut
    }
    for no, before in written.segments.items():
        change = _change(before, as_lines.pop(no, None), as_segments.pop(no, []), edits.get(no))
        if change is not None:
            earlier = edits.pop(no, None)
            place = written.place(no) if earlier is None else earlier.place
            # A track that was added and is taken away is forgotten.
            if place is not None or not change.away:
                edits[no] = change._replace(track_no=no, place=place)
    for no, shape in (as_segments | as_lines).items():
        place = edits[no].place if no in edits else None
        edits[no] = TrackEdit(no, as_text(_multi(shape)), place=place)
    free = max([*edits, *written.segments, 0]) + 1
    # A piece drawn without a number is a track of its own, in whichever layer.
    said |= {no: own[row] for no, row in enumerate(loose_rows, start=free) if row in own}
    drawn = [*(parts[row] for row in loose_rows), *([each] for each in loose)]
    edits |= {no: TrackEdit(no, as_text(_multi(one))) for no, one in enumerate(drawn, start=free)}
    _write_own(edits, said, written)
    # What stands beside segments of a track that was taken away goes with it.
    left = segments[~segments["track_no"].isin([no for no, one in edits.items() if one.away])]
    beside = values_in(left, known.beside, written.spacing_m)
    return TrackEdits(tuple(edits[no] for no in sorted(edits)), known.apart, beside)


def changed_twice(
    lines: gpd.GeoDataFrame, segments: gpd.GeoDataFrame, written: TracksWritten
) -> tuple[int, ...]:
    """The tracks that a person changed in both layers, in each another way.

    Parameters are those of :func:`edits_in`, by which the segments count.
    """
    parts, row_of, _ = _rows_by_number(lines, written)
    as_segments, _ = _segments_by_number(segments)
    if not row_of or not as_segments:
        return ()
    found = []
    for no, before in written.segments.items():
        line = parts[row_of[no]] if no in row_of else []
        pieces = as_segments.get(no, [])
        if not (_same(line, before) or _same(pieces, before) or _same(line, pieces)):
            found.append(no)
    return tuple(found)


def _write_own(
    edits: dict[int, TrackEdit], own: Mapping[int, Mapping[str, Any]], written: TracksWritten
) -> None:
    """Note the values of own columns beside what else was changed of their tracks."""
    for no, values in own.items():
        if no in edits and not edits[no].away:
            edits[no] = edits[no]._replace(own=values)
        elif no in written.segments and no not in edits:
            edits[no] = TrackEdit(no, place=written.place(no), own=values)


def _change(
    before: Sequence[Vertices],
    line: list[Vertices] | None,
    pieces: list[Vertices],
    earlier: TrackEdit | None,
) -> TrackEdit | None:
    """What became of a track, or None: its number and place are not known here."""
    left = [one for one in pieces if among(one, before)]
    new = len(left) < len(pieces)
    if len(left) == len(before) and not new:
        if line is None:
            return TrackEdit(0)
        change = None if _same(line, before) else _of_drawn(before, line)
    elif not pieces or (line is None and not new):
        return TrackEdit(0)
    else:
        change = _of_drawn(before, pieces)
    if change is not None and change.cut is not None and earlier is not None:
        # A piece of what was drawn, or of what was shortened before, is taken away.
        return _further(earlier, change.cut, pieces if len(left) < len(before) else line or [])
    return change


def _of_drawn(before: Sequence[Vertices], now: list[Vertices]) -> TrackEdit:
    """Pieces of a track that are left, or a track that was drawn anew."""
    if all(among(one, before) for one in now):
        cut = [one for one in before if not among(one, now)]
        return TrackEdit(0, cut=as_text(_multi(cut)))
    return TrackEdit(0, drawn=as_text(_multi(now)))


def _further(earlier: TrackEdit, cut: str, left: list[Vertices]) -> TrackEdit:
    """An edit of a track that had been edited before."""
    if earlier.drawn is not None:
        return TrackEdit(0, drawn=as_text(_multi(left)))
    pieces = [*parts_of(earlier.cut), *parts_of(cut)]
    return TrackEdit(0, cut=as_text(shapely.MultiLineString(pieces)))


def _rows_by_number(
    lines: gpd.GeoDataFrame, written: TracksWritten
) -> tuple[dict[int, list[Vertices]], dict[int, int], list[int]]:
    """Parts of the rows of tracks by their position; rows by track number; those without one.

    A copied row has the number of the one that it was copied from: of several rows with one
    number, that which is as written has it, or else the first.
    """
    parts = {row: one for row, one in enumerate(map(_parts, lines.geometry)) if one}
    numbers = track_numbers(lines)
    row_of: dict[int, int] = {}
    loose: list[int] = []
    for row, one in parts.items():
        no = numbers[row]
        if no < 1:
            loose.append(row)
        elif no not in row_of:
            row_of[no] = row
        elif _same(one, written.segments.get(no, ())):
            loose.append(row_of[no])
            row_of[no] = row
        else:
            loose.append(row)
    return parts, row_of, loose


def _segments_by_number(
    segments: gpd.GeoDataFrame,
) -> tuple[dict[int, list[Vertices]], list[Vertices]]:
    """Vertices of segments by track number, and of those without one."""
    found: dict[int, list[Vertices]] = {}
    loose: list[Vertices] = []
    for no, shape in zip(track_numbers(segments), segments.geometry, strict=True):
        (loose if no < 1 else found.setdefault(no, [])).extend(_parts(shape))
    return {no: parts for no, parts in found.items() if parts}, loose


def _parts(shape: Any) -> list[Vertices]:
    """The vertices of the parts of a line."""
    parts = (shapely.get_coordinates(one) for one in shapely.get_parts(shape))
    return [one for one in parts if len(one) > 1]


def _same(some: Sequence[Vertices], others: Sequence[Vertices]) -> bool:
    return len(some) == len(others) and all(among(one, others) for one in some)


def _multi(lines: Sequence[Vertices]) -> shapely.MultiLineString:
    return shapely.MultiLineString(list(lines))


def parts_of(text: str | None) -> list[Any]:
    """The lines of a MultiLineString as WKT."""
    return [] if text is None else list(shapely.get_parts(shapely.from_wkt(text)))


def _listed(edits: Iterable[TrackEdit]) -> list[Any]:
    return [
        [*one[:3], None if one.place is None else [*one.place], one.own and dict(one.own)]
        for one in edits
    ]


def _unlisted(rows: Iterable[Sequence[Any]]) -> tuple[TrackEdit, ...]:
    return tuple(
        TrackEdit(int(no), drawn, cut, None if place is None else Place(*place), own)
        for no, drawn, cut, place, own in rows
    )


def _numbers(some: Sequence[TrackEdit]) -> str:
    numbers = [str(one.track_no) for one in some]
    return ", ".join(numbers) if len(numbers) <= 5 else f"{len(numbers)}"
