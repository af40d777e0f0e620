"""What a person wrote beside segments of tracks, and how it finds them again.

Columns of one's own in the layer `segments`: which piece is wet, which was sown. Planning cuts the
tracks anew, so a value belongs to the piece of ground that it was written for, and stands beside
each segment of which most lies there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from geofield import schema
from geofield.model.own_values import own_values, with_own_values
from geofield.model.tracks_written import DECIMALS, run_alike
from geofield.model.written import SAME_M

if TYPE_CHECKING:
    import geopandas as gpd

#: How far beside its piece a segment may run, of the spacing, and which share of it lies there at
#: least.
_NEAR, _SHARE = 0.25, 0.5


class SegmentValues(NamedTuple):
    """Values that a person wrote beside a piece of a track."""

    #: The piece: a LineString as WKT, metric CRS.
    line: str
    #: By the names of the columns, plain JSON.
    own: Mapping[str, Any]


def values_in(
    segments: gpd.GeoDataFrame, known: Sequence[SegmentValues], spacing_m: float
) -> tuple[SegmentValues, ...]:
    """Read what stands beside segments, after what was known before.

    What was written for ground where no segment is now waits for one.
    """
    own = own_values(schema.SEGMENTS, segments)
    if not own and not known:
        return ()
    lines = shapely.force_2d(segments.geometry.to_numpy())
    at = _piece_of_each(lines, known, spacing_m)
    texts = shapely.to_wkt(lines, rounding_precision=DECIMALS)
    has_length = shapely.length(lines) > 0
    if known:
        # A piece that is as it was keeps its text: reading a file is no edit. So does one of which
        # all segments say what it said, however planning has cut or joined them.
        changed = [no for row, no in enumerate(at) if own.get(row, {}) != known[no].own]
        before = np.array([one.line for one in known], dtype=object)[at]
        same = shapely.equals_exact(shapely.from_wkt(before), lines, SAME_M)
        texts = np.where((at >= 0) & (same | ~np.isin(at, changed)), before, texts)
    now: dict[str, Mapping[str, Any]] = {
        texts[row]: values for row, values in own.items() if has_length[row]
    }
    found = set(at.tolist())
    now |= {one.line: one.own for number, one in enumerate(known) if number not in found}
    return tuple(map(SegmentValues._make, sorted(now.items(), key=lambda one: one[0])))


def with_values(
    segments: gpd.GeoDataFrame, values: Sequence[SegmentValues], spacing_m: float
) -> gpd.GeoDataFrame:
    """Segments with what a person wrote for the ground where they are."""
    at = _piece_of_each(segments.geometry.to_numpy(), values, spacing_m)
    return with_own_values(
        schema.SEGMENTS, segments, [values[one].own if one >= 0 else None for one in at.tolist()]
    )


def _piece_of_each(
    lines: NDArray[np.object_], values: Sequence[SegmentValues], spacing_m: float
) -> NDArray[np.int64]:
    """For each segment which piece most of it lies along, or -1."""
    best = np.full(len(lines), -1, np.int64)
    pieces = shapely.from_wkt([one.line for one in values])
    around = shapely.buffer(pieces, _NEAR * spacing_m, cap_style="flat")
    piece, row = shapely.STRtree(lines).query(around, predicate="intersects")
    length = shapely.length(lines[row])
    inside = shapely.length(shapely.intersection(lines[row], around[piece]))
    share = np.divide(inside, length, out=np.zeros_like(inside), where=length > 0)
    fits = (share >= _SHARE) & run_alike(lines[row], pieces[piece])
    order = np.argsort(share[fits], kind="stable")
    best[row[fits][order]] = piece[fits][order]
    return best
