"""The places of a field's tracks across it, and what is told where they are not as asked."""

from __future__ import annotations

import numpy as np

from geofield.errors import TrackError, TrackWarning
from geofield.notes import warn
from geofield.tracks.direction import Baseline
from geofield.tracks.frame import FloatArray, TrackFrame
from geofield.tracks.layout import Strips
from geofield.tracks.shapes import Edges

#: A track so near to a place passes it.
_BESIDE_M = 0.01


def places_across(
    edges: Edges, frame: TrackFrame, baseline: Baseline, strips: Strips, *, inset_m: float
) -> tuple[FloatArray, float, tuple[str, ...]]:
    """Places of the tracks, the spacing that they have, and notes on both."""
    near, far = float(edges.va.min()), float(edges.va.max())
    strips.refuse_beyond(far - near)
    spacing_m, run, first = strips.spacing_m, baseline.edge, None
    if baseline.through is not None and strips.offset_m is not None:
        raise TrackError(
            "An offset and a place to pass through (an A-B line passes through its A) were both "
            "given.",
            hint="Give one of the two: `geofield tracks --defaults` forgets that of the plan.",
        )
    if baseline.through is not None:
        first = float(frame.to_frame(*baseline.through)[1])
    elif run is not None:
        edge = float(np.mean(frame.to_frame([run.x0, run.x1], [run.y0, run.y1])[1]))
        first = edge + inset_m + strips.first_m
    positions = strips.across(edges, first, asked=baseline.through is not None)
    if not len(positions):
        note = (
            f"{strips.wide_words} leaves no track in a field {far - near:.2f} m wide across the "
            "tracks; one was laid through its middle."
        )
        warn(note, TrackWarning)
        return np.array([(near + far) / 2.0]), spacing_m, (note,)
    if strips.last_strip == "spread" and len(positions) > 1:
        spacing_m = float(positions[1] - positions[0])
    if strips.last_strip != "spread" or baseline.through is None or first is None:
        return positions, spacing_m, ()
    apart_m = positions[0] - first
    return positions, spacing_m, _beside_note(abs(apart_m - round(apart_m / spacing_m) * spacing_m))


def _beside_note(beside_m: float) -> tuple[str, ...]:
    """That tracks which are spread evenly pass beside a place, where they do."""
    if beside_m < _BESIDE_M:
        return ()
    note = (
        "Tracks that are spread evenly do not pass the place asked for (of an A-B line its A): "
        f"they lie {beside_m:.2f} m beside it."
    )
    warn(note, TrackWarning)
    return (note,)
