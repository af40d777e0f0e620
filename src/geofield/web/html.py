"""A plan as one HTML file: picture, layers, legend; opens anywhere, asks no server.

OpenLayers, symbols and data stand in the file itself, so that it can be sent by mail and read
without a network.
"""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from geofield import schema
from geofield.model.dataset import Dataset
from geofield.model.tracks import Tracks
from geofield.theme import web_theme
from geofield.web import inlined, page_file
from geofield.web.view import (
    ground_scale,
    margin_bounds,
    obstacles_view,
    outline_view,
    place_table,
    tracks_view,
)

#: Long side of the picture in the file, pixels.
LONG_SIDE_PX = 1600


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``{stem}.html``; the picture comes along where it lies beside the plan."""
    path = folder / f"{stem}.html"
    path.write_text(document(dataset), encoding="utf-8")
    return [path]


def document(dataset: Dataset) -> str:
    """The page as text."""
    values = plan_values(dataset)
    data = json.dumps(values, ensure_ascii=False, separators=(",", ":"))
    source = dataset.provenance.source
    credit = " · ".join(text for text in (source.attribution, source.licence, source.date) if text)
    style = page_file("vendor/ol.css").decode() + page_file("standalone.css").decode()
    script = inlined("words.js", "symbols.js", "standalone.js")
    title = html.escape(dataset.name)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
<script>{_in_script(page_file("vendor/ol.js").decode())}</script>
</head><body>
<main id="map" tabindex="0" aria-label="{title}"></main>
<aside aria-label="{title}"><h1>{title}</h1><dl id="facts"></dl><ul id="doubts"></ul>
<h2 data-t="legend"></h2><ul id="legend"></ul>
<small id="place"></small>
<small>{html.escape(credit)}</small><small>{html.escape(dataset.provenance.software)}</small></aside>
<div id="popup"></div>
<script type="application/json" id="plan">{_in_script(data)}</script>
<script type="module">
{_in_script(script)}
</script>
</body></html>
"""


def plan_values(dataset: Dataset) -> dict[str, Any]:
    """What the page shows, as JSON values."""
    row = dataset.table(schema.FIELD.name).iloc[0]
    polygon, crs = row.geometry, dataset.crs
    if polygon.geom_type == "MultiPolygon":
        polygon = max(polygon.geoms, key=lambda part: part.area)
    evidence = dataset.provenance.evidence
    tracks = None
    if schema.SEGMENTS.name in dataset.tables and "tracks" in evidence:
        tracks = Tracks.from_tables(
            dataset.tables, evidence["tracks"], grid=dataset.grid, outline=polygon
        )
    picture, bounds = _picture(dataset)
    bounds = bounds or margin_bounds(polygon)
    certainty, doubts = row.get("certainty"), row.get("doubts")
    return {
        **tracks_view(tracks, float(row["area_ha"])),
        "name": dataset.name,
        "area_ha": float(row["area_ha"]),
        "field": outline_view(
            polygon,
            crs,
            dataset.grid,
            method=str(row["method"]),
            certainty=None if certainty is None else float(certainty),
            doubts=[part for part in str(doubts).split("; ") if part]
            if isinstance(doubts, str)
            else (),
        ),
        "obstacles": obstacles_view(dataset.tables.get(schema.OBSTACLES.name), tracks),
        "picture": picture,
        "bounds": bounds,
        "places": place_table(crs, bounds),
        "scale": ground_scale(polygon, crs),
        "theme": web_theme(),
    }


def _picture(dataset: Dataset) -> tuple[str | None, tuple[float, float, float, float] | None]:
    """The picture as a data address, and where it lies."""
    if dataset.scene_path is None or not dataset.scene_path.exists():
        return None, None
    from geofield.imagery.display import TiledPicture

    picture = TiledPicture.open(dataset.scene_path, dataset.crs)
    data, kind = picture.whole(LONG_SIDE_PX)
    return f"data:{kind};base64,{base64.b64encode(data).decode()}", picture.bounds


def _in_script(text: str) -> str:
    """Text that cannot end the script element it stands in."""
    return text.replace("</", "<\\/").replace("<!--", "<\\!--")
