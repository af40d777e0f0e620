"""Plans that a person changes, and commands that run on them again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import geopandas as gpd
import pandas as pd

from geofield.plan import Plan, read_plan
from geofield.simulate import SimulatedField
from geofield_command import run_geofield

Frame: TypeAlias = gpd.GeoDataFrame


def geofield(*args: object) -> str:
    """Run the command as a process; returns what it told on stderr."""
    done = run_geofield(*args)
    assert done.returncode == 0, done.stderr
    return done.stderr


def run(folder: Path, made: SimulatedField, *more: object) -> str:
    place = ["--lat", made.lat, "--lon", made.lon, "--out", folder / "out", "--spacing", 6]
    return geofield("run", folder / "picture.tif", *place, "--format", "gpkg", *more)


def plan_in(folder: Path) -> Plan:
    return read_plan(folder / "out/field.gpkg")


def rows(plan: Plan) -> Frame:
    assert plan.obstacles is not None
    return plan.obstacles.set_index("obstacle_no", drop=False)


def rewritten(file: Path, layer: str, change: Callable[[Frame], Frame], **how: object) -> None:
    """A layer as a program writes it that reads all of it: other layers stay."""
    table = change(gpd.read_file(file, layer=layer))
    table.to_file(file, layer=layer, driver="GPKG", geometry_name="geom", **how)


def at(table: Frame, number: int) -> pd.Series[bool]:
    return table["obstacle_no"] == number


def shrunk(table: Frame) -> Frame:
    return table.set_geometry(table.geometry.buffer(-6), crs=table.crs)


def there_and_back(table: Frame) -> Frame:
    """As the layer is after it was saved in a CRS for all of Europe and then in its own again."""
    return table.to_crs("EPSG:3035").to_crs(table.crs)
