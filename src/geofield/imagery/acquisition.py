"""From a source and a place to a picture on disk: stage 1 as one call."""

from __future__ import annotations

import math
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from geofield.errors import ImageryError, ImageryWarning
from geofield.grid import Grid
from geofield.imagery.cache import TileCache
from geofield.imagery.client import Client
from geofield.imagery.fetch import FetchReport, Progress, TileFetcher, absence_error
from geofield.imagery.mosaic import stage_rows, stage_to_cog
from geofield.imagery.opening import FetchOptions
from geofield.imagery.pictures import open_reader
from geofield.imagery.reader import SceneReader
from geofield.imagery.scene import read_part, read_scene
from geofield.imagery.sources.base import PictureSource, Source, Tiles, TileSource
from geofield.imagery.sources.google import GoogleStaticSource
from geofield.imagery.tags import source_tags
from geofield.imagery.terms import check_terms
from geofield.imagery.tiling import Block
from geofield.imagery.write import replacing, write_scene
from geofield.model.scene import ImagerySource, Scene, outside
from geofield.notes import warn

#: Side of a square of which no other size is asked for, pixels: that of the study's pictures.
FRAME_PX = 640
Zoom = int | Literal["max", "fit"] | None


@dataclass(frozen=True, slots=True)
class Where:
    """What part of the earth is wanted: a square around a point, or an area.

    Attributes
    ----------
    lat, lon : float, optional
        The centre, degrees, WGS 84.
    size_px, size_m : optional
        Side of the square, pixels (640 by default) or ground metres.
    area : shapely geometry, optional
        In lon/lat degrees, across 180 running on beyond; instead of the square, or with a point to
        look around in it.
    zoom : int, "max", "fit" or None
        The source's zoom; its finest; the largest at which the area (or `size_m`) still fits
        a frame of 640 px; None takes `resolution_m`.
    resolution_m : float
        Ground resolution wanted when no zoom is given.
    whole_tiles : bool
        Keep the touched tiles whole.
    """

    lat: float | None = None
    lon: float | None = None
    size_px: int | None = None
    size_m: float | None = None
    area: BaseGeometry | None = None
    zoom: Zoom = None
    resolution_m: float = 0.6
    whole_tiles: bool = False

    def __post_init__(self) -> None:
        if self.area is None and (self.lat is None or self.lon is None):
            raise ImageryError(
                "A place needs a point (lat and lon) or an area.", hint="Give --lat and --lon."
            )
        if self.size_px is not None and self.size_m is not None:
            raise ImageryError("The size is given twice.", hint="Give metres or pixels, not both.")

    @property
    def point(self) -> tuple[float, float]:
        """Latitude and longitude of the point, or of the area's middle."""
        if self.lat is not None and self.lon is not None:
            return self.lat, self.lon
        assert self.area is not None  # noqa: S101  (made sure above)
        west, south, east, north = self.area.bounds
        lon = (west + east) / 2
        return (south + north) / 2, lon - 360.0 * (lon > 180.0)


@dataclass(frozen=True, slots=True)
class Acquired:
    """What `acquire` made."""

    path: Path
    grid: Grid
    source: ImagerySource
    report: FetchReport


def acquire(
    source: Source,
    place: Where,
    path: str | Path,
    *,
    options: FetchOptions | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Acquired:
    """Get the picture of a place from a source and write it as a COG.

    Parameters
    ----------
    source : Source
        From `geofield.imagery.sources.find_source`.
    place : Where
    path : path
        The GeoTIFF to write.
    options : FetchOptions, optional
    overwrite : bool
    progress : callable (done, total, what), optional

    Raises
    ------
    TermsError
        The source forbids deriving geodata and that was not acknowledged.
    NetworkError
        A server cannot be reached.
    ImageryError
        Tiles are missing (unless masked), zoom or place are not the source's.
    """
    options = options or FetchOptions()
    check_terms(source.name, source.terms, acknowledged=options.acknowledged)
    if isinstance(source, PictureSource):
        return _picture(source, place, path, options.allow, overwrite)
    source, block = plan(source, place)
    with ExitStack() as stack:
        temporary = stack.enter_context(replacing(path, overwrite=overwrite))
        fetcher = _fetcher(source, options, stack)
        staged = temporary.with_suffix(".rows.tif")
        stack.callback(_remove_siblings, temporary)
        # Closed before the cache is: what has arrived when the work stops is still kept.
        rows = stack.enter_context(closing(fetcher.rows(block, progress)))
        missing_px = stage_rows(staged, block, rows)
        report = fetcher.report
        # A file of one's own shows what it shows, as any picture; a server may have had more.
        masked = options.missing == "mask" or not (report.failed or isinstance(source, TileSource))
        if report.absent and (not masked or report.absent == report.wanted):
            raise absence_error(source, report, offline=options.offline)
        _tell_nothing(source, block, missing_px, report)
        provenance = _provenance(source, block, report)
        if progress is not None:
            progress(block.count, block.count, "writing")
        stage_to_cog(staged, temporary, source_tags(provenance))
    return Acquired(Path(path), block.grid, provenance, report)


def plan(source: Tiles, place: Where) -> tuple[Tiles, Block]:
    """The tiles that a place needs, and the source to ask for them."""
    pyramid = source.pyramid
    lat, lon = place.point
    zoom = choose_zoom(source, place)
    if isinstance(source, GoogleStaticSource):
        size = place.size_px or FRAME_PX
        if place.size_m is not None:
            size = round(place.size_m / pyramid.ground_resolution_m(zoom, lat=lat, lon=lon))
        return source.framed(zoom, lat=lat, lon=lon, size_px=size)
    if place.area is not None and place.size_px is None and place.size_m is None:
        return source, pyramid.block_over(zoom, place.area, whole_tiles=place.whole_tiles)
    return source, pyramid.block_around(
        zoom,
        lat=lat,
        lon=lon,
        size_px=place.size_px,
        size_m=place.size_m,
        whole_tiles=place.whole_tiles,
    )


def choose_zoom(source: Tiles, place: Where) -> int:
    """The zoom that a place asks for."""
    pyramid = source.pyramid
    lat, lon = place.point
    if place.zoom == "max":
        return pyramid.zooms[1]
    if place.zoom == "fit":
        if place.area is not None:
            return pyramid.zoom_to_fit(place.area, FRAME_PX)
        if place.size_m is None:
            raise ImageryError(
                "Fitting the zoom needs a size in metres or an area.", hint="Add --size-m 400."
            )
        for level in reversed(pyramid.levels):
            resolution_m = pyramid.ground_resolution_m(level.zoom, lat=lat, lon=lon)
            if place.size_m / resolution_m <= FRAME_PX:
                return level.zoom
        return pyramid.zooms[0]
    if place.zoom is None:
        return pyramid.zoom_for(place.resolution_m, lat=lat, lon=lon)
    pyramid.level(place.zoom)
    return place.zoom


def _fetcher(source: Tiles, options: FetchOptions, stack: ExitStack) -> TileFetcher:
    if not isinstance(source, TileSource):
        return TileFetcher(source, client=None, threads=options.threads)
    cache = None
    if options.cache_dir is not None and source.terms.cacheable:
        cache = TileCache(
            options.cache_dir,
            source,
            max_bytes=options.cache_max_bytes,
            max_age_s=options.cache_max_age_s,
        )
        stack.callback(cache.close)
        stack.callback(cache.note_bounds)
        stack.callback(cache.trim)
    if options.offline and cache is None:
        why = "no cache folder is set"
        if not source.terms.cacheable:
            why = f"the terms of {source.name} do not allow one"
        raise ImageryError(
            f"Offline work needs a cache, and {why}.", hint="Work without --offline."
        )
    client = None
    if not options.offline:
        client = Client(options, rate_per_s=source.rate_per_s, secrets=source.secrets)
        stack.callback(client.close)
    return TileFetcher(source, client=client, cache=cache, threads=options.threads)


def _tell_nothing(source: Tiles, block: Block, missing_px: int, report: FetchReport) -> None:
    """Tell of ground for which a source has an answer, but nothing to show."""
    _, _, width, height = block.window
    if missing_px == width * height:
        raise ImageryError(
            f"{source.name} shows nothing there: all of the picture is transparent.",
            hint="Check the place, the layer and the zoom.",
        )
    if not isinstance(source, TileSource):
        return  # a file of one's own shows what it shows
    if missing_px and not report.absent:
        warn(
            f"{source.name} does not show {100 * missing_px / (width * height):.2g} % of the "
            "picture: it is transparent there, and no-data.",
            ImageryWarning,
        )
    if report.alike:
        warn(
            f"{report.alike} of {report.wanted} tiles of {source.name} are the same picture: it "
            "may have nothing there, or not at this zoom. Look at the picture first.",
            ImageryWarning,
        )


def _provenance(source: Tiles, block: Block, report: FetchReport) -> ImagerySource:
    newest = report.newest
    if report.downloaded or newest is None:
        newest = datetime.now(UTC).date()
    details = [("fetched", newest.isoformat())] if isinstance(source, TileSource) else []
    if report.absent:
        details.append(("tiles_masked", str(report.absent)))
    if source.terms.url:
        details.append(("terms", source.terms.url))
    return ImagerySource(
        name=source.name,
        date=source.date,
        attribution=source.terms.attribution,
        licence=source.terms.licence,
        may_derive=source.terms.may_derive,
        may_cache=source.terms.cacheable,
        zoom=block.level.zoom,
        details=tuple(details),
    )


def _picture(
    source: PictureSource, place: Where, path: str | Path, allow: tuple[str, ...], overwrite: bool
) -> Acquired:
    """A window of the user's own picture."""
    if Path(source.path).exists() and Path(path).exists() and Path(path).samefile(source.path):
        raise ImageryError(f"{path} is the picture itself.", hint="Give the output another name.")
    lat, lon = place.point
    known: dict[str, Any] = {"allow": allow, "bands": source.bands, "crs": source.crs}
    if place.area is not None and place.size_px is None and place.size_m is None:
        scene = _over(place.area, open_reader(source.path, lat=lat, lon=lon, **known))
    else:
        size: dict[str, Any] = {"size_m": place.size_m, "size_px": place.size_px}
        scene = read_scene(source.path, lat=lat, lon=lon, **size, **known)
    scene = _with_provenance(scene, source)
    for guess in scene.guesses:
        warn(guess, ImageryWarning)
    write_scene(scene, path, overwrite=overwrite)
    return Acquired(Path(path), scene.grid, scene.source, FetchReport())


def _over(area: BaseGeometry, reader: SceneReader) -> Scene:
    """What a picture shows of an area's box: its pixels may be at an angle to lon/lat."""
    west, south, east, north = area.bounds
    lon, lat = np.meshgrid(np.linspace(west, east, 17), np.linspace(south, north, 17))
    x, y = reader.grid.from_lonlat(lon.ravel(), lat.ravel())
    rows, columns = reader.grid.shape
    if not (x.max() > 0 and x.min() < columns and y.max() > 0 and y.min() < rows):
        raise outside(reader.grid, (south + north) / 2, (west + east) / 2)
    (left, right), (top, bottom) = _span(x, columns), _span(y, rows)
    return read_part(reader, (left, top, right - left, bottom - top))


def _span(position_px: NDArray[np.float64], side_px: int) -> tuple[int, int]:
    """The pixels that positions fall on, one at least, of those that there are."""
    first = min(max(math.floor(position_px.min() + 1e-6), 0), side_px - 1)
    return first, min(max(math.ceil(position_px.max() - 1e-6), first + 1), side_px)


def _with_provenance(scene: Scene, source: PictureSource) -> Scene:
    """The scene with what the source's owner says of it beside what its file says."""
    terms, known = source.terms, scene.source
    merged = replace(
        known,
        date=source.date or known.date,
        attribution=terms.attribution or known.attribution,
        licence=terms.licence or known.licence,
        may_derive=terms.may_derive and known.may_derive,
        may_cache=terms.may_cache and known.may_cache,
    )
    return replace(scene, source=merged)


def _remove_siblings(temporary: Path) -> None:
    """The rows, and what GDAL may have left beside a COG it could not finish."""
    for leftover in temporary.parent.glob(temporary.name.removesuffix(".tif") + "*"):
        if leftover != temporary:
            leftover.unlink(missing_ok=True)
