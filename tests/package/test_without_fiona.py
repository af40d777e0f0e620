"""Newer Pythons, for which fiona has no wheels: all but indexes of pictures is there."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import pyogrio
import shapely

PLAN = Path(__file__).parents[2] / "sample_data" / "field_1.gpkg"
#: A module that is None in there is one that cannot be imported.
WITHOUT = "import sys; sys.modules['fiona'] = None; from geofield.cli import main; main()"


def geofield(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", WITHOUT, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_shapefiles_are_written_without_fiona(tmp_path: Path) -> None:
    done = geofield("export", PLAN, "-f", "shapefile", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    written = gpd.read_file(tmp_path / "shapefile" / "boundary.shp")
    known = pyogrio.read_dataframe(PLAN, layer="field").to_crs(4326)
    assert shapely.hausdorff_distance(written.geometry[0], known.geometry[0]) < 1e-9


def test_what_lacks_is_told(tmp_path: Path) -> None:
    assert "GDAL of fiona     not there; tile indexes are not read" in geofield("doctor").stdout
    index = tmp_path / "index.gpkg"
    rows = {"location": ["sheet.tif"], "geometry": [shapely.box(33, 35, 34, 36)]}
    gpd.GeoDataFrame(rows, crs=4326).to_file(index)
    done = geofield("field", index, "--lat", 35.5, "--lon", 33.5, "-o", tmp_path / "f.gpkg")
    assert done.returncode == 1
    assert "index.gpkg is read by fiona, which is not there for this Python." in done.stderr
    assert "gdalbuildvrt" in done.stderr
