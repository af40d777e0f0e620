"""A plan as one HTML file: picture, layers, legend; opens anywhere, asks no server.

OpenLayers, symbols and data stand in the file itself, so that it can be sent by mail and read
without a network.
"""

from __future__ import annotations

import base64
import html
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from geofield import schema
from geofield.crs import ground_scale_of
from geofield.errors import FormatError, ImageryWarning
from geofield.model.dataset import Dataset
from geofield.model.map_words import frame_lines
from geofield.model.scene import Scene
from geofield.model.tracks import Tracks
from geofield.notes import warn
from geofield.staging import staged_file
from geofield.theme import web_theme
from geofield.web import inlined, page_file
from geofield.web.view import (
    margin_bounds,
    obstacles_view,
    outline_view,
    place_table,
    tracks_view,
)

_UNRECORDED = dict.fromkeys(("heading_deg", "spacing_m", "step_m"), math.nan)
#: Long side of the picture in the file, pixels.
LONG_SIDE_PX = 1600


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``{stem}.html``; the picture comes along where it lies beside the plan."""
    if not dataset.has(schema.FIELD.name):
        raise FormatError("A web page needs one field; there are 0.")
    path = folder / f"{stem}.html"
    path.write_text(document(dataset), encoding="utf-8", newline="\n")
    return [path]


@dataclass(frozen=True, slots=True)
class PlanPage:
    """A page that shows itself in a notebook.

    Attributes
    ----------
    text : str
        The whole HTML document.
    height_px : int
    """

    text: str
    height_px: int = 560

    def __repr__(self) -> str:
        return f"<map of a plan, {len(self.text) / 1e6:.1f} MB: shown in a notebook, or save(path)>"

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{html.escape(self.text)}" style="width:100%;border:0;'
            f'height:{self.height_px}px" sandbox="allow-scripts"></iframe>'
        )

    def save(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the page as a file that opens in any browser."""
        with staged_file(path, overwrite=overwrite) as place:
            place.write_text(self.text, encoding="utf-8", newline="\n")
        return Path(path)


def document(dataset: Dataset, scene: Scene | None = None) -> str:
    """The page as text.

    Parameters
    ----------
    dataset : Dataset
    scene : Scene, optional
        The picture; that beside the plan when not given.
    """
    values = plan_values(dataset, scene)
    data = json.dumps(values, ensure_ascii=False, separators=(",", ":"))
    # No name can then end the script that holds it, or open a comment in it.
    data = data.replace("<", "\\u003c")
    source = dataset.provenance.source
    credit = " · ".join(text for text in (source.attribution, source.licence, source.date) if text)
    style = page_file("vendor/ol.css").decode() + page_file("standalone.css").decode()
    script = inlined("said.js", "words.js", "symbols.js", "standalone.js")
    title = html.escape(dataset.name)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
<script>{_in_script(page_file("vendor/ol.js").decode())}</script>
</head><body>
<main id="map" tabindex="0" aria-label="{title}"></main>
<aside tabindex="0" aria-label="{title}"><h1>{title}</h1><dl id="facts"></dl><ul id="doubts"></ul>
<h2 data-t="legend"></h2><ul id="legend"></ul>
<small id="place"></small>
<small>{html.escape(credit)}</small><small>{html.escape(dataset.provenance.software)}</small></aside>
<div id="popup" role="status"></div>
<script type="application/json" id="plan">{data}</script>
<script type="module">
{_in_script(script)}
</script>
</body></html>
"""


def plan_values(dataset: Dataset, scene: Scene | None = None) -> dict[str, Any]:
    """What the page shows, as JSON values."""
    row = dataset.table(schema.FIELD.name).iloc[0]
    polygon, crs = row.geometry, dataset.crs
    if polygon.geom_type == "MultiPolygon":
        polygon = max(polygon.geoms, key=lambda part: part.area)
    evidence = dataset.provenance.evidence
    recorded, tracks = evidence.get("tracks"), None
    if recorded or dataset.has(schema.SEGMENTS.name):
        names = (schema.TRACKS.name, schema.SEGMENTS.name, schema.GAPS.name)
        tables = {**dataset.tables, **{name: dataset.table(name) for name in names}}
        # Of tracks that were imported nobody recorded how they were planned.
        outline = polygon if recorded else None
        tracks = Tracks.from_tables(tables, recorded or _UNRECORDED, outline=outline)
    picture, bounds = _picture(dataset, scene)
    bounds = bounds or margin_bounds(polygon)
    doubts = row["doubts"]
    return {
        **tracks_view(tracks, float(row["area_ha"])),
        "name": dataset.name,
        "area_ha": float(row["area_ha"]),
        "field": outline_view(
            polygon,
            method=str(row["method"]),
            certainty=float(row["certainty"]),
            doubts=doubts.split("; ") if isinstance(doubts, str) and doubts else (),
            frame=frame_lines(dataset),
        ),
        "doubts": list(dataset.provenance.obstacle_doubts),
        "obstacles": obstacles_view(dataset.tables.get(schema.OBSTACLES.name), tracks),
        "picture": picture,
        "bounds": bounds,
        "places": place_table(crs, bounds),
        "scale": 1.0 / float(ground_scale_of(polygon, crs)),
        "theme": web_theme(),
    }


def _picture(
    dataset: Dataset, scene: Scene | None
) -> tuple[str | None, tuple[float, float, float, float] | None]:
    """The picture as a data address, and where it lies."""
    from geofield.imagery.display import TiledPicture, shown_scene

    if scene is None and dataset.scene_path is not None and dataset.scene_path.exists():
        picture = TiledPicture.open(dataset.scene_path, dataset.crs)
        if picture.has_data(tuple(dataset.table(schema.FIELD.name).total_bounds)):
            scene = picture.reduced(LONG_SIDE_PX)
        else:
            name = dataset.scene_path.name
            words = f"The picture {name} holds no data at {dataset.name}: the page shows none."
            warn(words, ImageryWarning)
    if scene is None:
        return None, None
    data, kind, bounds = shown_scene(scene, dataset.crs, LONG_SIDE_PX)
    return f"data:{kind};base64,{base64.b64encode(data).decode()}", bounds


def _in_script(text: str) -> str:
    """Text that cannot end the script element it stands in."""
    return text.replace("</", "<\\/").replace("<!--", "<\\!--")
