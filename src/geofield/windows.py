"""Which part of a picture is read: around the point, and so wide that it shows what is known.

A small picture is read as a whole. Of a larger one the window holds the outline that is given or
was drawn, and the further points that were clicked: what it does not show is not searched.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely

from geofield.crs import GEOD, LONLAT, transformer
from geofield.errors import FieldError, ImageryWarning, PointOutsideError
from geofield.notes import warn

if TYPE_CHECKING:
    from geofield.grid import Grid
    from geofield.model import Field, Scene
    from geofield.plan import Plan
    from geofield.settings import Settings

#: Side of the first window where nobody asked for one, ground metres.
WINDOW_M = 400.0
_BLANK = (
    "A part of the picture is pure {} and counts as ground: is the file damaged, or does the "
    "picture end there? `gdal_edit.py -a_nodata {} PICTURE` says that nothing is seen there."
)
#: Ground shown around an outline.
_AROUND_M = 25.0


def open_scene(
    path: str | Path, lat: float, lon: float, settings: Settings, *, outline: Field | None = None
) -> Scene:
    """Read the picture around a point, degrees (stage 1), with all of an outline where it can.

    A picture that shows only a part of the outline, and not the point, is read around that part.

    Warns
    -----
    ImageryWarning
        Of all that had to be guessed about the picture.
    """
    try:
        scene = _read(path, lat, lon, settings, outline)
    except PointOutsideError:
        shown = None if outline is None else _point_shown(path, outline, settings)
        if shown is None:
            if outline is not None and outline.method == "boundary":
                refuse_elsewhere(outline, grid_of(path, settings))
            raise
        scene = _read(path, *shown, settings, outline)
    tell_guesses(scene)
    return scene


def refuse_elsewhere(boundary: Field, grid: Grid) -> None:
    """Refuse an outline that a picture does not show: often its coordinates are swapped."""
    frame = shapely.Polygon(grid.corners_lonlat())
    outline = boundary.polygon_lonlat
    if frame.intersects(outline):
        return
    swapped = shapely.transform(outline, lambda xy: xy[:, ::-1])
    raise FieldError(
        f"The boundary {boundary.name} lies outside the picture."
        + (" Its latitude and longitude look swapped." if frame.intersects(swapped) else ""),
        hint="Check the file's CRS and the order of its coordinates (`ogrinfo -al FILE`).",
    )


def tell_guesses(scene: Scene, *, after: Scene | None = None) -> None:
    """Warn of what had to be guessed about a picture and was not told `after` another scene."""
    told = () if after is None else _guesses(after)
    for guess in _guesses(scene):
        if guess not in told:
            warn(guess, ImageryWarning)


def _guesses(scene: Scene) -> tuple[str, ...]:
    from geofield.imagery.fill import blank_value

    value = None if scene.scaling else blank_value(scene.bands, scene.valid)
    told = () if value is None else (_BLANK.format("white" if value else "black", value),)
    return (*scene.guesses, *told)


def _read(
    path: str | Path, lat: float, lon: float, settings: Settings, outline: Field | None
) -> Scene:
    from geofield.imagery import read_scene

    asked = settings.imagery.model_dump()
    shown_m = reach_m(lat, lon, settings, outline)
    if asked["size_m"] is not None:
        asked["size_m"] = max(asked["size_m"], shown_m)
    # Of a field that is known a gap of the data in its middle is one as any other.
    asked |= {"least_m": max(WINDOW_M, shown_m), "on_data": outline is None}
    return read_scene(path, lat=lat, lon=lon, allow=settings.fetch.allow, **asked)


def _point_shown(
    path: str | Path, outline: Field, settings: Settings
) -> tuple[float, float] | None:
    """Latitude and longitude of a place in an outline that a picture shows; None without one."""
    grid = grid_of(path, settings)
    seen = outline.polygon_px(grid).intersection(shapely.box(0, 0, grid.width_px, grid.height_px))
    if not seen.area:
        return None
    inside = seen.representative_point()
    lon, lat = grid.to_lonlat(inside.x, inside.y)
    return lat, lon


def scene_of_plan(path: str | Path, plan: Plan, settings: Settings) -> Scene:
    """Read the picture that a plan was made from, so wide that it shows the plan's field."""
    imagery = (plan.settings or settings).imagery
    settings = settings.model_copy(update={"imagery": imagery})
    return open_scene(path, *plan.point, settings, outline=plan.field)


def wider(settings: Settings, size_m: float) -> Settings:
    """Settings for a window of another side, ground metres."""
    imagery = settings.imagery.model_copy(update={"size_m": size_m})
    return settings.model_copy(update={"imagery": imagery})


def showing(settings: Settings, lat: float, lon: float, outline: Field | None) -> Settings:
    """Settings for a picture that is fetched, with all of an outline where there is one."""
    if outline is None:
        return settings
    asked_m = settings.imagery.size_m or WINDOW_M
    return wider(settings, max(asked_m, reach_m(lat, lon, settings, outline)))


def first_side_m(scene: Scene, lat: float, lon: float, settings: Settings) -> float:
    """Side of the window that a scene was read in, or must be to show the points, ground metres."""
    size_m = settings.imagery.size_m
    side_m = size_m or max(scene.grid.shape) * scene.grid.ground_resolution_m
    if size_m is None and shows_points(scene, settings):
        return side_m
    return max(side_m, reach_m(lat, lon, settings, None))


def shows_points(scene: Scene, settings: Settings) -> bool:
    """Whether a scene shows all further points; one that was fetched is around the point alone."""
    places = (*settings.field.include, *settings.field.exclude)
    return all(scene.grid.contains_px(*scene.grid.from_lonlat(*place)) for place in places)


def shows_all(path: str | Path, lat: float, lon: float, scene: Scene, settings: Settings) -> bool:
    """Whether a scene is all of its picture."""
    whole = grid_of(path, settings, lat=lat, lon=lon).corners_lonlat()
    return bool(np.allclose(whole, scene.grid.corners_lonlat(), rtol=0.0, atol=1e-9))


def grid_of(path: str | Path, settings: Settings, **point: float) -> Grid:
    """The pixels of a whole picture, or set of pictures; `lat` and `lon` choose among grids."""
    from geofield.imagery import open_reader

    imagery = settings.imagery
    reader = open_reader(
        str(path), bands=imagery.bands, crs=imagery.crs, allow=settings.fetch.allow, **point
    )
    return reader.grid


def reach_m(lat: float, lon: float, settings: Settings, outline: Field | None) -> float:
    """Side of a window around a point that shows an outline and all further points, metres."""
    away_m = [
        1.05 * GEOD.line_length((lon, x), (lat, y))
        for x, y in (*settings.field.include, *settings.field.exclude)
    ]
    if outline is not None:
        x, y = transformer(LONLAT, outline.crs).transform(lon, lat)
        away = np.hypot(*(shapely.get_coordinates(outline.polygon) - (x, y)).T)
        away_m.append(float(away.max()) + _AROUND_M)  # whichever way the picture is turned
    return 2.0 * max(away_m, default=0.0)
