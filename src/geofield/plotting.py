"""A plan on matplotlib axes, in the colours of the map and of QGIS."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from geofield import schema, theme
from geofield.errors import GeofieldError
from geofield.model.dataset import Dataset
from geofield.model.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_dataset(dataset: Dataset, scene: Scene | None = None, ax: Axes | None = None) -> Axes:
    """Draw the tables of a plan.

    Parameters
    ----------
    dataset : Dataset
    scene : Scene, optional
        The picture below; reprojected where it is in another CRS.
    ax : Axes, optional

    Returns
    -------
    Axes
        x and y in metres of the dataset's CRS, one scale for both.

    Raises
    ------
    GeofieldError
        When matplotlib is not installed.
    """
    try:
        from matplotlib import patheffects
        from matplotlib import pyplot as plt
        from matplotlib.lines import Line2D
    except ImportError as error:
        raise GeofieldError(
            "plot() needs matplotlib.", hint="pip install 'geofield[plot]'"
        ) from error

    if ax is None:
        _, ax = plt.subplots(figsize=(8, 8), layout="constrained")
    if scene is not None:
        _draw_picture(ax, scene, dataset)
    casing = [patheffects.withStroke(linewidth=3, foreground="#00000090")]
    marks: list[Line2D] = []

    def draw(layer: str, color: str, label: str, **style: object) -> None:
        table = dataset.table(layer) if layer in dataset.tables else None
        if table is not None and len(table):
            table.plot(ax=ax, color=color, path_effects=casing, zorder=2, **style)
            marks.append(Line2D([], [], color=color, label=label, path_effects=casing))

    draw(schema.SEGMENTS.name, theme.TRACK, "tracks", linewidth=0.8)
    draw(schema.HEADLAND_TRACKS.name, theme.HEADLAND, "headland tracks", linewidth=0.8)
    draw(schema.GAPS.name, theme.GAP, "gaps", linewidth=0.8, linestyle=":")
    draw(schema.TURNS.name, theme.TURN, "turns", linewidth=0.8)
    field = dataset.table(schema.FIELD.name)
    doubts = field["doubts"].iloc[0] if "doubts" in field else None
    color, label = (theme.DOUBT, "outline in doubt") if doubts else (theme.OUTLINE, "outline")
    field.boundary.plot(ax=ax, color=color, linewidth=2, path_effects=casing, zorder=3)
    marks.append(Line2D([], [], color=color, linewidth=2, label=label, path_effects=casing))
    obstacles = dataset.table(schema.OBSTACLES.name)
    for status, look in theme.STATUS.items():
        rows = obstacles[obstacles["status"] == status]
        if len(rows):
            dash: Any = (0, look.dash) if look.dash else "-"
            style = {"linestyle": dash, "linewidth": 1.4, "path_effects": casing, "zorder": 4}
            rows.boundary.plot(ax=ax, color=look.color, **style)
            text = f"{len(rows)} {status}"
            marks.append(Line2D([], [], color=look.color, linestyle=dash, label=text))
    ax.set_aspect("equal")
    ax.set_title(dataset.name)
    ax.set_xlabel("easting, m")
    ax.set_ylabel("northing, m")
    ax.ticklabel_format(useOffset=False, style="plain")
    ax.legend(handles=marks, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return ax


def _draw_picture(ax: Axes, scene: Scene, dataset: Dataset) -> None:
    from geofield.imagery.display import shown_pixels

    pixels, (left, bottom, right, top) = shown_pixels(scene, dataset.crs, 2000)
    ax.imshow(np.asarray(pixels), extent=(left, right, bottom, top), zorder=1)
