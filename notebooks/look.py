"""How the notebooks' pictures look: small, legible, the same everywhere."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib_inline.backend_inline import set_matplotlib_formats

from geofield.model import Scene

COLOURS = {
    "study": "#8c6d31",
    "ours": "#1b7837",
    "wrong": "#d6604d",
    "missed": "#b3b3b3",
    "correct": "#4393c3",
    "field": "#ffdd33",
    "track": "#5ae1ff",
    "obstacle": "#ff3c3c",
}


def use() -> None:
    """Set sizes once per notebook; pictures are kept as small JPEG."""
    set_matplotlib_formats("jpeg", pil_kwargs={"quality": 80})
    plt.rcParams.update(
        {
            "figure.dpi": 90,
            "savefig.dpi": 90,
            "figure.constrained_layout.use": True,
            "font.size": 9,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.titlesize": 10,
        }
    )
    pd.set_option("display.width", 120)
    pd.set_option("display.max_columns", 20)


def show_scene(axes: Axes, scene: Scene) -> None:
    """Draw a picture in its own coordinates, so that tables in the same CRS lie on it."""
    grid = scene.grid
    left, top = grid.transform @ (0, 0)
    right, bottom = grid.transform @ (grid.width_px, grid.height_px)
    axes.imshow(scene.rgb, extent=(left, right, bottom, top))
    axes.set_axis_off()


def side_by_side(columns: int, rows: int = 1, height: float = 3.4) -> tuple[plt.Figure, np.ndarray]:
    """A figure with axes in a row (or rows), as wide as a page."""
    return plt.subplots(rows, columns, figsize=(9, height * rows), squeeze=False)
