"""``geofield doctor``: what this installation is made of, and whether it hangs together."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path
from typing import Any

import click

from geofield.cli.console import echo_json
from geofield.errors import GeofieldError

_LIBRARIES = (
    "geofield",
    "numpy",
    "scipy",
    "scikit-image",
    "shapely",
    "geopandas",
    "pyproj",
    "rasterio",
    "fiona",
    "pyogrio",
    "pyarrow",
    "rdflib",
    "pillow",
    "pydantic",
    "click",
)


@click.command(
    epilog="""\b
Examples:
  geofield doctor
  geofield doctor --json
"""
)
@click.option("--json", "as_json", is_flag=True, help="As JSON on stdout.")
def doctor(as_json: bool) -> None:
    """Show versions, data folders and what looks wrong.

    The wheels of rasterio, fiona and pyogrio each carry their own GDAL and PROJ; a variable
    such as PROJ_LIB that points to another one breaks them in ways that are hard to see.
    """
    facts = {"libraries": _libraries(), "native": _native(), "environment": _environment()}
    problems = _problems()
    if as_json:
        echo_json({**facts, "problems": problems})
    else:
        for title, values in facts.items():
            click.secho(title.capitalize(), bold=True)
            width = max(map(len, values), default=0)
            for name, value in values.items():
                click.echo(f"  {name:<{width}}  {value}")
        click.secho("Problems", bold=True)
        for line in problems or ["none found"]:
            click.echo(f"  {line}")
    if problems:
        raise SystemExit(1)


def _libraries() -> dict[str, str]:
    found = {"python": f"{platform.python_version()} on {platform.platform()}"}
    for name in _LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed as a package"
    return found


def _native() -> dict[str, str]:
    import pyogrio
    import pyproj
    import rasterio
    import shapely

    try:
        import fiona

        of_fiona = fiona.__gdal_version__
    except ImportError:
        of_fiona = "not there; tile indexes are not read"
    transformer = pyproj.Transformer.from_crs(4326, 3857)
    return {
        "GDAL of rasterio": rasterio.__gdal_version__,
        "GDAL of fiona": of_fiona,
        "GDAL of pyogrio": ".".join(map(str, pyogrio.__gdal_version__)),
        "GEOS of shapely": shapely.geos_version_string,
        "PROJ of pyproj": pyproj.proj_version_str,
        "PROJ data": pyproj.datadir.get_data_dir(),
        "PROJ network": "on" if transformer.is_network_enabled else "off",
    }


def _environment() -> dict[str, str]:
    names = ("GDAL_DATA", "PROJ_DATA", "PROJ_LIB", "GTIFF_SRS_SOURCE", "OGR_CURRENT_DATE")
    found = {name: os.environ[name] for name in names if name in os.environ}
    # Values of our own variables may hold keys: name them only.
    found |= {name: "set" for name in os.environ if name.startswith("GEOFIELD_")}
    if Path("geofield.toml").is_file():
        found["geofield.toml"] = "read from this folder"
    return found or {"": "no variable that matters is set"}


def _problems() -> list[str]:
    from geofield.grid import Grid
    from geofield.settings import load_settings

    problems = []
    for name in ("GDAL_DATA", "PROJ_DATA", "PROJ_LIB"):
        if name in os.environ:
            problems.append(
                f"{name} is set: it overrides the wheels' own data; unset it if reading fails."
            )
    checks: dict[str, Any] = {
        "the projection database": lambda: (
            Grid.web_mercator(lat=35.0, lon=33.5, zoom=18).metric_crs
        ),
        "the settings": load_settings,
    }
    for what, check in checks.items():
        try:
            check()
        except GeofieldError as error:
            problems.append(f"{what}: {error}")
    return problems
