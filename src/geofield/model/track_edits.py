"""What a person changed of the tracks, and how it survives every re-run.

A person deletes a track or a piece of one in an editor, moves or bends one, draws a new one: in the
layer of tracks or in that of their segments. The difference from the record of what was written
is a word on the layout's line that it changed, and stays one while the layout has that line.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield.crs import reproject, transformer

if TYPE_CHECKING:
    import geopandas as gpd

#: A vertex farther than this from the one that was written was moved by a person, metres.
SAME_M = 0.002
_DECIMALS = 3

#: The vertices of a line, (n, 2), metric CRS.
Vertices = NDArray[np.float64]


class Place(NamedTuple):
    """A line of a layout: a point on it beside the field's middle, and how the layout runs."""

    x: float
    y: float
    heading_deg: float
    spacing_m: float


class TrackEdit(NamedTuple):
    """What a person made of one track.

    Without `drawn` and `cut` the whole track was taken away.
    """

    track_no: int
    #: The track as drawn, whatever stands in it: a MultiLineString as WKT, metric CRS.
    drawn: str | None = None
    #: Pieces of the layout's line that are not driven: the same.
    cut: str | None = None
    #: Of the layout's line; None for a track that was added.
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class TrackEdits:
    """All that a person changed of a field's tracks.

    Attributes
    ----------
    edits : tuple of TrackEdit
        By track number.
    apart : tuple of TrackEdit
        Of lines that the layout in use does not have: they wait for the one that has them.
    """

    edits: tuple[TrackEdit, ...] = ()
    apart: tuple[TrackEdit, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.edits or self.apart)

    @property
    def by_number(self) -> dict[int, TrackEdit]:
        """The edits in use by their tracks' numbers."""
        return {each.track_no: each for each in self.edits}

    def in_words(self) -> str:
        """What is in use, one line for people; empty where nothing was changed."""
        kinds = (
            ("taken away", [one for one in self.edits if one.drawn is None and one.cut is None]),
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

        return TrackEdits(all_of(self.edits), all_of(self.apart))

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values; see :meth:`from_json`."""
        return {"edits": _listed(self.edits), "apart": _listed(self.apart)}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> TrackEdits:
        """The edits that were written with :meth:`to_json`."""
        return cls(*(_unlisted(value.get(name, ())) for name in ("edits", "apart")))


@dataclass(frozen=True)
class TracksWritten:
    """The tracks as the planner left them: the measure of what a person changed since.

    Attributes
    ----------
    heading_deg, spacing_m : float
        Of the layout.
    middle : (int, int)
        From where vertices count, metric CRS; beside it lies the place of a line.
    rows : list of list of int
        Of each segment its track's number and its vertices x, y, ..., millimetres.
    """

    heading_deg: float
    spacing_m: float
    middle: tuple[int, int]
    rows: list[list[int]]

    @classmethod
    def of(
        cls,
        track_no: Any,
        lines: Any,
        *,
        heading_deg: float,
        spacing_m: float,
        middle: tuple[float, float],
    ) -> TracksWritten:
        """The record of segments, by the numbers of their tracks."""
        at = round(middle[0]), round(middle[1])
        lines = np.asarray(lines, dtype=object)
        number = np.asarray(track_no, dtype=np.int64)
        flat = np.rint((shapely.get_coordinates(lines) - at) * 1000.0).astype(np.int64)
        count = shapely.get_num_coordinates(lines)
        if (count == 2).all():
            rows = np.column_stack((number, flat.reshape(-1, 4))).tolist()
        else:
            parts = np.split(flat, np.cumsum(count)[:-1])
            rows = [
                [no, *part.ravel().tolist()]
                for no, part in zip(number.tolist(), parts, strict=True)
            ]
        return cls(heading_deg, spacing_m, at, rows)

    @cached_property
    def segments(self) -> dict[int, list[Vertices]]:
        """The segments' vertices by track number, metric CRS."""
        found: dict[int, list[Vertices]] = {}
        for no, *flat in self.rows:
            found.setdefault(no, []).append(np.array(flat).reshape(-1, 2) / 1000.0 + self.middle)
        return found

    def are(self, lines: gpd.GeoDataFrame, segments: gpd.GeoDataFrame) -> bool:
        """Whether both layers are as they were written, their rows in the same order."""
        numbers = [row[0] for row in self.rows]
        if numbers != segments["track_no"].tolist():
            return False
        if list(dict.fromkeys(numbers)) != lines["track_no"].tolist():
            return False
        flat = np.array([value for row in self.rows for value in row[1:]], dtype=np.float64)
        written = flat.reshape(-1, 2) / 1000.0 + self.middle
        for table in (lines, segments):
            now = shapely.get_coordinates(table.geometry.to_numpy())
            if now.shape != written.shape or (np.abs(now - written) > SAME_M).any():
                return False
        return True

    def place(self, track_no: int) -> Place | None:
        """Where the line of a track runs; None where it has no length."""
        both = np.concatenate(self.segments[track_no])
        start, way = both[0], both[-1] - both[0]
        length = float(np.hypot(*way))
        if length == 0.0:
            return None
        along = way / length
        x, y = start + ((np.array(self.middle) - start) @ along) * along
        at = round(float(x), _DECIMALS), round(float(y), _DECIMALS)
        return Place(*at, self.heading_deg, self.spacing_m)

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values; see :meth:`from_json`."""
        return {
            "heading_deg": self.heading_deg,
            "spacing_m": self.spacing_m,
            "middle": list(self.middle),
            "segments_mm": self.rows,
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> TracksWritten:
        """The record that was written with :meth:`to_json`."""
        x, y = value["middle"]
        layout = float(value["heading_deg"]), float(value["spacing_m"])
        return cls(*layout, (int(x), int(y)), value["segments_mm"])


def edits_in(
    lines: gpd.GeoDataFrame,
    segments: gpd.GeoDataFrame,
    written: TracksWritten,
    known: TrackEdits,
) -> TrackEdits:
    """Read what a person changed since the tracks were written, after what was known before.

    Layers without any row left are no word on any one track: all tracks are planned anew then.

    Parameters
    ----------
    lines, segments : GeoDataFrame
        Layers `tracks` and `segments`, edited or not. Where one track was changed in both, its
        segments count: they are what is driven.
    written : TracksWritten
    known : TrackEdits
        Edits of earlier, whose results are what was written.
    """
    if written.are(lines, segments):
        return known
    as_lines, loose_lines = _by_number(lines["track_no"], lines.geometry, written)
    as_segments, loose = _by_number(segments["track_no"], segments.geometry)
    if not as_lines or not as_segments:
        return known
    edits = known.by_number
    for no, before in written.segments.items():
        line, pieces = as_lines.pop(no, None), as_segments.pop(no, [])
        change = _change(before, line, pieces)
        if change is None:
            continue
        earlier = edits.pop(no, None)
        place = written.place(no) if earlier is None else earlier.place
        if change.drawn is None and earlier is not None and change.cut is not None:
            # A piece of what was drawn, or of what was shortened before, is taken away.
            change = _further(earlier, change.cut, pieces or line or [])
        if place is not None or change.drawn is not None:
            edits[no] = change._replace(track_no=no, place=place)
    numbered = {**as_segments, **as_lines}
    for no, drawn in numbered.items():
        place = edits[no].place if no in edits else None
        edits[no] = TrackEdit(no, as_text(_multi(drawn)), place=place)
    free = max([*edits, *written.segments, 0]) + 1
    # A piece drawn without a number is a track of its own, in whichever layer.
    for number, line in enumerate([*loose_lines, *([each] for each in loose)], start=free):
        edits[number] = TrackEdit(number, as_text(_multi(line)))
    return TrackEdits(tuple(edits[no] for no in sorted(edits)), known.apart)


def _change(
    before: Sequence[Vertices], line: list[Vertices] | None, pieces: list[Vertices]
) -> TrackEdit | None:
    """What became of a track, or None: its number and place are not known here."""
    left = [one for one in pieces if among(one, before)]
    new = len(left) < len(pieces)
    whole_line = line is not None and _same(line, before)
    if len(left) == len(before) and not new:
        if whole_line:
            return None
        if line is None:
            return TrackEdit(0)
        return _of_drawn(before, line)
    if not pieces or (line is None and not new):
        return TrackEdit(0)
    return _of_drawn(before, pieces)


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


def _by_number(
    track_no: Any, lines: Any, written: TracksWritten | None = None
) -> tuple[dict[int, list[Vertices]], list[Any]]:
    """Vertices of lines and of the parts of lines by track number, and of those without one.

    A copied row has the number of the one that it was copied from: of several rows of tracks with
    one number, that which is as written has it, or else the first.
    """
    shapes = np.asarray(lines, dtype=object)
    numbers = np.asarray(track_no, dtype="float64")
    found: dict[int, list[Vertices]] = {}
    loose: list[Any] = []
    for number, shape in zip(numbers.tolist(), shapes, strict=True):
        parts = [shapely.get_coordinates(one) for one in shapely.get_parts(shape)]
        parts = [one for one in parts if len(one) > 1]
        no = 0 if np.isnan(number) else int(number)
        if not parts:
            continue
        if no < 1:
            loose += parts if written is None else [parts]
        elif written is None:
            found.setdefault(no, []).extend(parts)
        elif no not in found:
            found[no] = parts
        elif _same(parts, written.segments.get(no, ())):
            loose.append(found[no])
            found[no] = parts
        else:
            loose.append(parts)
    return found, loose


def _same(some: Sequence[Vertices], others: Sequence[Vertices]) -> bool:
    return len(some) == len(others) and all(among(one, others) for one in some)


def among(one: Vertices, others: Sequence[Vertices]) -> bool:
    """Whether a line is one of some others, its direction the same."""
    return any(
        one.shape == other.shape and bool(np.abs(one - other).max() <= SAME_M) for other in others
    )


def _multi(lines: Sequence[Vertices]) -> shapely.MultiLineString:
    return shapely.MultiLineString(list(lines))


def parts_of(text: str | None) -> list[Any]:
    """The lines of a MultiLineString as WKT."""
    return [] if text is None else list(shapely.get_parts(shapely.from_wkt(text)))


def as_text(lines: Any) -> str:
    """Lines as WKT, to the millimetre."""
    return str(shapely.to_wkt(lines, rounding_precision=_DECIMALS))


def _listed(edits: Iterable[TrackEdit]) -> list[Any]:
    return [[*one[:3], None if one.place is None else [*one.place]] for one in edits]


def _unlisted(rows: Iterable[Sequence[Any]]) -> tuple[TrackEdit, ...]:
    return tuple(
        TrackEdit(int(no), drawn, cut, None if place is None else Place(*place))
        for no, drawn, cut, place in rows
    )


def _numbers(some: Sequence[TrackEdit]) -> str:
    numbers = [str(one.track_no) for one in some]
    return ", ".join(numbers) if len(numbers) <= 5 else f"{len(numbers)}"
