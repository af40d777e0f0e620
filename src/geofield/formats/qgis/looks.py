"""What each layer looks like: on a dark or light picture, at field and at region scale.

Colours and dashes are those of `geofield.theme`. Where the outline is the picture's frame it is
dashed: the field goes on outside.
"""

from __future__ import annotations

from dataclasses import dataclass

from geofield import theme
from geofield.formats.qgis.symbols import (
    Label,
    Rule,
    SymbolLayer,
    arrows,
    at_centre,
    fill,
    generated,
    line,
    marker,
)

_BLACK = "0,0,0,190"
_WHITE = "255,255,255,255"
_DARK = "20,20,20,255"
_PAPER = "255,255,255,230"


def _rgba(color: str, opacity: int = 255) -> str:
    return ",".join(map(str, (*theme.rgb(color), opacity)))


_DRIVE, _GAP = _rgba(theme.TRACK), _rgba(theme.GAP)
_TURN, _UNFIT, _HEADLAND = _rgba(theme.TURN), _rgba(theme.UNFIT), _rgba(theme.HEADLAND)
#: Millimetres of a pixel of the theme's dashes.
_DASH_MM = 0.2
#: Scale denominator from which a field is a name on the map, not a shape.
REGION_SCALE = 30_000


@dataclass(frozen=True, slots=True)
class Look:
    """The picture of one layer.

    Attributes
    ----------
    rules : tuple of Rule
    labels : tuple of Label
    max_scale : int
        Scale denominator beyond which the layer is not drawn; 0 for always.
    visible : bool
        Whether the project shows it at first.
    tip : str
        First line of the map tip, HTML with QGIS expressions.
    """

    rules: tuple[Rule, ...]
    labels: tuple[Label, ...] = ()
    max_scale: int = 0
    visible: bool = True
    tip: str = ""


def _shown(column: str) -> str:
    """An expression for a column's text in a map tip, which is HTML: no tag of it counts."""
    return f"replace(\"{column}\", map('&', '&amp;', '<', '&lt;'))"


def _obstacle_rule(label: str, status: str) -> Rule:
    look = theme.STATUS[status]
    colour, condition = _rgba(look.color), f"\"status\" = '{status}'"
    if status == "added":
        condition += ' OR "status" IS NULL'
    if look.dash is None:
        width = 0.4 if status == "detected" else 0.6
        return Rule(label, "fill", (fill(_rgba(look.color, 90), colour, width),), condition)
    dash = ";".join(f"{_DASH_MM * part:g}" for part in look.dash)
    lines = line(_BLACK, 0.6, dash=dash), line(colour, 0.4, dash=dash)
    return Rule(label, "fill", lines, condition)


#: Obstacles that tracks run through; one without a status was drawn, and is driven around.
_RUN_THROUGH = "coalesce(\"status\", '') IN ('rejected', 'possible')"


def _obstacle_label(colour: str, halo: str, condition: str, priority: int) -> Label:
    return Label(
        'to_string("obstacle_no")',
        8,
        colour,
        halo,
        geometry="point_on_surface($geometry)",
        filter=condition,
        max_scale=2500,
        priority=priority,
    )


def field_rules(frame: str) -> tuple[Rule, ...]:
    """The rules of the layer `field`.

    Parameters
    ----------
    frame : str
        The picture's frame in the layer's CRS as a strip, WKT; empty where there is none.
    """
    along: tuple[SymbolLayer, ...] = ()
    if frame:
        shared = f"intersection(boundary($geometry), geom_from_wkt('{frame}'))"
        along = (
            generated(shared, line(_BLACK, 1.3)),
            generated(shared, line(_rgba(theme.DOUBT), 1.0, dash="2;2")),
        )
    rules = []
    for ending, color, condition in (
        ("", theme.OUTLINE, '"doubts" IS NULL'),
        (" to be checked", theme.DOUBT, '"doubts" IS NOT NULL'),
    ):
        near = (line(_BLACK, 1.3), line(_rgba(color), 0.8), *along)
        far = (
            fill(_rgba(color, 110), _rgba(color), 0.5),
            at_centre(marker("circle", _rgba(color), _BLACK, 3)),
        )
        rules += [
            Rule(f"Outline{ending}", "fill", near, condition, max_scale=REGION_SCALE),
            Rule(f"Field{ending}", "fill", far, condition, min_scale=REGION_SCALE),
        ]
    return tuple(rules)


_FIRST = "start_point(extend(geometry_n($geometry, 1), {0}, 0))"
_LAST = "end_point(extend(geometry_n($geometry, num_geometries($geometry)), 0, {0}))"
_END_OFFSET_M = 2.5

#: Every layer, from top to bottom in the project.
LOOKS: dict[str, Look] = {
    "places": Look(
        (
            Rule(
                "Place without a plan",
                "marker",
                (marker("circle", _UNFIT, _WHITE, 3.5),),
                '"error" IS NOT NULL',
            ),
        ),
        (
            Label(
                '"field_id"',
                8,
                _WHITE,
                "120,0,0,230",
                filter='"error" IS NOT NULL',
                max_scale=REGION_SCALE,
                above=True,
            ),
        ),
        tip=f'<b>[% {_shown("name")} %]</b> [% {_shown("field_id")} %]: [% "status" %]'
        f"[% if(\"error\" IS NULL, '', '<br>' || {_shown('error')} || ' ' || "
        f"coalesce({_shown('hint')}, '')) %]",
    ),
    "obstacles": Look(
        (
            _obstacle_rule("Confirmed", "confirmed"),
            _obstacle_rule("Detected", "detected"),
            _obstacle_rule("Possible, not avoided", "possible"),
            _obstacle_rule("Added by a person", "added"),
            _obstacle_rule("Rejected by a person", "rejected"),
        ),
        # By their numbers a person speaks of them, of what tracks run through as well.
        (
            _obstacle_label(_WHITE, "120,0,0,230", f"NOT ({_RUN_THROUGH})", priority=9),
            _obstacle_label(_DARK, _PAPER, _RUN_THROUGH, priority=8),
        ),
        max_scale=REGION_SCALE,
        tip='<b>Obstacle [% "obstacle_no" %]</b>: '
        f"[% {_shown('kind')} %], [% {_shown('status')} %]"
        "[% if(\"confidence\" IS NULL, '', ', confidence ' || round(\"confidence\", 2)) %]"
        "<br>[% if(\"radius_m\" IS NULL, '', 'radius ' || round(\"radius_m\", 1) || ' m + ') %]"
        'margin [% round(coalesce("buffer_m", 0), 1) %] m',
    ),
    "track_points": Look(
        (Rule("Track point", "marker", (marker("circle", _WHITE, "0,60,80,255", 0.9),)),),
        (Label('to_string("point_no")', 6, _DARK, "255,255,255,200", max_scale=120),),
        max_scale=500,
        tip='<b>Point [% "point_no" %]</b>: track [% "track_no" %], segment [% "segment_no" %]',
    ),
    "gaps": Look(
        (Rule("Gap", "line", (line(_GAP, 0.35, dash="1.2;1.2"),)),),
        max_scale=5000,
        tip='<b>Gap [% "gap_no" %] of track [% "track_no" %]</b>: [% "cause" %], '
        '[% round("length_m", 1) %] m',
    ),
    "tracks": Look(
        (
            # Without arrows: which way a line is driven is the route's to say.
            Rule("Track", "line", (line("0,40,60,160", 0.6), line(_DRIVE, 0.35))),
        ),
        tuple(
            Label(
                'to_string("track_no")',
                7,
                "0,60,80,255",
                _PAPER,
                geometry=end.format(_END_OFFSET_M),
                max_scale=4000,
            )
            for end in (_FIRST, _LAST)
        ),
        max_scale=REGION_SCALE,
        tip='<b>Track [% "track_no" %]</b>: [% round("length_m", 1) %] m, '
        'heading [% round("heading_deg", 1) % 180 %]°<br>[% "segment_count" %] segments, '
        '[% "gap_count" %] gaps',
    ),
    "turns": Look(
        (
            Rule("Turn", "line", (line(_BLACK, 0.45), line(_TURN, 0.25)), "\"fits\" = 'yes'"),
            Rule("Turn that does not fit", "line", (line(_UNFIT, 1.6),), "\"fits\" = 'no'"),
        ),
        max_scale=5000,
        tip='<b>Turn [% "turn_no" %]</b> from track [% "from_track" %] to [% "to_track" %]: '
        '[% "kind" %], fits: [% "fits" %]',
    ),
    "route": Look(
        (
            Rule(
                "Route",
                "line",
                (line(_BLACK, 0.45), line(_TURN, 0.25), arrows(_TURN, every_m=30, size_m=1.6)),
            ),
        ),
        max_scale=REGION_SCALE,
        visible=False,
        tip='<b>Route, step [% "sequence" %]</b>: [% "kind" %], after [% round("start_m", 0) %] m',
    ),
    "headland_tracks": Look(
        (Rule("Headland track", "line", (line(_HEADLAND, 0.35),)),),
        max_scale=REGION_SCALE,
        tip='<b>Headland pass [% "pass_no" %]</b>: [% round("length_m", 1) %] m',
    ),
    "segments": Look(
        (Rule("Segment", "line", (line("120,255,120,255", 0.3),)),),
        max_scale=REGION_SCALE,
        visible=False,
        tip='<b>Track [% "track_no" %], segment [% "segment_no" %]</b>: '
        '[% round("length_m", 1) %] m',
    ),
    "headland": Look(
        (Rule("Headland", "fill", (fill(_rgba(theme.HEADLAND, 40), _HEADLAND, 0.25),)),),
        max_scale=REGION_SCALE,
        tip='<b>Headland</b>, [% round("width_m", 1) %] m wide',
    ),
    "alternatives": Look(
        (
            Rule(
                "Outline that may be meant",
                "fill",
                (fill("0,0,0,0", "255,60,220,255", 0.5, line="dash"),),
            ),
        ),
        (
            Label(
                "to_string(\"alternative_no\") || ': ' || "
                "to_string(round(100 * \"certainty\")) || ' %'",
                8,
                "255,60,220,255",
                _PAPER,
            ),
        ),
        visible=False,
        tip='<b>Outline [% "alternative_no" %]</b>: [% round(100 * "certainty") %] % certain, '
        '[% round("area_ha", 2) %] ha; taken with geofield field --choose',
    ),
    "field": Look(
        field_rules(""),
        (
            # Above the outline, where it hides neither tracks nor obstacles.
            Label(
                "\"name\" || '\\n' || format_number(\"area_ha\", 2) || ' ha'",
                10,
                _DARK,
                _PAPER,
                geometry=(
                    "make_point((x_min($geometry) + x_max($geometry)) / 2, "
                    "y_max($geometry) + 0.06 * (y_max($geometry) - y_min($geometry)))"
                ),
                max_scale=REGION_SCALE,
            ),
            Label(
                "\"name\" || ' (' || format_number(\"area_ha\", 1) || ' ha)'",
                9,
                _DARK,
                _PAPER,
                geometry="point_on_surface($geometry)",
                min_scale=REGION_SCALE,
                above=True,
            ),
        ),
        tip=f"<b>[% {_shown('name')} %]</b><br>"
        '[% format_number("area_ha", 2) %] ha, '
        '[% format_number("perimeter_m", 0) %] m around'
        "[% if(\"imagery_date\" IS NULL, '', ', imagery of ' || \"imagery_date\") %]"
        "[% if(\"certainty\" IS NULL, '', "
        "'<br>outline ' || round(100 * \"certainty\") || ' % certain') %]"
        "[% if(\"doubts\" IS NULL, '', '<br><b>Check the outline:</b> ' || "
        f"{_shown('doubts')}) %]",
    ),
}
