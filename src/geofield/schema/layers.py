"""Every layer with its columns, types, units and short names."""

from __future__ import annotations

from geofield.errors import FormatError
from geofield.schema.columns import Column, Layer

#: What a person or the detector says of an obstacle. `possible`: too uncertain to be driven
#: around, shown so that a person may decide.
STATUSES = ("detected", "possible", "confirmed", "rejected", "added")
#: The statuses that are a person's word and survive every re-run.
REVIEWED = ("confirmed", "rejected", "added")
#: The statuses of what tracks run through.
NOT_AVOIDED = ("rejected", "possible")
KINDS = ("tree", "other")

_PIXEL = (
    Column("x_px", "float", "Pixel x", "x_px", "px"),
    Column("y_px", "float", "Pixel y", "y_px", "px"),
)
_LATLON = (
    Column("lat", "float", "Latitude", "lat", "deg"),
    Column("lon", "float", "Longitude", "lon", "deg"),
)
_TRACK_NO = Column("track_no", "int", "Track", "track_no")
_SEGMENT_NO = Column("segment_no", "int", "Segment", "segment_no")
_HEADING = Column("heading_deg", "float", "Heading", "heading", "deg")
_LENGTH = Column("length_m", "float", "Length", "length_m", "m")

FIELD = Layer(
    "field",
    "Polygon",
    "Field",
    "The outline of the target field.",
    ("field_id",),
    (
        Column("field_id", "str", "Field id", "field_id"),
        Column("name", "str", "Name", "name"),
        Column("area_ha", "float", "Area", "area_ha", "har"),
        Column("perimeter_m", "float", "Perimeter", "perim_m", "m"),
        Column("longest_edge_m", "float", "Longest edge", "edge_m", "m"),
        _HEADING,
        Column("method", "str", "Method", "method"),
        Column("imagery", "str", "Imagery", "imagery"),
        Column("imagery_date", "date", "Imagery date", "img_date"),
        Column("licence", "str", "Licence", "licence"),
        # Of the outline: the probability that it is right; what speaks against it, in words.
        Column("certainty", "float", "Certainty", "certainty", "1"),
        Column("doubts", "str", "Doubts", "doubts"),
    ),
)

ALTERNATIVES = Layer(
    "alternatives",
    "Polygon",
    "Alternatives",
    "The most likely different outlines; number 1 is the one that was taken.",
    ("alternative_no",),
    (
        Column("alternative_no", "int", "Alternative", "altern_no"),
        Column("area_ha", "float", "Area", "area_ha", "har"),
        Column("certainty", "float", "Certainty", "certainty", "1"),
    ),
    optional=True,
    working=True,
)

OBSTACLES = Layer(
    "obstacles",
    "Polygon",
    "Obstacles",
    "What no vehicle may enter: each footprint grown by its safety margin.",
    ("obstacle_no",),
    (
        Column("obstacle_no", "int", "Obstacle", "obst_no"),
        Column("kind", "str", "Kind", "kind", values=KINDS),
        Column("status", "str", "Status", "status", values=STATUSES),
        Column("radius_m", "float", "Radius", "radius_m", "m"),
        Column("buffer_m", "float", "Safety margin", "buffer_m", "m"),
        Column("confidence", "float", "Confidence", "confid", "1"),
        *_PIXEL,
        Column("radius_px", "float", "Radius in pixels", "radius_px", "px"),
        *_LATLON,
    ),
)

TRACKS = Layer(
    "tracks",
    "MultiLineString",
    "Tracks",
    "Straight driving lines, numbered from the edge they start at.",
    ("track_no",),
    (
        _TRACK_NO,
        _HEADING,
        Column("segment_count", "int", "Segments", "segments"),
        Column("gap_count", "int", "Gaps", "gaps"),
        Column("point_count", "int", "Points", "points"),
        _LENGTH,
    ),
)

SEGMENTS = Layer(
    "segments",
    "LineString",
    "Segments",
    "The drivable pieces of each track.",
    ("track_no", "segment_no"),
    (_TRACK_NO, _SEGMENT_NO, _LENGTH),
)

GAPS = Layer(
    "gaps",
    "LineString",
    "Gaps",
    "What lies between two segments of a track, and why.",
    ("track_no", "gap_no"),
    (
        _TRACK_NO,
        Column("gap_no", "int", "Gap", "gap_no"),
        _LENGTH,
        # All causes in words ("border", "obstacle 3", "obstacles 3, 7"); obstacle_no is the
        # lowest of the numbers, so that a join works, and missing for the border alone.
        Column("cause", "str", "Cause", "cause"),
        Column("obstacle_no", "int", "Obstacle", "obst_no"),
    ),
)

TRACK_POINTS = Layer(
    "track_points",
    "Point",
    "Track points",
    "Points sampled along each segment, both ends included.",
    ("point_no",),
    (
        Column("point_no", "int", "Point", "point_no"),
        _TRACK_NO,
        _SEGMENT_NO,
        *_PIXEL,
        *_LATLON,
    ),
)

HEADLAND = Layer(
    "headland",
    "MultiPolygon",
    "Headland",
    "The strip along the border that is kept free for turning, and worked last.",
    ("headland_no",),
    (
        Column("headland_no", "int", "Headland", "headl_no"),
        Column("width_m", "float", "Width", "width_m", "m"),
        Column("area_ha", "float", "Area", "area_ha", "har"),
    ),
    optional=True,
)

HEADLAND_TRACKS = Layer(
    "headland_tracks",
    "LineString",
    "Headland tracks",
    "Tracks around the field, parallel to its border, numbered from the border inwards.",
    ("pass_no", "segment_no"),
    (
        Column("pass_no", "int", "Pass", "pass_no"),
        _SEGMENT_NO,
        Column("offset_m", "float", "Distance from the border", "offset_m", "m"),
        _LENGTH,
    ),
    optional=True,
)

ROUTE = Layer(
    "route",
    "LineString",
    "Route",
    "The whole drive in order: work on segments, and the ways between them.",
    ("sequence",),
    (
        Column("sequence", "int", "Sequence", "sequence"),
        Column("kind", "str", "Kind", "kind", values=("work", "turn", "drive")),
        # Of work: with or against the segment's own direction.
        Column("direction", "str", "Direction", "direction", values=("forward", "backward")),
        _TRACK_NO,
        _SEGMENT_NO,
        _LENGTH,
        Column("start_m", "float", "Driven before", "start_m", "m"),
    ),
    optional=True,
)

TURNS = Layer(
    "turns",
    "LineString",
    "Turns",
    "The ways from one segment to the next, and whether the machine can drive them.",
    ("turn_no",),
    (
        Column("turn_no", "int", "Turn", "turn_no"),
        Column("sequence", "int", "Sequence", "sequence"),
        Column("from_track", "int", "From track", "from_track"),
        Column("to_track", "int", "To track", "to_track"),
        # drive: a way around what is between, with corners that no radius is kept in.
        Column("kind", "str", "Kind", "kind", values=("dubins", "reeds_shepp", "drive")),
        Column("direction", "str", "Direction", "direction", values=("left", "right", "straight")),
        Column("radius_m", "float", "Turning radius", "radius_m", "m"),
        _LENGTH,
        Column("reverse_m", "float", "Driven backwards", "reverse_m", "m"),
        Column("skipped_m", "float", "Track left out", "skipped_m", "m"),
        Column("outside_m", "float", "Outside the allowed area", "outside_m", "m"),
        Column("fits", "str", "Fits", "fits", values=("yes", "no")),
    ),
    optional=True,
)

LAYERS: tuple[Layer, ...] = (
    FIELD,
    OBSTACLES,
    TRACKS,
    SEGMENTS,
    GAPS,
    TRACK_POINTS,
    HEADLAND,
    HEADLAND_TRACKS,
    ROUTE,
    TURNS,
    ALTERNATIVES,
)

#: Beside the layers of its fields, in the overview of a farm.
PLACES = Layer(
    "places",
    "Point",
    "Places",
    "What was asked for and what became of it.",
    ("place", "field_id"),
    (
        Column("place", "int", "Row in the places file", "place"),
        Column("field_id", "str", "Field id", "field_id"),
        Column("name", "str", "Name", "name"),
        Column("status", "str", "Status", "status", values=("done", "doubtful", "failed", "lost")),
        Column("error", "str", "Error", "error"),
        Column("hint", "str", "What helps", "hint"),
        Column("notes", "str", "Notes", "notes"),
        Column("reviewed", "str", "Reviewed", "reviewed", values=("yes", "no")),
    ),
    optional=True,
)


def layer(name: str) -> Layer:
    """The layer of a name.

    Raises
    ------
    FormatError
        When there is none.
    """
    for candidate in LAYERS:
        if candidate.name == name:
            return candidate
    raise FormatError(
        f"There is no layer {name!r}.",
        hint=f"Layers: {', '.join(each.name for each in LAYERS)}.",
    )
