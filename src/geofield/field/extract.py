"""Extract a field: from a picture and a point to the polygon in the metric CRS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal, get_args

import numpy as np
import shapely
from shapely import Polygon

from geofield.errors import (
    FieldError,
    FieldWarning,
    ImageryError,
    SettingsError,
    refuse_no_number,
    refuse_other,
    refuse_unknown,
)
from geofield.field.diffusion import diffused
from geofield.field.morphology import fill_holes, part_at_any
from geofield.field.outline import largest_valid, straight_outline
from geofield.field.part import Part
from geofield.field.plausible import look
from geofield.field.points import EXACT_PX, drawn, obeying
from geofield.field.quality import judge
from geofield.field.views import FieldSearch
from geofield.grid import Grid
from geofield.methods import FIELD
from geofield.methods import method as method_of
from geofield.model import Alternative, Field, FieldQuality, Scene
from geofield.model.scene import OPEN_IT
from geofield.model.segmentation import Segmentation
from geofield.model.upright import upright
from geofield.notes import warn
from geofield.raster import gaps_filled

Holes = Literal["fill", "keep"]
Smoothing = Literal["none", "diffusion"]
#: An alternative this near to a side of the part that was searched runs along it, pixels.
_NEAR_PX = 2.5
#: Longitude and latitude, degrees.
Places = Sequence[tuple[float, float]]


def extract_field(
    scene: Scene,
    *,
    lat: float,
    lon: float,
    include: Places = (),
    exclude: Places = (),
    method: str = "auto",
    regions: Sequence[int] = (),
    holes: Holes | None = None,
    min_hole_m2: float = 20.0,
    tolerance_px: float = 3.0,
    smooth: Smoothing = "none",
    name: str = "",
    search: FieldSearch | None = None,
) -> Field:
    """Find the outline of the field around a point.

    >>> scene = gf.read_scene("sample_data/field_1.tif")
    >>> field = gf.extract_field(scene, lat=35.075373, lon=33.531142)
    >>> 3.0 < field.area_ha < 4.0
    True

    Parameters
    ----------
    scene : Scene
    lat, lon : float
        A point in the field, degrees, WGS 84.
    include, exclude : sequence of (lon, lat)
        Further points, degrees: ground that belongs to the field, ground that does not. What
        they say is obeyed.
    method : str
        ``auto`` asks a network, and what the picture shows along borders in all its bands;
        ``study`` is the study's threshold (METHOD.md, section 2).
    regions : sequence of int
        Of method ``study``: take these numbered regions instead of the one at the point.
    holes : {"fill", "keep"}, optional
        What becomes of crowns, huts and ponds inside: part of the field, for stage 3 to
        find, or holes in the polygon. Filled by ``auto``, kept by ``study`` when None.
    min_hole_m2 : float
        Holes below this size are always filled, square metres on the ground.
    tolerance_px : float
        How far the straightened outline may leave the mask's border; 0 keeps the staircase. Of
        ``auto``, pixels of a small picture (170 and fewer along a side) count as it enlarges them.
    smooth : {"none", "diffusion"}
        Smoothing of the picture first: anisotropic diffusion keeps borders and evens
        surfaces.
    name : str
    search : FieldSearch, optional
        What `prepare_field` made of the same scene, point and smoothing, and of no other: further
        points then cost only what they change.

    Returns
    -------
    Field
        In the grid's metric CRS, with its `quality` and, of ``auto``, its `alternatives`.

    Raises
    ------
    PointOutsideError
        When a point is outside the picture or on no data.
    FieldError
        When there is no field to take, or points contradict each other.

    Warns
    -----
    FieldWarning
        When the outline should not be trusted unseen.
    """
    refuse_other(scene, Scene, "scene", OPEN_IT, ImageryError)
    _check(method, regions, (*include, *exclude), holes, smooth)
    refuse_no_number(SettingsError, "square metres", min_hole_m2=min_hole_m2)
    refuse_no_number(SettingsError, "pixels", tolerance_px=tolerance_px)
    if min_hole_m2 < 0 or tolerance_px < 0:
        raise SettingsError("Hole size and outline tolerance must not be below zero.")
    _check_places(scene, (lon, lat), include, exclude)
    scene = upright(scene)
    if method == "auto":
        scene = _with_data(scene)
    picture = diffused(scene) if smooth == "diffusion" else scene
    part, whole, shown_px = Part.whole(scene), scene.grid, scene.shown_px
    chosen: dict[str, Any] = {"regions": tuple(regions)} if regions else {}
    if method == "auto":
        search = search or FieldSearch((lon, lat))
        search.refuse_another(picture, (lon, lat))
        view = search.view(picture, *(tuple((x, y) for x, y in one) for one in (include, exclude)))
        part, chosen = view.part, {"search": view.search}
    scene, picture = part.of(scene), part.of(picture)
    seed = scene.pixel_of(lat=lat, lon=lon)
    belong, apart = (
        tuple(scene.pixel_of(lat=y, lon=x) for x, y in places) for places in (include, exclude)
    )
    if method == "auto":
        chosen |= {"include": belong, "exclude": apart}
    found: Segmentation = method_of(FIELD, method)(picture, *seed, **chosen)
    keep = holes == "keep" or (holes is None and method == "study")
    smallest = min_hole_m2 / scene.grid.ground_resolution_m**2 if keep else None
    seen, shown = look(scene), part.from_picture(shown_px)

    def outlined(one: Segmentation) -> tuple[Polygon, FieldQuality]:
        """Outline, pixel coordinates, and its quality."""
        filled = fill_holes(one.mask, smallest_kept_px=smallest)
        if not regions:
            filled = part_at_any(filled, (seed, *belong))
        if not filled.any():
            raise FieldError(
                f"No field was found at lat {lat}, lon {lon}.",
                hint="Choose a point in the open field, or give its outline with --boundary.",
            )
        draw = partial(straight_outline, filled)
        if belong or apart:
            points = (seed, *belong), apart
            tolerances_px = tolerance_px, min(tolerance_px, EXACT_PX)
            outline_px = obeying(drawn(draw, tolerances_px, *points), *points)
        else:
            outline_px = draw(tolerance_px=tolerance_px)
        return outline_px, judge(scene, seen, filled, outline_px, one, seed, part.frame_px, shown)

    outline_px, quality = outlined(found)
    others = [outlined(one) for one in found.alternatives]
    # What goes on beyond the part that was searched is not all of a field.
    others = [one for one in others if not part.cuts(one[0], _NEAR_PX)]
    offered = [(outline_px, quality), *others] if method == "auto" else []
    field = Field(
        _to_metric(part.to_picture(outline_px), whole),
        whole.metric_crs,
        name=name,
        method=method if not regions else "study-manual",
        quality=quality,
        imagery=scene.source.name,
        imagery_date=scene.source.day,
        licence=scene.source.licence,
        alternatives=tuple(
            Alternative(_to_metric(part.to_picture(one), whole), dict(its.figures)["certainty"])
            for one, its in offered
        ),
    )
    if not quality.trusted:
        warn(
            f"The outline of field {field.name} should be looked at before use: "
            f"{'; '.join(quality.reasons)}.",
            FieldWarning,
        )
    return field


def prepare_field(
    scene: Scene, *, lat: float, lon: float, smooth: Smoothing = "none"
) -> FieldSearch:
    """What `extract_field` can keep between points; it can be pickled.

    >>> scene = gf.read_scene("sample_data/field_1.tif")
    >>> point = {"lat": 35.075373, "lon": 33.531142}
    >>> search = gf.prepare_field(scene, **point)
    >>> field = gf.extract_field(scene, **point, search=search, exclude=[(33.5325, 35.0743)])

    Parameters
    ----------
    scene : Scene
    lat, lon : float
        The point in the field, degrees, WGS 84.
    smooth : {"none", "diffusion"}
        As `extract_field` is to be asked.
    """
    refuse_other(scene, Scene, "scene", OPEN_IT, ImageryError)
    refuse_unknown(SettingsError, "smoothing", smooth, get_args(Smoothing))
    search, shown = FieldSearch((lon, lat)), _with_data(upright(scene))
    shown = diffused(shown) if smooth == "diffusion" else shown
    search.refuse_another(shown, (lon, lat))
    search.view(shown)
    return search


def _check(
    method: str, regions: Sequence[int], further: Places, holes: str | None, smooth: str
) -> None:
    """Refuse choices that do not exist or do not go together."""
    refuse_unknown(SettingsError, "field method", method, FIELD)
    for number in regions:
        refuse_no_number(SettingsError, "of a region that is listed", whole=True, regions=number)
    if regions and method != "study":
        raise SettingsError(
            f"Numbered regions belong to method study, not {method}.", hint="Use method study."
        )
    if further and method != "auto":
        raise SettingsError(
            f"Further points belong to method auto, not {method}.", hint="Use method auto."
        )
    if holes is not None:
        refuse_unknown(SettingsError, "choice for holes", holes, get_args(Holes))
    refuse_unknown(SettingsError, "smoothing", smooth, get_args(Smoothing))


def _check_places(
    scene: Scene, point: tuple[float, float], include: Places, exclude: Places
) -> None:
    """Refuse places off the picture, and a picture that shows nothing."""
    scene.pixel_of(lat=point[1], lon=point[0])
    for option, places in (("--include-lonlat", include), ("--exclude-lonlat", exclude)):
        for place in places:
            try:
                lon, lat = (float(each) for each in place)
            except (TypeError, ValueError):
                raise FieldError(
                    f"{option} is a sequence of pairs (lon, lat) in degrees; {place!r} is none.",
                    hint="Of a shapely point give (point.x, point.y).",
                ) from None
            scene.pixel_of(lat=lat, lon=lon, option=option)
    if scene.valid.size == 1:
        raise FieldError(
            "The picture is one pixel: no field can be seen in it.",
            hint="Give a picture that shows the whole field.",
        )
    if scene.is_blank:
        raise FieldError(
            "The picture is empty: all its pixels have the same value.",
            hint="Check the source, the band and the scaling, for instance with QGIS.",
        )


def _with_data(scene: Scene) -> Scene:
    """The picture as far as it has data: an empty margin is no ground, and its values nothing.

    A side where data end is then the picture's side, which no outline is judged by.
    """
    if scene.valid.all() or not scene.valid.any():
        return scene
    rows, columns = (np.flatnonzero(scene.valid.any(axis=axis)) for axis in (1, 0))
    size = columns[-1] + 1 - columns[0], rows[-1] + 1 - rows[0]
    shown = scene.crop(*(int(each) for each in (columns[0], rows[0], *size)))
    return replace(shown, bands=gaps_filled(shown.bands, shown.valid))


def _to_metric(outline_px: Polygon, grid: Grid) -> Polygon:
    return largest_valid(shapely.transform(outline_px, grid.to_metric_array))
