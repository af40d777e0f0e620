"""What every column says, in one sentence: for people who open the files."""

from __future__ import annotations

from geofield.schema.columns import Column, Layer

_EVERYWHERE = {
    "x_px": "Column of the picture, counted from its left edge.",
    "y_px": "Row of the picture, counted from its upper edge.",
    "lat": "Degrees north, WGS 84.",
    "lon": "Degrees east, WGS 84.",
    "area_ha": "Area on the ground, without holes.",
    "length_m": "Length on the ground.",
    "track_no": "The track, counted from the edge where planning starts.",
    "segment_no": "The drivable piece, in its order along the track.",
}
_OF_LAYER = {
    "field": {
        "field_id": "Stable name: the roundest position inside the field, or the id you gave.",
        "name": "What you call the field.",
        "perimeter_m": "Length of the outer border.",
        "longest_edge_m": "The longest straight piece of the border.",
        "heading_deg": "Direction of the tracks, without any that of the longest piece, clockwise "
        "from true north.",
        "method": "How the outline was found, or that it is your own parcel.",
        "imagery": "Which picture it was found in.",
        "imagery_date": "When the picture was taken.",
        "licence": "What the picture may be used under.",
        "certainty": "Probability that the outline is right.",
        "doubts": "What speaks against the outline, in words.",
    },
    "obstacles": {
        "obstacle_no": "Its number; a reviewed obstacle keeps it.",
        "kind": "What it is.",
        "status": "What the detector or a person says of it.",
        "radius_m": "Of a circle, without the margin; missing where the footprint is a shape.",
        "buffer_m": "What the footprint was grown by.",
        "confidence": "Probability that something is there which must not be driven into.",
        "radius_px": "The radius in pixels of the picture.",
    },
    "tracks": {
        "heading_deg": "Direction from its first segment to its last, clockwise from true north.",
        "segment_count": "How many drivable pieces it has.",
        "gap_count": "How many interruptions it has.",
        "point_count": "How many track points lie on it.",
    },
    "gaps": {
        "gap_no": "Which interruption it is, in its order along the track.",
        "cause": "What is in the way: obstacles by number, or the border.",
        "obstacle_no": "The lowest number among the causes; missing for the border alone.",
    },
    "track_points": {"point_no": "Number along the whole plan."},
    "headland": {
        "headland_no": "Number of the strip.",
        "width_m": "How far it reaches in from the border.",
    },
    "headland_tracks": {
        "pass_no": "Which pass it is, counted from the border inwards.",
        "segment_no": "The drivable piece, in its order along the pass.",
        "offset_m": "How far the pass lies from the border.",
    },
    "route": {
        "sequence": "Place in the drive.",
        "kind": "Work on a segment, a turn, or a way between.",
        "direction": "Of work: with or against the segment's own direction.",
        "track_no": "Of work: the track.",
        "segment_no": "Of work: the segment.",
        "start_m": "Length of all that comes before in the drive.",
    },
    "turns": {
        "turn_no": "Number in the order of the drive.",
        "sequence": "Its place in the route.",
        "from_track": "The track it leaves.",
        "to_track": "The track it leads to.",
        "kind": "Forwards only (dubins), with a piece backwards (reeds_shepp), or a way around "
        "what is between, with corners that no radius is kept in (drive).",
        "direction": "Which way it bends.",
        "radius_m": "The radius that it is driven with.",
        "reverse_m": "How much of it is driven backwards.",
        "skipped_m": "Length of track that it leaves unworked.",
        "outside_m": "Length outside the ground that may be driven on.",
        "fits": "Whether the machine can drive it there.",
    },
    "places": {
        "place": "Row in the file of places, from 1.",
        "field_id": "The field's id; parts of one parcel have .1, .2 behind it.",
        "name": "What you call the field.",
        "status": "Whether it was planned, is doubtful, failed, or ended its worker twice.",
        "error": "Why there is no plan.",
        "hint": "What helps.",
        "notes": "What there was to tell of it.",
        "reviewed": "Whether it is as a person left it.",
    },
    "alternatives": {
        "alternative_no": "Rank by certainty; 1 is the one that was taken.",
        "certainty": "Probability that this outline is the right one.",
    },
}
#: UCUM codes as people write them.
_UNITS = {"har": "ha", "deg": "°", "1": "0 to 1"}


def meaning(of: Layer, column: Column) -> str:
    """What a column of a layer says; its title where nobody has written more."""
    words = _OF_LAYER.get(of.name, {}).get(column.name)
    return words or _EVERYWHERE.get(column.name, f"{column.title}.")


def unit_in_words(column: Column) -> str:
    """A column's unit as people write it; empty where there is none."""
    return _UNITS.get(column.unit, column.unit)
