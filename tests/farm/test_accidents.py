"""``geofield batch`` on a full disk, and with a picture that cannot be read."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin

from geofield.farm import read_farm

GEOFIELD = Path(sys.executable).with_name("geofield")
#: A disk of its own for one shell, as anybody may have where the system lets them.
SMALL_DISK = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-ec"]


def layers_of(farm: Path) -> dict[str, bytes]:
    return {
        str(file.relative_to(farm)): file.read_bytes()
        for file in farm.glob("*/*/*.parquet")
        if file.relative_to(farm).parts[0] != "status"
    }


def test_a_full_disk_is_told_and_the_rest_done_when_there_is_room(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = f"mount -t tmpfs -o size=1m none '{disk}'"
    if (
        shutil.which("unshare") is None
        or subprocess.run([*SMALL_DISK, mount], capture_output=True, check=False).returncode
    ):
        pytest.skip("this system gives no disk of one's own")
    row, column = np.divmod(np.arange(300), 20)
    x, y = 400_000 + 130 * column, 5_500_000 + 110 * row
    shapes = shapely.box(x, y, x + 110, y + 90)
    gpd.GeoDataFrame({"id": range(300)}, geometry=shapes, crs=32632).to_file(tmp_path / "p.gpkg")
    line = f"'{GEOFIELD}' batch '{tmp_path}/p.gpkg' --spacing 3 --workers 2 --no-overview --out"
    subprocess.run(f"{line} '{tmp_path}/right'", shell=True, check=True, capture_output=True)
    done = subprocess.run(
        [*SMALL_DISK, (
            f"{mount}\n"
            f"if {line} '{disk}/farm' 2> '{tmp_path}/said'; then exit 3; fi\n"
            f"cp -r '{disk}/farm' '{tmp_path}/cut'\n"
            f"mount -o remount,size=100m '{disk}'\n"
            f"{line} '{disk}/farm'\n"
            f"cp -r '{disk}/farm' '{tmp_path}/farm'"
        )], capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, (done.returncode, done.stderr)
    said = (tmp_path / "said").read_text()
    assert "The disk is full" in said
    assert "Traceback" not in said
    assert not list((tmp_path / "cut").rglob("*.tmp"))
    assert 0 <= len(read_farm(tmp_path / "cut")) < 300
    assert layers_of(tmp_path / "farm") == layers_of(tmp_path / "right")
    assert set(read_farm(tmp_path / "farm").status["status"]) == {"done"}


def test_a_poisoned_picture_costs_its_own_places_alone(sample: Path, tmp_path: Path) -> None:
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    shutil.copy(sample / "field_1.tif", pictures)
    with rasterio.open(sample / "field_2.tif") as picture:
        # All sample pictures show one place: this one goes five kilometres north.
        east, north = picture.transform.c, picture.transform.f + 5000.0
        with rasterio.open(
            pictures / "field_2.tif", "w", driver="GTiff", width=480, height=480, count=4,
            dtype="uint8", crs=picture.crs, transform=from_origin(east, north, 0.6, 0.6),
            compress="deflate", interleave="band",
        ) as moved:  # fmt: skip
            moved.write(picture.read())
    seeds = pd.read_csv(sample / "seeds.csv").iloc[:2]
    seeds["lat"] += np.array([0.0, 5000.0 / 110_940.0])
    seeds.to_csv(tmp_path / "seeds.csv", index=False)
    line: list[str | Path] = [GEOFIELD, "batch", tmp_path / "seeds.csv", pictures]
    line += ["--spacing", "4", "--workers", "1", "--no-overview", "--out"]
    subprocess.run([*line, tmp_path / "right"], check=True, capture_output=True)
    # The header is whole: the fault shows where the pixels are read.
    poisoned = pictures / "field_2.tif"
    whole = poisoned.read_bytes()
    third = len(whole) // 3
    poisoned.write_bytes(whole[:third] + bytes(third) + whole[2 * third :])
    done = subprocess.run([*line, tmp_path / "farm"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    right, farm = read_farm(tmp_path / "right"), read_farm(tmp_path / "farm")
    assert set(right.ids) == {"field_1", "field_2"}
    assert farm.ids == ["field_1"]
    assert farm["field_1"] == right["field_1"]
    status = farm.status.set_index("field_id").loc["field_2"]
    assert status["status"] == "failed"
    assert "field_2.tif" in status["error"]
    assert list(pd.read_csv(tmp_path / "farm" / "failed.csv")["field_id"]) == ["field_2"]


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads are counted on Linux")
def test_reading_a_farm_leaves_no_thread_that_could_abort_the_process(tmp_path: Path) -> None:
    outlines = Path(__file__).parents[2] / "sample_data" / "field_1.gpkg"
    line = ["--spacing", "8", "--workers", "1", "--no-overview", "--out"]
    subprocess.run([GEOFIELD, "batch", outlines, *line, tmp_path], check=True, capture_output=True)
    asked = (
        "import os, sys\n"
        "from geofield.farm.folder import read_parts\n"
        "from geofield.farm.store import Store\n"
        "before = len(os.listdir('/proc/self/task'))\n"
        "parts = len(list(read_parts(Store.of(sys.argv[1]), 'field')))\n"
        "print(parts, len(os.listdir('/proc/self/task')) - before)\n"
    )
    asking = [sys.executable, "-c", asked, str(tmp_path)]
    done = subprocess.run(asking, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["1", "0"], done.stderr
