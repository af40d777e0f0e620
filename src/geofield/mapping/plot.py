"""A plan on matplotlib axes, in the colours of the map and of QGIS."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geofield import schema, theme
from geofield.crs import grid_north_deg, ground_scale_of
from geofield.errors import FormatError, GeofieldError
from geofield.model.dataset import Dataset
from geofield.model.map_words import (
    credit_in_words,
    doubts_in_words,
    figures_in_words,
    frame_lines,
    length_in_words,
    round_length_m,
)
from geofield.model.scene import Scene
from geofield.wording import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_dataset(dataset: Dataset, scene: Scene | None = None, ax: Axes | None = None) -> Axes:
    """Draw the tables of a plan, on its picture where there is one, reprojected where need be.

    The axes are metres of the dataset's CRS, one scale for both.

    Raises
    ------
    GeofieldError
        When matplotlib is not installed.
    """
    if find_spec("matplotlib") is None:
        raise GeofieldError("Drawing this needs matplotlib.", hint="pip install 'geofield[plot]'")
    import geopandas as gpd
    from matplotlib import patheffects
    from matplotlib.lines import Line2D

    if ax is None:
        from matplotlib import pyplot as plt

        _, ax = plt.subplots(figsize=(8, 8), layout="constrained")
    if scene is not None:
        from geofield.imagery.display import shown_pixels

        pixels, (left, bottom, right, top) = shown_pixels(scene, dataset.crs, 2000)
        ax.imshow(pixels, extent=(left, right, bottom, top), zorder=1)
    casing = [patheffects.withStroke(linewidth=3, foreground="#00000090")]
    # With a casing they would be no text in an SVG.
    ground = {"facecolor": "black", "alpha": 0.5, "linewidth": 0, "pad": 0.8}
    number: Any = {"color": "white", "size": 6, "ha": "center", "va": "center", "zorder": 5}
    marks: list[Line2D] = []

    def draw(rows: gpd.GeoSeries, color: str, label: str, **style: Any) -> None:
        if len(rows):
            rows.plot(ax=ax, color=color, path_effects=casing, **{"zorder": 2, **style})
            dash = style.get("linestyle", "-")
            marks.append(Line2D([], [], c=color, ls=dash, label=label, path_effects=casing))

    def lines(layer: schema.Layer) -> gpd.GeoSeries:
        return dataset.table(layer.name).geometry

    draw(lines(schema.SEGMENTS), theme.TRACK, "tracks", linewidth=0.8)
    draw(lines(schema.HEADLAND_TRACKS), theme.HEADLAND, "headland tracks", linewidth=0.8)
    draw(lines(schema.GAPS), theme.GAP, "gaps", linewidth=0.8, linestyle=":")
    turns, fits = lines(schema.TURNS), dataset.table(schema.TURNS.name)["fits"]
    draw(turns[fits != "no"], theme.TURN, "turns", linewidth=0.8)
    # Wider than an obstacle's line: ways around obstacles lie on it.
    unfit = turns[fits == "no"]
    label = counted(len(unfit), "turn that does not fit", "turns that do not fit")
    draw(unfit, theme.UNFIT, label, linewidth=4)
    field = dataset.table(schema.FIELD.name)
    doubts = field["doubts"].iloc[0] if "doubts" in field else None
    line = (theme.DOUBT, "outline in doubt") if doubts else (theme.OUTLINE, "outline")
    draw(field.boundary, *line, linewidth=2, zorder=3)
    beyond = gpd.GeoSeries(frame_lines(dataset), crs=dataset.crs)
    draw(beyond, "black", "goes on outside", linewidth=2, zorder=3, linestyle="--")
    obstacles = dataset.table(schema.OBSTACLES.name)
    for status, look in theme.STATUS.items():
        rows = obstacles[obstacles["status"] == status]
        text = f"{counted(len(rows), 'obstacle')}, {status}"
        style = {"linestyle": (0, look.dash) if look.dash else "-", "linewidth": 1.4, "zorder": 4}
        draw(rows.boundary, look.color, text, **style)
        for no, place in zip(rows["obstacle_no"], rows.representative_point(), strict=True):
            ax.text(place.x, place.y, no, clip_on=True, bbox=ground, **number)
    ax.set_aspect("equal")
    # A name is no formula, whatever signs it has.
    ax.set_title(dataset.name, parse_math=False)
    ax.set_xlabel("easting, m")
    ax.set_ylabel("northing, m")
    ax.ticklabel_format(useOffset=False, style="plain")
    ax.legend(handles=marks, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    return ax


def write_svg(
    dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]
) -> list[Path]:
    """Draw ``map.svg``: lines stay lines, for print and for drawing programs."""
    return [_write(dataset, folder / "map.svg", options.get("scene"), {"Date": None})]


def write_pdf(
    dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]
) -> list[Path]:
    """Draw ``map.pdf``, one page of A4."""
    return [_write(dataset, folder / "map.pdf", options.get("scene"), {"CreationDate": None})]


def _write(dataset: Dataset, path: Path, scene: Scene | None, undated: Mapping[str, None]) -> Path:
    if not dataset.has(schema.FIELD.name):
        raise FormatError("A map needs one field; there are 0.")
    if scene is None and dataset.scene_path is not None:
        from geofield.imagery import read_scene

        scene = read_scene(dataset.scene_path)
    import matplotlib as mpl
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    # Not pyplot: no window, and no state that a program of the user's may have set.
    figure = Figure(figsize=(11.7, 8.3), layout="constrained")
    ax = plot_dataset(dataset, scene, figure.subplots())
    ax.set_title("")
    told = "\n".join(figures_in_words(dataset))
    ax.set_title(told, loc="left", fontsize=9, parse_math=False)
    _scale_bar(ax, dataset)
    below = "\n".join([*doubts_in_words(dataset), credit_in_words(dataset)])
    figure.supxlabel(below, fontsize=8, parse_math=False)
    words = figure.findobj(Text)
    families = _families("".join(each.get_text() for each in words))
    for each in words:
        each.set_fontfamily(families)
    with (
        mpl.rc_context({"svg.hashsalt": "geofield", "svg.fonttype": "none"}),
        warnings.catch_warnings(),
    ):
        # A name in a script that no font here has; the SVG has it as text all the same.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        figure.savefig(path, dpi=200, metadata=dict(undated))
    return path


def _families(text: str) -> list[str]:
    """DejaVu Sans, and for letters that it lacks installed fonts that have them."""
    from matplotlib.font_manager import findfont, fontManager, get_font

    families = ["DejaVu Sans"]
    missing = set(map(ord, text)) - get_font(findfont(families[0])).get_charmap().keys()
    # matplotlib's own font of last resort has every letter, as a box.
    upright = [
        each
        for each in fontManager.ttflist
        if each.style == "normal" and not each.name.startswith("Last Resort")
    ]
    # In one order, so that a machine draws the same map every time; regular before bold.
    for each in sorted(upright, key=lambda f: (f.weight not in (400, "normal"), f.name, f.fname)):
        if not missing - {10}:
            break
        found = missing & get_font(each.fname).get_charmap().keys()
        if found:
            families.append(each.name)
            missing -= found
    return families


def _scale_bar(ax: Axes, dataset: Dataset) -> None:
    """A bar of a round length on the ground, below on the left, and where north is."""
    scale = ground_scale_of(dataset.table(schema.FIELD.name).geometry.iloc[0], dataset.crs)
    left, right = ax.get_xlim()
    bottom, top = ax.get_ylim()
    length_m = round_length_m(0.25 * (right - left) / scale)
    x, y = left + 0.03 * (right - left), bottom + 0.04 * (top - bottom)
    ax.plot([x, x + length_m * scale], [y, y], color="black", linewidth=4, zorder=6)
    ax.plot([x, x + length_m * scale], [y, y], color="white", linewidth=2, zorder=7)
    ax.text(
        x,
        y + 0.01 * (top - bottom),
        f"{length_in_words(length_m)}; {_north(dataset)}",
        zorder=7,
        fontsize=8,
        bbox={"facecolor": "white", "alpha": 0.7, "linewidth": 0, "pad": 1.5},
    )
    ax.set_xlim(left, right)
    ax.set_ylim(bottom, top)


def _north(dataset: Dataset) -> str:
    """Where true north lies on the sheet, which is drawn in the zone."""
    centre = dataset.table(schema.FIELD.name).geometry.iloc[0].centroid
    turned_deg = grid_north_deg(dataset.crs, centre.x, centre.y)
    if abs(turned_deg) < 0.05:
        return "north is up"
    side = "left" if turned_deg > 0 else "right"
    return f"true north {abs(turned_deg):.1f}\N{DEGREE SIGN} to the {side} of up"
