"""Outlines that cross themselves: mended, or refused before they fill the memory."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely

from geofield.crossings import mended
from geofield.errors import FormatError

GEOFIELD = Path(sys.executable).with_name("geofield")
SAMPLE = Path(__file__).parents[1] / "sample_data" / "field_1.tif"

#: Runs a command; prints its exit code and peak memory in kB. A process of its own, for a child's
#: peak begins with that of the process which starts it, and a test's own may be large.
MEASURED = """
import os, subprocess, sys
process = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)
_, status, used = os.wait4(process.pid, 0)
process.returncode = os.waitstatus_to_exitcode(status)
print(process.returncode, used.ru_maxrss)
"""


def tangle(corners: int) -> shapely.Polygon:
    """A star whose every side crosses nearly all others, 200 m wide."""
    angle = np.arange(corners) * 2.0 * np.pi * (corners // 2) / corners
    return shapely.Polygon(
        np.column_stack((500_100 + 100 * np.cos(angle), 5_500_100 + 100 * np.sin(angle)))
    )


def test_a_bow_is_mended_and_a_tangle_refused() -> None:
    bow = shapely.Polygon([(0, 0), (2, 2), (2, 0), (0, 2)])
    assert shapely.area(mended(bow)) == pytest.approx(2.0)
    spur = shapely.Polygon([(0, 0), (2, 2), (2, 0), (0, 2), (-1, 2), (0, 2)])
    kinds = sorted(part.geom_type for part in shapely.get_parts(mended(spur)))
    assert kinds == ["LineString", "Polygon", "Polygon"]
    assert shapely.is_valid(mended(tangle(41)))
    with pytest.raises(FormatError, match="crosses itself more than"):
        mended(tangle(2001))
    ring = shapely.get_coordinates(shapely.Point(0, 0).buffer(1.0))[:-1]
    assert shapely.area(mended(shapely.Polygon(np.tile(ring, (3, 1))))) == pytest.approx(
        np.pi, rel=1e-2
    )
    with pytest.raises(FormatError, match="the same ground"):
        mended(shapely.Polygon(np.tile(ring, (300, 1))))
    # Many vertices are no tangle: one crossing in 60 000 sides is mended.
    ring = shapely.get_coordinates(shapely.Point(0, 0).buffer(1.0, quad_segs=15_000)).copy()
    ring[[500, 503]] = ring[[503, 500]]
    assert shapely.area(mended(shapely.Polygon(ring))) == pytest.approx(np.pi, rel=1e-4)


@pytest.mark.parametrize("command", ["import", "tracks", "field"])
def test_no_command_takes_a_tangle(command: str, tmp_path: Path) -> None:
    file, out = tmp_path / "parcel.geojson", ["-o", tmp_path / "new.gpkg"]
    parcel = gpd.GeoSeries([tangle(8001)], crs=32636)
    # Around the sample's point.
    parcel = parcel.translate(548_430 - 500_100, 3_881_530 - 5_500_100).to_crs(4326)
    parcel.to_file(file)
    at = ["--lat", 35.075373, "--lon", 33.531142]
    line: list[object] = {
        "import": [file, *out],
        "tracks": [file, "--spacing", 5, *out],
        "field": [SAMPLE, *at, "--boundary", file, *out],
    }[command]
    words = [str(each) for each in (GEOFIELD, command, *line)]
    done = subprocess.run(
        [sys.executable, "-S", "-c", MEASURED, *words], capture_output=True, text=True, check=True
    )
    code, peak_kb = map(int, done.stdout.split())
    assert code == 1, done.stderr
    assert "crosses itself more than" in done.stderr
    assert set(tmp_path.iterdir()) == {file}
    assert peak_kb < 700 * 1024
