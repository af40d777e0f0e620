"""What the commands around imagery share: the sources of the settings, keys, the cache folder.

Keys come from the environment (``GEOFIELD_KEY_NAME``) or the settings file; they go from here
into the requests and nowhere else.
"""

from __future__ import annotations

import os
import sys
import urllib.request
from collections.abc import Mapping
from contextlib import closing, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from geofield.cli.console import say
from geofield.errors import ImageryError
from geofield.wording import counted

if TYPE_CHECKING:
    from geofield.imagery import Acquired, FetchOptions, Imagery, PlacePicture, Where
    from geofield.imagery.sources import Source, SourceEntry
    from geofield.plan import Plan
    from geofield.settings import Settings

#: Settings of a source that are fields of its entry.
_OF_A_SOURCE = (
    "kind", "min_zoom", "max_zoom", "tile_px", "subdomains", "layer", "key_parameter",
    "rate_per_s", "date",
)  # fmt: skip


def default_cache_dir() -> Path:
    """The user's cache folder, where the operating system wants it."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "geofield" / "tiles"


def cache_dir_of(settings: Settings, given: Path | None = None) -> Path:
    """Where tile caches are: as the option, the settings or the system says."""
    if given is not None:
        return given
    return Path(settings.fetch.cache_dir or default_cache_dir()).expanduser()


def catalogue_of(settings: Settings) -> dict[str, SourceEntry]:
    """The sources known by name, with the user's own."""
    from geofield.imagery.sources import BUILTIN, SourceEntry
    from geofield.imagery.terms import Terms

    own = {
        name: SourceEntry(
            address=each.url,
            terms=Terms(
                each.attribution, each.licence, each.may_cache, each.may_derive, each.terms_url
            ),
            title="your own",
            needs_key=each.key is not None or bool(each.key_parameter),
            headers=tuple((k, v.get_secret_value()) for k, v in each.headers.items()),
            **{field: getattr(each, field) for field in _OF_A_SOURCE},
        )
        for name, each in settings.fetch.sources.items()
    }
    return {**BUILTIN, **own}  # which win


def keys_of(settings: Settings, names: Mapping[str, SourceEntry]) -> dict[str, str]:
    """The key of each source that has one; the environment wins."""
    from geofield.imagery.sources.xyz import key_variable

    keys = {}
    for name in names:
        own = settings.fetch.sources.get(name)
        given = os.environ.get(key_variable(name), "")
        kept = settings.fetch.keys.get(name) or (own.key if own is not None else None)
        if not given and kept is not None:
            given = kept.get_secret_value()
        if given:
            keys[name] = given
    return keys


def fetch_options(settings: Settings, cache_dir: Path | None) -> FetchOptions:
    """How tiles are fetched, from the settings."""
    from geofield.imagery import FetchOptions

    proxies = urllib.request.getproxies()
    return FetchOptions(
        cache_dir=cache_dir,
        threads=settings.fetch.threads,
        cache_max_bytes=int(settings.fetch.cache_max_mb * 1e6),
        cache_max_age_s=settings.fetch.cache_max_days * 86400.0,
        proxy=proxies.get("https") or proxies.get("http"),
        allow=settings.fetch.allow,
        no_proxy=tuple(part.strip() for part in proxies.get("no", "").split(",")),
    )


def resolve(
    what: str,
    settings: Settings,
    *,
    point: tuple[float, float] | None = None,
    layer: str = "",
    offline: bool = False,
    options: FetchOptions,
) -> Source:
    """The source that the user names."""
    from geofield.imagery.client import Client
    from geofield.imagery.sources import find_source

    catalogue = catalogue_of(settings)
    keys = keys_of(settings, catalogue)
    online = nullcontext() if offline else closing(Client(options, secrets=keys.values()))
    with online as client:
        return find_source(
            what, catalogue=catalogue, keys=keys, client=client, layer=layer, point=point,
            allow=settings.fetch.allow,
        )  # fmt: skip


def source_of(
    what: str, settings: Settings, point: tuple[float, float], *, acknowledged: bool
) -> tuple[Source, FetchOptions]:
    """The source that the user names, its terms checked, and how it is fetched from."""
    from geofield.imagery.terms import check_terms

    options = fetch_options(settings, cache_dir_of(settings))
    source = resolve(what, settings, point=point, options=options)
    check_terms(source.name, source.terms, acknowledged=acknowledged)
    return source, replace(options, acknowledged=acknowledged)


def imagery_of(
    what: str, settings: Settings, point: tuple[float, float], *, acknowledged: bool = False
) -> Imagery:
    """The user's own pictures, or a source of some."""
    from geofield.imagery import Imagery, is_own_picture

    if is_own_picture(what):
        return Imagery(what)
    return Imagery("", *source_of(what, settings, point, acknowledged=acknowledged))


def say_wider(plan: Plan, picture: PlacePicture) -> None:
    """How to get more of a source's picture, where the outline goes on outside what was fetched."""
    if plan.grid is None or not plan.frame_lines or not picture.offers_more:
        return
    from geofield.model.frame import along_frame

    if not along_frame(plan.field.polygon, plan.field.crs, plan.grid):
        return  # the source's own data end there
    side_m = max(plan.grid.shape) * plan.grid.ground_resolution_m
    say(f"           what lies outside may be had with --size-m {2 * side_m:.0f}", fg="yellow")


def describe(done: Acquired) -> None:
    """A short account of a picture for the person at the terminal."""
    grid, report = done.grid, done.report
    from geofield.crs import authority_name

    resolution = grid.ground_resolution_m
    zoom = "" if done.source.zoom is None else f", zoom {done.source.zoom}"
    say(
        f"Picture    {grid.width_px} x {grid.height_px} px, {resolution:.2f} m per pixel"
        f" ({grid.width_px * resolution:.0f} x {grid.height_px * resolution:.0f} m)"
        f"{zoom}, {authority_name(grid.crs)}"
    )
    if report.wanted:
        parts = [f"{report.downloaded} fetched"] if report.downloaded else []
        parts += [f"{report.cached} from the cache"] if report.cached else []
        say(f"Tiles      {report.wanted}: {', '.join(parts) or 'from the file'}")
        if report.troubles:
            met = ", ".join(f"{count} x {what}" for what, count in report.troubles.most_common())
            say(f"           faults met and survived: {met}")
        if report.absent:
            absent = f"{counted(report.absent, 'tile')} could not be had: no-data in the picture"
            say(f"           {absent}", fg="yellow")
    terms = "; ".join(part for part in (done.source.attribution, done.source.licence) if part)
    say(f"Source     {done.source.name}" + (f" ({terms})" if terms else ""))
    if done.source.date:
        say(f"Date       {done.source.date}")
    say(f"File       {done.path}")


def where_json(done: Acquired) -> dict[str, object]:
    """A picture's facts for other programs."""
    grid, report = done.grid, done.report
    return {
        "path": str(done.path),
        "width_px": grid.width_px,
        "height_px": grid.height_px,
        "transform": list(grid.transform)[:6],
        "crs": grid.crs.to_string(),
        "ground_resolution_m": grid.ground_resolution_m,
        "corners_lonlat": grid.corners_lonlat(),
        "source": done.source.name,
        "zoom": done.source.zoom,
        "date": done.source.date,
        "attribution": done.source.attribution,
        "licence": done.source.licence,
        "tiles": {
            "wanted": report.wanted,
            "downloaded": report.downloaded,
            "cached": report.cached,
            "missing": report.missing,
            "failed": report.failed,
            "faults_survived": dict(report.troubles),
        },
    }


def area_of(path: Path) -> Where:
    """The ground that a vector file covers."""
    import numpy as np
    import shapely
    from pyproj import CRS

    from geofield.crs import LONLAT, refuse_outside
    from geofield.finite import refuse_nowhere
    from geofield.formats.antimeridian import extent
    from geofield.formats.foreign import read_vector
    from geofield.imagery import Where

    table = read_vector(path)
    refuse_nowhere(table.geometry.to_numpy(), path.name)
    if table.crs is None:
        raise ImageryError(f"The area {path} does not name its coordinate reference system.")
    shapes = table.to_crs(LONLAT).geometry.to_numpy()
    lon, lat = shapely.get_coordinates(shapes).T
    lat[np.abs(lat) > 90.0] = np.inf  # metres that are called degrees are not brought anywhere
    refuse_outside(CRS(table.crs), lon, lat, what=f"Coordinates in {path.name}")
    if not len(lon):
        raise ImageryError(f"The file {path} holds no area.")
    west, south, east, north = extent(shapes)
    return Where(area=shapely.box(west, south, east + 360.0 * (east < west), north))
