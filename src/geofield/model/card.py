"""How a value shows itself: a few words in a console, a small map and figures in a notebook."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from geofield import theme

#: Width of the small map, CSS pixels.
_WIDTH = 220
#: A small map needs no more lines than this.
_MOST_LINES = 400


@dataclass(frozen=True, slots=True)
class Drawn:
    """One kind of thing on a small map."""

    #: In a metric CRS, all of a map in the same one.
    shapes: Sequence[Any]
    color: str
    #: Of the lines, CSS pixels.
    width: float = 1.0
    #: CSS colour of areas; none by default.
    fill: str = "none"


def words(title: str, facts: Mapping[str, str]) -> str:
    """Two lines of text: what it is, and what is worth knowing of it.

    >>> print(words("Field 'North'", {"area": "3.64 ha", "method": "auto"}))
    <Field 'North'
      area 3.64 ha, method auto>
    """
    return f"<{title}\n  {', '.join(f'{name} {value}' for name, value in facts.items())}>"


def card(title: str, facts: Mapping[str, str], drawn: Sequence[Drawn]) -> str:
    """HTML of a small map beside figures; needs no script and no network."""
    rows = "".join(
        f"<tr><th style='text-align:left'>{html.escape(name)}</th>"
        f"<td style='text-align:left'>{html.escape(value)}</td></tr>"
        for name, value in facts.items()
    )
    return (
        f"<div style='display:flex;gap:1em;align-items:flex-start'>{small_map(drawn)}"
        f"<div><b>{html.escape(title)}</b><table>{rows}</table></div></div>"
    )


def small_map(drawn: Sequence[Drawn]) -> str:
    """Shapes as an SVG picture, north up."""
    every = np.array([shape for each in drawn for shape in each.shapes], dtype=object)
    if not len(every):
        return ""
    left, bottom, right, top = (float(v) for v in shapely.total_bounds(every))
    size = max(right - left, top - bottom, 1e-9)
    scale = _WIDTH / size
    paths = "".join(
        f"<path d='{_path(each.shapes, left, top, scale)}' fill='{each.fill}' "
        f"fill-opacity='.35' stroke='{each.color}' stroke-width='{each.width}'/>"
        for each in drawn
    )
    width, height = (right - left) * scale, (top - bottom) * scale
    return (
        f"<svg width='{width + 8:.0f}' height='{height + 8:.0f}' "
        f"viewBox='-4 -4 {width + 8:.1f} {height + 8:.1f}' style='background:#6b7a52'>{paths}</svg>"
    )


def _path(shapes: Sequence[Any], left: float, top: float, scale: float) -> str:
    some = np.asarray(shapes, dtype=object)
    some = some[:: max(1, len(some) // _MOST_LINES)]
    parts = shapely.get_parts(some)
    areas = shapely.get_dimensions(parts) == 2
    rings = np.concatenate([shapely.get_rings(parts[areas]), parts[~areas]])
    xy, row = shapely.get_coordinates(rings, return_index=True)
    places = np.round((xy - [left, top]) * [scale, -scale], 1)
    corners = (places[row == number] for number in range(len(rings)))
    return "".join("M" + "L".join(f"{x:g} {y:g}" for x, y in ring) for ring in corners)


def field_drawn(polygon: Any) -> Drawn:
    """An outline on a small map."""
    return Drawn([polygon], theme.OUTLINE, 2.0, "#a8b98a")


def tracks_drawn(lines: Any) -> Drawn:
    """Tracks on a small map."""
    return Drawn(list(lines), theme.TRACK, 0.7)


def obstacles_drawn(obstacles: Any) -> list[Drawn]:
    """Obstacles on a small map, by status."""
    return [
        Drawn(list(obstacles.geometry[obstacles["status"] == status]), look.color, 1.2, look.color)
        for status, look in theme.STATUS.items()
        if (obstacles["status"] == status).any()
    ]
