"""Pictures whose files are damaged are told, also where GDAL reads over it."""

from __future__ import annotations

import shutil
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
import rasterio.shutil
from affine import Affine
from rasterio.windows import Window

from geofield.errors import ImageryError
from geofield.imagery import SceneReader, read_scene
from geofield_command import run_geofield

from .pictures import EAST, NORTH, UTM, ground, write

SIDE = 512
#: Degrees where a picture in degrees is reprojected.
DEGREES: dict[str, Any] = {"crs": "EPSG:4326", "transform": Affine(5e-6, 0, 25, 0, -5e-6, 62)}


def noisy() -> np.ndarray:
    rng = np.random.default_rng(5)
    return ground(SIDE, SIDE) // 2 + rng.integers(0, 60, (3, SIDE, SIDE), np.uint8)


def tiled(path: Path, **profile: Any) -> Path:
    """A picture of four blocks."""
    write(path, noisy(), tiled=True, blockxsize=256, blockysize=256, **profile)
    return path


def place_of(path: Path, block: tuple[int, int] = (1, 1)) -> tuple[int, int]:
    """Where a block (column, row) lies in its file, and its size."""
    with rasterio.open(path) as file:
        names = (f"BLOCK_{what}_{block[0]}_{block[1]}" for what in ("OFFSET", "SIZE"))
        offset, size = (int(file.get_tag_item(name, "TIFF", bidx=1)) for name in names)
    return offset, size


def spoil(path: Path) -> None:
    """Other bytes in the middle of the last block."""
    offset, size = place_of(path)
    data = bytearray(path.read_bytes())
    middle = offset + size // 2
    data[middle : middle + 2000] = np.random.default_rng(3).bytes(2000)
    path.write_bytes(data)


def spoil_unseen(path: Path) -> None:
    """Bytes in the last block that are unpacked to more pixels than it has, half of them zero."""
    offset, size = place_of(path)
    data = bytearray(path.read_bytes())
    pixels = zlib.decompress(data[offset : offset + size])
    packed = zlib.compress(pixels[: len(pixels) // 2] + bytes(len(pixels)))[:-4]
    assert len(packed) < size
    data[offset : offset + size] = packed.ljust(size, b"\1")
    path.write_bytes(data)


def refused(path: Path, **options: Any) -> None:
    with pytest.raises(ImageryError) as error:
        read_scene(path, **options)
    assert "cannot be read to its end" in error.value.message
    assert error.value.hint == "The file is truncated or damaged: copy or download it again."


@pytest.mark.parametrize(
    "profile",
    [
        {"compress": "deflate"},
        {"compress": "deflate", "interleave": "band"},
        {"compress": "deflate", **DEGREES},
        {"compress": "jpeg", "photometric": "ycbcr"},
        {"compress": "jpeg", "interleave": "band"},
        {"compress": "packbits"},
    ],
    ids=lambda profile: "-".join(str(each) for each in list(profile.values())[:2]),
)
def test_a_damaged_block_is_told(tmp_path: Path, profile: dict[str, Any]) -> None:
    path = tiled(tmp_path / "x.tif", **profile)
    whole = read_scene(path)
    assert whole.valid.any()
    spoil(path)
    refused(path)


def test_a_single_wrong_byte_is_told_where_it_is_read(tmp_path: Path) -> None:
    path = tiled(tmp_path / "x.tif", compress="deflate")
    whole = read_scene(path).bands
    spoil_unseen(path)
    refused(path)
    reader = SceneReader.open(str(path))
    with pytest.raises(ImageryError, match="column 1, row 1 is damaged"):
        reader.read((200, 200, 57, 57))
    # What lies in other blocks is whole.
    for window in ((0, 0, 256, 256), (256, 0, 256, 256), (0, 200, 256, 312)):
        column, row, width, height = window
        part = np.s_[:, row : row + height, column : column + width]
        assert np.array_equal(reader.read(window).bands, whole[part])


def test_only_the_blocks_that_a_warp_shows_count(tmp_path: Path) -> None:
    path = tiled(tmp_path / "x.tif", compress="deflate", **DEGREES)
    reader = SceneReader.open(str(path))
    assert reader.warped_from is not None
    spoil_unseen(path)
    x, y = reader.grid.from_lonlat(25 + 100 * 5e-6, 62 - 100 * 5e-6)
    assert reader.read((int(x) - 10, int(y) - 10, 20, 20)).valid.all()
    x, y = reader.grid.from_lonlat(25 + 400 * 5e-6, 62 - 400 * 5e-6)
    with pytest.raises(ImageryError, match="is damaged"):
        reader.read((int(x) - 10, int(y) - 10, 20, 20))


def test_a_cog_is_told_and_its_overviews_may_be_whole(tmp_path: Path) -> None:
    tiled(tmp_path / "x.tif", compress="deflate")
    path = tmp_path / "cog.tif"
    rasterio.shutil.copy(tmp_path / "x.tif", path, driver="COG", compress="deflate", blocksize=256)
    spoil_unseen(path)
    refused(path)
    assert SceneReader.open(str(path)).read(shape_px=(256, 256)).valid.all()


def test_blocks_that_were_never_written_are_no_damage(tmp_path: Path) -> None:
    path = tmp_path / "sparse.tif"
    with rasterio.open(
        path,
        "w",
        **{"driver": "GTiff", "width": SIDE, "height": SIDE, "count": 1, "dtype": "uint8"},
        **{"crs": UTM, "transform": Affine(0.5, 0, EAST, 0, -0.5, NORTH), "nodata": 0},
        **{"tiled": True, "blockxsize": 256, "blockysize": 256, "compress": "deflate"},
        SPARSE_OK=True,
    ) as file:
        file.write(noisy()[0, :256, :256], 1, window=Window(0, 0, 256, 256))
    scene = read_scene(path)
    assert scene.valid[:256, :256].all()
    assert not scene.valid[256:].any()


@pytest.mark.parametrize("share", [0.2, 0.5, 0.97])
@pytest.mark.parametrize("kind", ["png", "jpg"])
def test_a_picture_that_was_cut_off_is_told(tmp_path: Path, kind: str, share: float) -> None:
    tiled(tmp_path / "x.tif")
    whole = tmp_path / f"whole.{kind}"
    driver = {"png": "PNG", "jpg": "JPEG"}[kind]
    rasterio.shutil.copy(tmp_path / "x.tif", whole, driver=driver, worldfile="YES")
    world = whole.with_suffix(".wld")
    cut = tmp_path / f"cut.{kind}"
    shutil.copy(world, cut.with_suffix(".wld"))
    data = whole.read_bytes()
    cut.write_bytes(data[: int(share * len(data))])
    assert read_scene(whole, crs=UTM).grid.shape == (SIDE, SIDE)
    refused(cut, crs=UTM)


def test_bytes_too_many_are_no_damage(tmp_path: Path) -> None:
    tiled(tmp_path / "x.tif")
    path = tmp_path / "x.jpg"
    rasterio.shutil.copy(tmp_path / "x.tif", path, driver="JPEG", worldfile="YES")
    whole = read_scene(path, crs=UTM).bands
    data = path.read_bytes()
    path.write_bytes(data[:-2] + b"\x00\x00" + data[-2:])
    assert np.array_equal(read_scene(path, crs=UTM).bands, whole)


def test_the_command_says_what_to_do(tmp_path: Path) -> None:
    path = tiled(tmp_path / "x.tif", compress="deflate")
    spoil_unseen(path)
    lon, lat = SceneReader.open(str(path)).grid.centre_lonlat
    target = tmp_path / "scene.tif"
    done = run_geofield("tiles", path, "--lat", lat, "--lon", lon, "-o", target)
    assert done.returncode == 1
    assert "The picture x.tif cannot be read to its end: the block at column 1" in done.stderr
    assert "copy or download it again" in done.stderr
    assert not target.exists()
