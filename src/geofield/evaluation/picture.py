"""Reading and drawing for an evaluation: hits, misses and false detections on the picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from geofield import schema
from geofield.crs import LONLAT, is_utm, refuse_outside, transformer, utm_crs
from geofield.errors import CRSError, ObstacleError
from geofield.evaluation.compare import Evaluation, compared
from geofield.finite import refuse_nowhere
from geofield.model.scene import Scene
from geofield.staging import cannot_write
from geofield.strangers import check_vector, unreadable

if TYPE_CHECKING:
    import geopandas as gpd

HIT, MISSED, FALSE = (40, 200, 90), (60, 150, 255), (235, 60, 50)
_SIDE_PX = 1200


def read_obstacles(path: Path, layer: str | None = None) -> gpd.GeoDataFrame:
    """Read a table of obstacles or of a truth from any vector file.

    Parameters
    ----------
    path : path
    layer : str, optional
        When not given or when the file has one layer only: `obstacles`, else the first one.

    Raises
    ------
    ObstacleError
        When the file cannot be read or has no such layer.
    """
    import geopandas as gpd
    import pyogrio

    check_vector(path)
    try:
        layers = [str(name) for name in pyogrio.list_layers(path)[:, 0]]
        if layer is not None and layer not in layers:
            if len(layers) > 1:
                raise ObstacleError(
                    f"{path.name} has no layer {layer!r}.", hint=f"Layers: {', '.join(layers)}."
                )
            layer = None
        usual = schema.OBSTACLES.name if schema.OBSTACLES.name in layers else layers[0]
        frame = gpd.read_file(path, layer=layer or usual)
        if not isinstance(frame, gpd.GeoDataFrame):
            raise ObstacleError(
                f"The layer {layer or usual!r} of {path.name} is a table without shapes.",
                hint="Give one of points, boxes or polygons.",
            )
    except pyogrio.errors.DataSourceError as error:
        told = unreadable(path, error)
        raise ObstacleError(told.message, hint=told.hint) from None
    return frame


def placed(frame: gpd.GeoDataFrame, name: str, *, metric: bool = False) -> gpd.GeoDataFrame:
    """A table of a file that is somewhere; `metric` in the UTM zone where it is in another CRS.

    Raises
    ------
    CRSError
        When it has no CRS, or lies outside it.
    """
    refuse_nowhere(frame.geometry.to_numpy(), name)
    if frame.crs is None:
        raise CRSError(
            f"{name} has no CRS.", hint="Set it in QGIS (Set layer CRS), or give lon and lat."
        )
    if metric and not is_utm(frame.crs):
        lies = np.isfinite(frame.total_bounds).all()  # else any zone will do
        west, south, east, north = frame.total_bounds if lies else (0.0, 0.0, 0.0, 0.0)
        middle = (west + east) / 2, (south + north) / 2
        lon, lat = transformer(frame.crs, LONLAT).transform(*middle)
        refuse_outside(frame.crs, lon, lat, what=f"Coordinates of {name}")
        frame = frame.to_crs(utm_crs(lon, lat))
    return frame


def draw_matches(
    detected: gpd.GeoDataFrame,
    truth: gpd.GeoDataFrame,
    result: Evaluation,
    path: Path,
    scene: Scene | Path | None = None,
    *,
    area: Any = None,
) -> None:
    """Write a PNG of hits (green), misses (blue) and false detections (red).

    Parameters
    ----------
    detected, truth : GeoDataFrame
        What was evaluated, one picture.
    result : Evaluation
    path : path
        PNG to write.
    scene : Scene or path, optional
        Picture to draw on; white ground when not given.
    area : shapely geometry, optional
        That of the evaluation.
    """
    from PIL import Image, ImageDraw

    if isinstance(scene, Path):
        from geofield.imagery.pictures import open_reader
        from geofield.imagery.scene import read_part

        reader = open_reader(str(scene))  # read coarser where it is large
        scene = read_part(reader, (0, 0, reader.grid.width_px, reader.grid.height_px))
    detected, truth = compared(detected, truth, area)
    match = next(iter(result.matches.values()))
    crs = detected.crs
    if scene is not None:
        scale = max(min(_SIDE_PX / max(scene.grid.shape), 4.0), 0.05)
        size = (round(scene.grid.width_px * scale), round(scene.grid.height_px * scale))
        canvas = Image.fromarray(scene.rgb).resize(size)
        grid = scene.grid

        def place(c: NDArray[np.float64]) -> NDArray[np.float64]:
            x, y = grid.from_crs(c[:, 0], c[:, 1], crs)
            return np.column_stack([x, y]).astype(float) * scale
    else:
        shapes = np.concatenate([detected.geometry.to_numpy(), truth.geometry.to_numpy()])
        west, south, east, north = shapely.total_bounds(shapes) if len(shapes) else np.zeros(4)
        extent = max(east - west, north - south, 10.0) * 1.1
        centre = np.array([(west + east) / 2, (south + north) / 2])
        canvas = Image.new("RGB", (_SIDE_PX, _SIDE_PX), "white")

        def place(c: NDArray[np.float64]) -> NDArray[np.float64]:
            turned = (c - centre) * np.array([1.0, -1.0])
            return np.asarray(turned * (_SIDE_PX / extent) + _SIDE_PX / 2, dtype=np.float64)

    pen = ImageDraw.Draw(canvas)
    hit = np.isin(np.arange(match.detected_count), match.detected_index)
    for shape, good in zip(detected.geometry.to_numpy(), hit, strict=True):
        colour = HIT if good else FALSE
        for part in shapely.get_parts(shape):
            ring = place(shapely.get_coordinates(part))
            if len(ring) == 1:
                (x, y) = ring[0]
                pen.ellipse([x - 7, y - 7, x + 7, y + 7], outline=colour, width=2)
            pen.line([tuple(p) for p in ring], fill=colour, width=2)
    met = np.isin(np.arange(match.truth_count), match.truth_index)
    centres = place(shapely.get_coordinates(shapely.centroid(truth.geometry.to_numpy())))
    for (x, y), good in zip(centres, met, strict=True):
        pen.rectangle([x - 3, y - 3, x + 3, y + 3], fill=HIT if good else MISSED)
    try:  # a PNG, whatever the file is called
        canvas.save(path, "PNG")
    except OSError as error:
        raise cannot_write(path, error) from None
