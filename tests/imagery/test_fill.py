"""What a picture is filled with where it shows nothing, and no tag says so."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from affine import Affine

from geofield import plan_field
from geofield.imagery import SceneReader, read_scene
from geofield.imagery.fill import blank_value

from .pictures import EAST, NORTH, ground, write

#: Values as a camera gives them, far from all that pictures are filled with.
_KINDS: dict[str, Any] = {
    "uint16": lambda values: values.astype(np.uint16) * 40 + 300,
    "int16": lambda values: values.astype(np.int16) * 40 + 300,
    "float32": lambda values: (values / 255).astype(np.float32),
}


def filled(kind: str, fill: float, shape: tuple[int, int] = (96, 128)) -> np.ndarray:
    values = np.asarray(_KINDS[kind](ground(*shape)))
    values[:, : shape[0] // 8] = fill
    return values


@pytest.mark.parametrize(
    ("kind", "fill"),
    [
        ("float32", -10000),
        ("float32", -9999),
        ("float32", 0),
        ("float32", np.finfo(np.float32).min),
        ("uint16", 65535),
        ("uint16", 0),
        ("int16", -32768),
    ],
)
def test_an_undeclared_fill_is_as_one_that_is_declared(
    tmp_path: Path, kind: str, fill: float
) -> None:
    values = filled(kind, fill)
    silent = write(tmp_path / "silent.tif", values, photometric="RGB")
    said = write(tmp_path / "said.tif", values, photometric="RGB", nodata=fill)
    for coarse in (None, 1.7):
        scene, truth = (read_scene(path, resolution_m=coarse) for path in (silent, said))
        assert not scene.valid.all()
        assert np.array_equal(scene.valid, truth.valid)
        assert np.array_equal(scene.bands, truth.bands)
        assert scene.scaling == truth.scaling
        assert any("taken as no data" in note for note in scene.notes)
        assert not any("taken as no data" in note for note in truth.notes)


def test_it_is_decided_for_the_whole_file(tmp_path: Path) -> None:
    """A window that hardly touches the fill, one with nothing else, overviews, a reprojection."""
    values = filled("uint16", 65535, (900, 1300))
    path = write(tmp_path / "x.tif", values, photometric="RGB")
    reader = SceneReader.open(path)
    for row, share in ((0, 0.0), (111, 0.95), (300, 1.0)):
        assert reader.read((600, row, 20, 20)).valid.mean() == pytest.approx(share)
    with rasterio.open(path, "r+") as file:
        file.build_overviews([2, 4], rasterio.enums.Resampling.average)
    assert SceneReader.open(path).nodata == 65535
    oblong = write(
        tmp_path / "o.tif", values, transform=Affine(0.5, 0, EAST, 0, -1, NORTH), photometric="RGB"
    )
    scene = read_scene(oblong)
    assert scene.scaling is not None
    assert scene.scaling[1] < 300 + 40 * 255
    assert scene.valid.mean() == pytest.approx(7 / 8, abs=0.01)


def test_a_fill_that_an_opaque_mask_shows_is_found(tmp_path: Path) -> None:
    values = np.concatenate([filled("uint16", 0), np.full((1, 96, 128), 65535, np.uint16)])
    values[3, :, :20] = 0
    path = write(tmp_path / "x.tif", values, photometric="RGB", ALPHA="YES")
    valid = read_scene(path).valid
    assert not valid[:12].any()
    assert not valid[:, :20].any()
    assert valid[12:, 20:].all()


def test_ground_is_not_taken_for_a_fill(tmp_path: Path) -> None:
    roof = np.asarray(_KINDS["uint16"](ground()))
    roof[:, 20:30, 20:30] = 65535  # bright, and not at the frame
    shadow = (ground().astype(np.int32) - 60).clip(0).astype(np.uint16) * 40  # 0 is the darkest
    for n, values in enumerate((roof, shadow, filled("uint16", 0)[:, 12:])):
        assert read_scene(write(tmp_path / f"{n}.tif", values, photometric="RGB")).valid.all(), n
    black = ground()
    black[:, :12] = 0  # bytes are not scaled, and stay as they are
    assert read_scene(write(tmp_path / "b.tif", black, photometric="RGB")).valid.all()


def test_blank_is_a_black_square_anywhere_or_a_white_one_at_a_side() -> None:
    picture, valid = ground(rows=160, columns=160), np.ones((160, 160), bool)
    assert blank_value(picture, valid) is None
    for value, top, told in ((0, 64, 0), (0, 0, 0), (255, 64, None), (255, 0, 255)):
        bands = picture.copy()
        bands[:, top : top + 40, 60:130] = value
        assert blank_value(bands, valid) == told
        assert blank_value(bands, valid & (bands != value).any(axis=0)) is None


def test_pure_black_that_no_tag_explains_is_told(tmp_path: Path, sample: Path) -> None:
    """As of a file that was copied in part, whose pieces were not compressed."""
    with rasterio.open(sample / "field_1.tif") as file:
        values, profile = file.read(), file.profile
    values[:, 300:400, 200:300] = 0
    for name, tags, count in (("black", {}, 1), ("told", {"nodata": 0}, 0)):
        picture = tmp_path / f"{name}.tif"
        with rasterio.open(picture, "w", **{**profile, "driver": "GTiff", **tags}) as file:
            file.write(values)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            plan_field(picture, lat=35.075373, lon=33.531142, spacing_m=6)
        assert sum("pure black" in str(one.message) for one in caught) == count
