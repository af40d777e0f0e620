"""Draw every picture of the documentation (python docs/scripts/make_pictures.py).

The pictures are committed, small, and the same after every run on the same libraries.
"""

from __future__ import annotations

import base64
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt
import nbformat
import pandas as pd
from PIL import Image
from shapely import Point, Polygon

import geofield as gf
from geofield.simulate import SimulationSettings

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
SAMPLE = ROOT / "sample_data" / "field_1.tif"
POINT: dict[str, Any] = {"lat": 35.075373, "lon": 33.531142}
CRS = "EPSG:32636"


def demo_map() -> None:
    """The map picture of `make demo`, for the README and the tutorial."""
    with tempfile.TemporaryDirectory() as folder:
        settings = gf.load_settings(overrides={"tracks": {"spacing_m": 4.0}})
        plan = gf.plan_field(SAMPLE, **POINT, settings=settings)
        plan.write(Path(folder) / "out", formats=["gpkg"])
        _keep(Path(folder) / "out" / "map.png", "demo_map.jpg", width_px=1100)


def wrong_outline() -> None:
    """A simulated field in haze, with strips of others."""
    hard = SimulationSettings(
        width_px=320, height_px=320, obstacles=60, equal_brightness=True, nir=False
    )
    clear = next(gf.simulate_fields(1, 41, hard)).scene
    hazy = replace(clear, bands=(0.05 * clear.bands + 120).astype("uint8"))
    settings = gf.load_settings(overrides={"tracks": {"spacing_m": 6.0}})
    with tempfile.TemporaryDirectory() as folder:
        plan = gf.plan_field(hazy, lat=35.074785, lon=33.531047, settings=settings)
        plan.write(Path(folder) / "out", formats=["gpkg"])
        _keep(Path(folder) / "out" / "map.png", "wrong_outline.jpg", width_px=900)


def review() -> None:
    """The first field after a person's review."""
    settings = gf.Settings(tracks={"spacing_m": 8.0})
    plan = gf.plan_field(SAMPLE, **POINT, settings=settings)
    obstacles = plan.obstacles
    assert obstacles is not None and plan.scene is not None  # noqa: PT018, S101
    number = obstacles["obstacle_no"]
    obstacles.loc[number % 2 == 0, "status"] = "confirmed"
    obstacles.loc[number % 7 == 3, "status"] = "rejected"
    inside = plan.field.polygon.buffer(-40).representative_point()
    added = gpd_row(inside.buffer(5), obstacles)
    obstacles = pd.concat([obstacles, added], ignore_index=True)
    edited = replace(plan, obstacles=obstacles)
    again = gf.plan_field(SAMPLE, **POINT, settings=settings, previous=edited)
    with tempfile.TemporaryDirectory() as folder:
        again.write(Path(folder) / "out", formats=["gpkg"])
        _keep(Path(folder) / "out" / "map.png", "review.jpg", width_px=900)


def gpd_row(shape: Polygon, like: pd.DataFrame) -> pd.DataFrame:
    """One drawn obstacle as a row of its own."""
    import geopandas as gpd

    return gpd.GeoDataFrame({"status": ["added"]}, geometry=[shape], crs=like.crs)


def meadow() -> None:
    """The plan of the tutorial on a real picture, without the picture: that stays its owner's."""
    chip = ROOT.parent / "shared" / "data" / "trees" / "riverside_2018_89.tif"
    if not chip.is_file():
        return
    settings = gf.load_settings(overrides={"tracks": {"spacing_m": 6.0}})
    scene = gf.read_scene(chip)
    owner = "J. Ventura et al., Urban Tree Detection Data; NAIP 2018"
    source = replace(scene.source, attribution=owner, licence="CC BY 4.0")
    scene = replace(scene, source=source)
    plan = gf.plan_field(scene, lat=33.930697, lon=-117.427058, settings=settings)
    plan = replace(plan, scene=None)
    with tempfile.TemporaryDirectory() as folder:
        plan.write(Path(folder) / "out", formats=["gpkg"])
        Image.open(Path(folder) / "out" / "map.png").save(IMAGES / "meadow_map.png")
    _shrink(IMAGES / "meadow_map.png")


def tracks() -> None:
    """Words of stage 4: tracks, segments, gaps and their causes."""
    outline = Polygon([(0, 0), (150, 0), (150, 46), (92, 46), (92, 70), (0, 76)])
    trees = [Point(45, 30).buffer(7, 32), Point(112, 16).buffer(5, 32)]
    away = (548_400, 3_881_600)
    moved = [_shift(shape, away) for shape in (outline, *trees)]
    planned = gf.plan_tracks(moved[0], moved[1:], crs=CRS, spacing_m=9.0, step_m=5.0)
    figure, axis = plt.subplots(figsize=(8, 4.2), dpi=110, layout="constrained")
    for tree in moved[1:]:
        axis.fill(*tree.exterior.xy, color="#a6d96a")
    axis.plot(*moved[0].exterior.xy, color="#222222", linewidth=1.6)
    planned.segments.plot(ax=axis, color="#2b7bba", linewidth=2)
    planned.gaps.plot(ax=axis, color="#e6550d", linewidth=1.4, linestyle=":")
    planned.points.plot(ax=axis, color="#2b7bba", markersize=6)
    for _, line in planned.segments.drop_duplicates("track_no").iterrows():
        x, y = line.geometry.coords[0]
        axis.text(x - 3, y, f"{line.track_no}", ha="right", va="center", fontsize=9)
    for _, gap in planned.gaps.iterrows():
        x, y = gap.geometry.interpolate(0.5, normalized=True).coords[0]
        axis.text(x, y + 1, gap.cause, ha="center", fontsize=8, color="#a63603")
    axis.set_aspect("equal")
    axis.set_axis_off()
    axis.set_title("Tracks with their numbers, segments (blue), points, and gaps with their causes")
    figure.savefig(IMAGES / "tracks.png")
    plt.close(figure)
    _shrink(IMAGES / "tracks.png")


def detection() -> None:
    """The last chart of notebook 02, as it was last run."""
    notebook = nbformat.read(ROOT / "notebooks" / "02_experiment.ipynb", as_version=4)
    pictures = [
        output.data["image/jpeg"]
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        if "image/jpeg" in output.get("data", {})
    ]
    (IMAGES / "detection.jpg").write_bytes(base64.b64decode(pictures[-1]))


def _shift(shape: Polygon, by: tuple[float, float]) -> Polygon:
    from shapely import affinity

    return affinity.translate(shape, *by)


def _keep(source: Path, name: str, *, width_px: int) -> None:
    picture = Image.open(source).convert("RGB")
    height_px = round(picture.height * width_px / picture.width)
    picture = picture.resize((width_px, height_px), Image.Resampling.LANCZOS)
    picture.save(IMAGES / name, quality=85, optimize=True)


def _shrink(path: Path) -> None:
    """Fewer colours: a drawing needs no more."""
    Image.open(path).convert("RGB").quantize(64).save(path, optimize=True)


def main() -> int:
    IMAGES.mkdir(exist_ok=True)
    for draw in (demo_map, wrong_outline, review, meadow, tracks, detection):
        draw()
    for path in sorted(IMAGES.iterdir()):
        print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1024:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
