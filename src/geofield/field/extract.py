"""Extract a field: from a picture and a point to the polygon in the metric CRS."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Literal

import shapely
from shapely import Polygon

from geofield.errors import FieldError, FieldWarning, SettingsError
from geofield.field.diffusion import diffused
from geofield.field.outline import straight_outline
from geofield.field.quality import judge
from geofield.field.segmentation import fill_holes, part_at
from geofield.methods import FIELD
from geofield.methods import method as method_of
from geofield.model import Field, Scene
from geofield.model.segmentation import Segmentation

Holes = Literal["fill", "keep"]
Smoothing = Literal["none", "diffusion"]


def extract_field(
    scene: Scene,
    *,
    lat: float,
    lon: float,
    method: str = "auto",
    regions: Sequence[int] = (),
    holes: Holes | None = None,
    min_hole_m2: float = 20.0,
    tolerance_px: float = 3.0,
    smooth: Smoothing = "none",
    name: str = "",
) -> Field:
    """Find the outline of the field around a point.

    Parameters
    ----------
    scene : Scene
    lat, lon : float
        A point in the field, degrees, WGS 84.
    method : str
        ``auto`` uses colour, near infrared, texture and edges; ``study`` is the study's
        threshold (METHOD.md, section 2).
    regions : sequence of int
        Of method ``study``: take these numbered regions instead of the one at the point.
    holes : {"fill", "keep"}, optional
        What becomes of crowns, huts and ponds inside: part of the field, for stage 3 to
        find, or holes in the polygon. Filled by ``auto``, kept by ``study`` when None.
    min_hole_m2 : float
        Holes below this size are always filled, square metres on the ground.
    tolerance_px : float
        How far the straightened outline may leave the mask's border; 0 keeps the staircase.
    smooth : {"none", "diffusion"}
        Smoothing of the picture first: anisotropic diffusion keeps borders and evens
        surfaces.
    name : str

    Returns
    -------
    Field
        In the grid's metric CRS, with its `quality`.

    Raises
    ------
    PointOutsideError
        When the point is outside the picture or on no data.
    FieldError
        When there is no field to take.

    Warns
    -----
    FieldWarning
        When the outline should not be trusted unseen.
    """
    if method not in FIELD:
        raise SettingsError(
            f"Unknown field method {method!r}.", hint=f"Methods: {', '.join(FIELD)}."
        )
    if regions and method != "study":
        raise SettingsError(
            f"Numbered regions belong to method study, not {method}.", hint="Use method study."
        )
    if holes not in (None, "fill", "keep"):
        raise SettingsError(f"Unknown choice {holes!r} for holes.", hint="Use fill or keep.")
    if min_hole_m2 < 0 or tolerance_px < 0:
        raise SettingsError("Hole size and outline tolerance must not be below zero.")
    if smooth not in ("none", "diffusion"):
        raise SettingsError(f"Unknown smoothing {smooth!r}.", hint="Use none or diffusion.")
    x_px, y_px = scene.pixel_of(lat=lat, lon=lon)
    if scene.is_blank:
        raise FieldError(
            "The picture is empty: all its pixels have the same value.",
            hint="Check the source, the band and the scaling, for instance with QGIS.",
        )
    picture = diffused(scene) if smooth == "diffusion" else scene
    chosen = {"regions": tuple(regions)} if regions else {}
    found: Segmentation = method_of(FIELD, method)(picture, x_px, y_px, **chosen)
    keep = holes == "keep" or (holes is None and method == "study")
    resolution = scene.grid.ground_resolution_m
    smallest = min_hole_m2 / resolution**2 if keep else None
    filled = fill_holes(found.mask, smallest_kept_px=smallest)
    if not regions:
        filled = part_at(filled, x_px, y_px)
    if not filled.any():
        raise FieldError(
            f"No field was found at lat {lat}, lon {lon}.",
            hint="Choose a point in the open field, or give its outline with --boundary.",
        )
    outline_px = straight_outline(filled, tolerance_px=tolerance_px)
    quality = judge(scene, filled, outline_px, found, (x_px, y_px))
    field = Field(
        _to_metric(outline_px, scene),
        scene.grid.metric_crs,
        name=name,
        method=method if not regions else "study-manual",
        quality=quality,
        imagery=scene.source.name,
        imagery_date=scene.source.date,
        licence=scene.source.licence,
    )
    if not quality.trusted:
        warnings.warn(
            f"The outline of field {field.name} should be looked at before use: "
            f"{'; '.join(quality.reasons)}.",
            FieldWarning,
            stacklevel=2,
        )
    return field


def _to_metric(outline_px: Polygon, scene: Scene) -> Polygon:
    polygon = shapely.transform(outline_px, scene.grid.to_metric_array)
    if not polygon.is_valid:
        polygon = max(
            (p for p in shapely.get_parts(shapely.make_valid(polygon)) if isinstance(p, Polygon)),
            key=lambda p: p.area,
        )
    return polygon
