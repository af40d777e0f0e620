"""Reading scenes: unusual but good input works, bad input is refused with a next step."""

from __future__ import annotations

import hashlib
import pickle
import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
import rasterio.shutil
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from rasterio.control import GroundControlPoint
from rasterio.enums import ColorInterp

from geofield.errors import (
    CRSError,
    FormatError,
    ImageryError,
    OutputExistsError,
    PointOutsideError,
)
from geofield.grid import Grid
from geofield.imagery import SceneReader, read_scene, write_scene
from geofield.model.scene import ImagerySource, Scene
from geofield.simulate import SimulatedField

from .pictures import EAST, NORTH, RESOLUTION, UTM, ground, write

R, G, B = ColorInterp.red, ColorInterp.green, ColorInterp.blue
ALPHA, UNDEFINED = ColorInterp.alpha, ColorInterp.undefined


@pytest.fixture
def rgb(tmp_path: Path) -> str:
    return write(tmp_path / "rgb.tif", ground(), photometric="RGB")


def test_a_plain_picture_is_read_as_it_is(rgb: str) -> None:
    scene = read_scene(rgb)
    assert scene.roles == ("red", "green", "blue")
    assert np.array_equal(scene.bands, ground())
    assert scene.valid.all()
    assert scene.notes == ()
    assert scene.scaling is None
    assert scene.grid == Grid(128, 96, Affine(RESOLUTION, 0, EAST, 0, -RESOLUTION, NORTH), UTM)
    assert scene.source.name == "rgb.tif"


@pytest.mark.parametrize("size", [{"size_px": 21}, {"size_m": 10.6}])
def test_a_window_lies_around_the_point(rgb: str, size: dict[str, Any]) -> None:
    whole = SceneReader.open(rgb).grid
    lon, lat = whole.to_lonlat(60.5, 40.5)
    scene = read_scene(rgb, lat=lat, lon=lon, **size)
    assert scene.bands.shape == (3, 21, 21)
    assert np.array_equal(scene.bands, ground()[:, 30:51, 50:71])
    assert scene.grid == whole.crop(50, 30, 21, 21)
    assert scene.pixel_of(lat=lat, lon=lon) == pytest.approx((10.5, 10.5), abs=1e-6)


@pytest.mark.parametrize("at", [(1e-5, 1e-5), (127.9999, 95.9999), (127.9999, 40.5)])
def test_a_point_at_the_very_edge_stays_inside(rgb: str, at: tuple[float, float]) -> None:
    scene = read_scene(rgb)
    lon, lat = scene.grid.to_lonlat(*at)
    x, y = scene.pixel_of(lat=lat, lon=lon)
    assert (int(x), int(y)) == (int(at[0]), int(at[1]))
    assert (x, y) == pytest.approx(at, abs=2e-3)
    assert min(x, y) > 0  # an outline does not hold the points on its own border


def test_a_window_is_cut_at_the_edge(rgb: str) -> None:
    lon, lat = SceneReader.open(rgb).grid.to_lonlat(2.5, 94.5)
    scene = read_scene(rgb, lat=lat, lon=lon, size_px=11)
    assert np.array_equal(scene.bands, ground()[:, 89:96, 0:8])


def test_a_finer_picture_can_be_read_coarser(rgb: str) -> None:
    scene = read_scene(rgb, resolution_m=1.0)
    assert scene.bands.shape == (3, 48, 64)
    expected = ground().reshape(3, 48, 2, 64, 2).mean(axis=(2, 4))
    assert np.abs(scene.bands - expected).max() <= 1
    assert scene.grid.to_native(64, 48) == SceneReader.open(rgb).grid.to_native(128, 96)
    assert "per pixel instead of" in scene.notes[0]


def test_a_reader_is_a_picklable_value(rgb: str) -> None:
    reader = pickle.loads(pickle.dumps(SceneReader.open(rgb)))
    assert np.array_equal(reader.read((3, 4, 5, 6)).bands, ground()[:, 4:10, 3:8])
    with pytest.raises(ImageryError, match="reaches outside"):
        reader.read((120, 90, 20, 20))


# -- bands -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("interpretation", "fourth", "roles", "hidden"),
    [
        ([R, G, B, ALPHA], "picture", ("red", "green", "blue", "nir"), 0),
        ([R, G, B, UNDEFINED], "picture", ("red", "green", "blue", "nir"), 0),
        ([R, G, B, ColorInterp.nir], "picture", ("red", "green", "blue", "nir"), 0),
        ([R, G, B, ALPHA], "mask", ("red", "green", "blue"), 960),
        ([R, G, B, ALPHA], "feathered", ("red", "green", "blue"), 960),
    ],
)
def test_a_fourth_band_is_a_mask_only_if_it_looks_like_one(
    tmp_path: Path, interpretation: list, fourth: str, roles: tuple, hidden: int
) -> None:
    values = ground(bands=4)
    if fourth != "picture":
        values[3] = 255
        values[3, :, :10] = 0
    if fourth == "feathered":
        values[3, :, 10:12] = (140, 200)
    path = write(tmp_path / "x.tif", values, interpretation=interpretation, photometric="RGB")
    scene = read_scene(path)
    assert scene.roles == roles
    assert (~scene.valid).sum() == hidden
    assert not scene.bands[:, ~scene.valid].any()


@pytest.mark.parametrize("opaque", [1, 255, 65535])
@pytest.mark.parametrize("hidden", [0, 10])
@pytest.mark.parametrize("interpretation", [ALPHA, UNDEFINED])
def test_a_mask_beside_floats_is_no_near_infrared(
    tmp_path: Path, opaque: float, hidden: int, interpretation: ColorInterp
) -> None:
    """As `gdalwarp -dstalpha` writes it."""
    values = ground(bands=4).astype(np.float32) / 255
    values[3], values[3, :, :hidden] = opaque, 0
    named = [R, G, B, interpretation]
    scene = read_scene(write(tmp_path / "x.tif", values, interpretation=named, photometric="RGB"))
    assert scene.roles == ("red", "green", "blue")
    if interpretation is ALPHA:
        assert (~scene.valid).sum() == hidden * 96


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.float32])
@pytest.mark.parametrize("named", [True, False])
def test_a_band_of_one_value_is_no_near_infrared(tmp_path: Path, kind: Any, named: bool) -> None:
    values = ground(bands=4).astype(kind)
    values[3] = 7
    path = write(tmp_path / "x.tif", values, photometric="RGB" if named else "MINISBLACK")
    scene = read_scene(path)
    assert scene.roles == ("red", "green", "blue")
    assert scene.valid.all()


@pytest.mark.parametrize("top", [1, 255, 32767])
@pytest.mark.parametrize("kind", [np.int16, np.uint16, np.float32])
def test_alpha_is_known_by_its_values_whatever_their_type(
    tmp_path: Path, kind: Any, top: int
) -> None:
    values = ground(bands=4).astype(kind) * 30
    values[3], values[3, :, 100:] = top, 0
    values[3, 40:50, 40:50] = int(top * 0.3)  # a feathered edge alone is no opaque one
    named = [R, G, B, ALPHA]
    path = write(tmp_path / "x.tif", values, interpretation=named, photometric="RGB")
    reader = SceneReader.open(path)
    assert reader.read().valid.sum() == 96 * 100 - 100
    assert not reader.read((40, 40, 10, 10)).valid.any()


@pytest.mark.parametrize("named", [None, ("red", "green", "blue", "alpha", "nir")])
def test_the_mask_of_a_reprojected_picture_is_its_alpha_band(
    tmp_path: Path, named: tuple[str, ...] | None
) -> None:
    values = ground(bands=5)
    values[3], values[3, :, :20] = 255, 0
    values[4, 40:60, 60:80] = 0  # dark in near infrared, and shown
    path = write(
        tmp_path / "x.tif",
        values,
        transform=Affine(0.5, 0, EAST, 0, -1, NORTH),
        interpretation=[R, G, B, UNDEFINED if named else ALPHA, ColorInterp.nir],
    )
    scene = read_scene(path, bands=named)
    assert scene.roles == ("red", "green", "blue", "nir")
    assert scene.valid[2:-2, 22:-2].all()
    assert not scene.valid[:, :18].any()


@pytest.mark.real
def test_real_chips_keep_their_near_infrared(shared: Path) -> None:
    chips = sorted((shared / "data" / "trees").glob("*.tif"))
    assert len(chips) >= 25
    for chip in chips:
        scene = read_scene(chip)
        assert scene.roles == ("red", "green", "blue", "nir"), chip.name
        assert scene.valid.all(), chip.name


@pytest.mark.parametrize(
    ("descriptions", "count", "roles"),
    [
        (["Blue", "Green", "Red", "NIR"], 4, ("blue", "green", "red", "nir")),
        (["B02", "B03", "B04", "B08"], 4, ("blue", "green", "red", "nir")),
        (["B2", "B3", "B4", "B8"], 4, ("blue", "green", "red", "nir")),
        (["B8", "B4", "B3", "B2", "B8A"], 5, ("nir", "red", "green", "blue")),
        (["Red", "Green", "Blue", "Red edge", "Near infrared"], 5, ("red", "green", "blue", "nir")),
        (None, 1, ("grey",)),
        (None, 3, ("red", "green", "blue")),
        (None, 4, ("red", "green", "blue", "nir")),
        (None, 6, ("red", "green", "blue")),
    ],
)
def test_roles_come_from_names_or_number(
    tmp_path: Path, descriptions: list[str] | None, count: int, roles: tuple
) -> None:
    path = write(
        tmp_path / "x.tif", ground(bands=count), descriptions=descriptions, photometric="MINISBLACK"
    )
    assert read_scene(path).roles == roles


@pytest.mark.parametrize(
    ("descriptions", "told"),
    [
        (["NIR", "Red", "Green"], r"names \(NIR, Red, Green\) do not tell .* --bands"),
        (["x1", "x2", "x3", "x4"], r"names \(x1, x2, x3, x4\) do not tell"),
        (["Band 1", "Band 2", "Band 3"], None),
        (["Red", "Green", "Blue"], None),
        (None, None),
    ],
)
def test_names_that_tell_nothing_are_told(
    tmp_path: Path, descriptions: list[str] | None, told: str | None
) -> None:
    values = ground(bands=len(descriptions or "rgb"))
    scene = read_scene(write(tmp_path / "x.tif", values, descriptions=descriptions))
    assert scene.roles == ("red", "green", "blue", "nir")[: len(values)]
    assert bool(scene.guesses) is bool(told)
    assert told is None or re.search(told, " ".join(scene.guesses))
    assert set(scene.guesses) <= set(scene.notes)


def test_given_roles_win(tmp_path: Path) -> None:
    path = write(tmp_path / "x.tif", ground(bands=4), photometric="RGB")
    scene = read_scene(path, bands=("nir", "red", "green", "other"))
    assert scene.roles == ("nir", "red", "green")
    assert np.array_equal(scene.band("red"), ground(bands=4)[1])
    for bad in (("purple",), ("red", "red"), ("red",) * 5, ("other",) * 4):
        with pytest.raises(ImageryError):
            read_scene(path, bands=bad)


@pytest.mark.parametrize("bands", [4, 5])
def test_a_mask_beside_colours_hides_though_nothing_names_it(tmp_path: Path, bands: int) -> None:
    values = ground(bands=bands)
    values[-1] = 255
    values[-1, 5:9, 5:9] = 0
    marked = [R, G, B, *[UNDEFINED] * (bands - 3)]
    path = write(tmp_path / "x.tif", values, photometric="RGB", ALPHA="NO", interpretation=marked)
    scene = read_scene(path)
    assert scene.roles == ("red", "green", "blue", "nir")[: bands - 1]
    assert (~scene.valid).sum() == 16
    values[-1] = 0  # an empty band hides nothing
    nothing = write(tmp_path / "y.tif", values, photometric="RGB", interpretation=marked)
    assert read_scene(nothing).valid.all()


def test_each_band_may_have_a_no_data_value_of_its_own(tmp_path: Path) -> None:
    values = ground()
    values[:, 5:9, 5:9] = np.array([0, 255, 0])[:, None, None]
    path = write(tmp_path / "x.tif", values, photometric="RGB")
    view = tmp_path / "x.vrt"
    rasterio.shutil.copy(path, view, driver="VRT")
    text = view.read_text()
    for nodata, colour in (("0", "Red"), ("255", "Green"), ("0", "Blue")):
        named = f"<ColorInterp>{colour}</ColorInterp>"
        text = text.replace(named, f"<NoDataValue>{nodata}</NoDataValue>{named}")
    view.write_text(text)
    assert (~read_scene(view).valid).sum() == 16


def test_grey_with_alpha(tmp_path: Path) -> None:
    values = ground(bands=2)
    values[1] = 255
    values[1, 5:9, 5:9] = 0
    scene = read_scene(write(tmp_path / "x.tif", values, photometric="MINISBLACK", ALPHA="YES"))
    assert scene.roles == ("grey",)
    assert (~scene.valid).sum() == 16


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_the_lowest_value_may_be_white(tmp_path: Path, kind: Any) -> None:
    bright = ground(bands=1)
    bright[:, :9] = 0
    values = (255 - bright).astype(kind)
    negative = write(tmp_path / "x.tif", values, photometric="MINISWHITE", nodata=255)
    scene = read_scene(negative)
    positive = read_scene(write(tmp_path / "y.tif", bright.astype(kind), nodata=0))
    assert np.array_equal(scene.bands, positive.bands)
    assert np.array_equal(scene.valid, positive.valid)
    assert not scene.valid.all()
    assert any("MINISWHITE" in note for note in scene.notes)


def test_palette_becomes_colour(tmp_path: Path) -> None:
    index = (ground(bands=1) // 64).astype(np.uint8)
    path = tmp_path / "p.tif"
    write(path, index, photometric="PALETTE")
    colours = {0: (10, 20, 30, 255), 1: (200, 0, 0, 255), 2: (0, 200, 0, 255), 3: (9, 9, 9, 255)}
    with rasterio.open(path, "r+") as file:
        file.write_colormap(1, colours)
    scene = read_scene(path)
    assert scene.roles == ("red", "green", "blue")
    table = np.array([colours[i][:3] for i in range(4)])
    assert np.array_equal(scene.rgb, table[index[0]])
    assert scene.valid.all()


# -- values ------------------------------------------------------------------------------------


def test_16_bit_shares_one_scaling_between_colours(tmp_path: Path) -> None:
    values = ground(bands=4).astype(np.uint16) * 37 + 500
    values[3] *= 3
    scene = read_scene(write(tmp_path / "x.tif", values, photometric="MINISBLACK"))
    low, high = scene.scaling or (0, 0)
    assert (low, high) == tuple(np.percentile(values[:3], (0.5, 99.5)))
    expected = np.clip(np.rint((values[:3] - low) * 255.0 / (high - low)), 0, 255)
    assert np.array_equal(scene.bands[:3], expected)
    assert scene.nir is not None
    assert scene.nir.min() == 0
    assert scene.nir.max() == 255
    again = read_scene(tmp_path / "x.tif")
    assert np.array_equal(again.bands, scene.bands)


def test_a_second_window_takes_the_first_ones_scaling(tmp_path: Path) -> None:
    values = ground(bands=4).astype(np.uint16) * 37
    values[3] *= 3
    reader = SceneReader.open(write(tmp_path / "x.tif", values, photometric="MINISBLACK"))
    small = reader.read((40, 40, 16, 16))
    large = reader.read(scaling=small.scaling, nir_scaling=small.nir_scaling)
    assert np.array_equal(large.bands[:, 40:56, 40:56], small.bands)


def test_a_given_scaling_is_applied_to_bytes_too(tmp_path: Path) -> None:
    path = write(tmp_path / "x.tif", ground(), photometric="RGB")
    scene = read_scene(path, scaling=(0, 127.5))
    assert np.array_equal(scene.bands, np.clip(ground().astype(int) * 2, 0, 255))
    # What it says of itself is not applied a second time when it is read again.
    again = read_scene(write_scene(scene, tmp_path / "y.tif"))
    assert again.scaling == (0, 127.5)
    assert np.array_equal(again.bands, scene.bands)
    assert np.array_equal(read_scene(tmp_path / "y.tif", scaling=(0, 127.5)).bands, scene.bands)


def test_float_with_nan_and_infinity(tmp_path: Path) -> None:
    values = ground().astype(np.float32) / 255
    values[:, 10:14, 10:20] = np.nan
    values[1, 50, 50] = np.inf
    scene = read_scene(write(tmp_path / "x.tif", values, photometric="RGB"))
    assert (~scene.valid).sum() == 41
    assert scene.bands[:, scene.valid].min() == 0
    assert scene.bands[:, scene.valid].max() == 255


def test_signed_and_constant(tmp_path: Path) -> None:
    values = ground().astype(np.int16) * 10 - 3000
    scene = read_scene(write(tmp_path / "x.tif", values))
    assert scene.bands.min() == 0
    assert scene.bands.max() == 255
    flat = read_scene(write(tmp_path / "flat.tif", np.full((1, 8, 8), 700, np.uint16)))
    assert np.unique(flat.bands).size == 1


@pytest.mark.parametrize("nodata", [0, 255])
def test_no_data_hides_pixels_where_every_band_has_it(tmp_path: Path, nodata: int) -> None:
    values = ground()
    values[:, :5] = nodata
    values[0, 50, 50] = nodata
    path = write(tmp_path / "x.tif", values, nodata=nodata, photometric="RGB")
    assert (~read_scene(path).valid).sum() == 5 * 128


def test_internal_mask(tmp_path: Path) -> None:
    mask = np.full((96, 128), 255, np.uint8)
    mask[:, :7] = 0
    path = write(tmp_path / "x.tif", ground(), mask=mask, photometric="RGB")
    assert np.array_equal(read_scene(path).valid, mask > 0)


def test_a_file_of_ours_says_its_own_bands_and_crs(tmp_path: Path) -> None:
    # As settings of a plan say them of the picture that its scene.tif was made from.
    known: dict[str, Any] = {"bands": ("red", "green", "blue", "other"), "crs": "EPSG:4326"}
    transform = Affine(5e-6, 0, 25.0, 0, -5e-6, 62.0)
    path = write(tmp_path / "x.tif", ground(bands=4), crs=None, transform=transform)
    source = ImagerySource("drone", attribution="Me")
    scene = read_scene(path, source=source, **known)
    again = read_scene(write_scene(scene, tmp_path / "scene.tif"), **known)
    assert again.roles == ("red", "green", "blue")
    assert again.grid == scene.grid
    assert again.source == source
    assert np.array_equal(again.bands, scene.bands)


# -- grids ---------------------------------------------------------------------------------------


def test_rotated_and_south_up_stay_as_they_are(tmp_path: Path) -> None:
    turned = Affine.translation(EAST, NORTH) * Affine.rotation(30) * Affine.scale(0.5, -0.5)
    scene = read_scene(write(tmp_path / "r.tif", ground(), transform=turned, photometric="RGB"))
    assert np.array_equal(scene.bands, ground())
    assert np.allclose(tuple(scene.grid.transform), tuple(turned), rtol=0, atol=1e-9)
    up = Affine(0.5, 0, EAST, 0, 0.5, NORTH)
    scene = read_scene(write(tmp_path / "s.tif", ground(), transform=up, photometric="RGB"))
    assert scene.notes == ()
    assert np.array_equal(scene.bands, ground())


def test_degrees_near_the_equator_stay_degrees(tmp_path: Path) -> None:
    transform = Affine(5e-6, 0, 33.5, 0, -5e-6, 5.0)
    path = write(tmp_path / "x.tif", ground(), crs="EPSG:4326", transform=transform)
    scene = read_scene(path)
    assert scene.grid.crs.to_epsg() == 4326
    assert np.array_equal(scene.bands, ground())


def test_degrees_at_high_latitude_are_reprojected_and_recorded(tmp_path: Path) -> None:
    transform = Affine(5e-6, 0, 25.0, 0, -5e-6, 62.0)
    values = ground(400, 400)
    values[:, 195:205, 190:210] = 254
    path = write(tmp_path / "x.tif", values, crs="EPSG:4326", transform=transform)
    scene = read_scene(path)
    assert scene.grid.crs.to_epsg() == 32635
    assert "Reprojected from WGS 84" in scene.notes[-1]
    # The bright block is where it was, to a pixel.
    x, y = scene.grid.from_lonlat(25.0 + 200 * 5e-6, 62.0 - 200 * 5e-6)
    rows, columns = np.nonzero(np.all(scene.bands == 254, axis=0))
    assert np.mean(columns) + 0.5 == pytest.approx(x, abs=1.0)
    assert np.mean(rows) + 0.5 == pytest.approx(y, abs=1.0)
    assert not scene.valid.all()
    # Twice as many rows as columns of degrees cover the same ground at 62 N.
    window = read_scene(path, lat=61.999, lon=25.001, size_m=40)
    assert window.grid.ground_resolution_m == pytest.approx(0.261, abs=0.01)
    assert abs(window.grid.width_px * window.grid.ground_resolution_m - 40) < 0.5


def test_oblong_pixels_are_reprojected(tmp_path: Path) -> None:
    transform = Affine(0.5, 0, EAST, 0, -1.0, NORTH)
    scene = read_scene(write(tmp_path / "x.tif", ground(), transform=transform))
    assert "times longer one way" in scene.notes[-1]
    assert scene.grid.ground_resolution_m == pytest.approx(0.5, rel=0.01)


@pytest.mark.parametrize(
    ("code", "corner", "told"),
    [
        # By PROJ's register 22 m, and no grid that would make it better.
        (24378, (3_500_000.0, 900_000.0), r"Positions in EPSG:24378 are good to 22 m"),
        ("+proj=tmerc +lon_0=9 +ellps=bessel", (2e4, 53e5), "does not say how its datum lies"),
        ("+proj=tmerc +lon_0=9 +ellps=GRS80", (2e4, 53e5), None),
        (26910, (5e5, 42e5), None),  # NAD83, which PROJ takes for WGS 84
        (2056, (26e5, 12e5), None),
    ],
)
def test_a_datum_that_is_metres_off_is_told(
    tmp_path: Path, code: Any, corner: tuple[float, float], told: str | None
) -> None:
    """British and German pictures lie 1 or 2 m off where PROJ has no grid, which nothing told."""
    place = Affine(RESOLUTION, 0, corner[0], 0, -RESOLUTION, corner[1])
    crs = rasterio.CRS.from_user_input(code)
    scene = read_scene(write(tmp_path / "old.tif", ground(), crs=crs, transform=place))
    assert len(scene.guesses) == (told is not None)
    assert told is None or re.match(f".*{told}", scene.guesses[0])


def test_ground_control_points_place_a_picture(tmp_path: Path) -> None:
    corners = [(0, 0), (0, 128), (96, 128), (96, 0)]
    gcps = [
        GroundControlPoint(row, col, EAST + 0.5 * col, NORTH - 0.5 * row) for row, col in corners
    ]
    path = tmp_path / "g.tif"
    profile = {"width": 128, "height": 96, "count": 3, "dtype": "uint8", "photometric": "RGB"}
    with rasterio.open(path, "w", driver="GTiff", gcps=gcps, crs=UTM, **profile) as file:
        file.write(ground())
    scene = read_scene(path)
    assert "4 ground control points" in scene.notes[-1]
    lon, lat = Grid(1, 1, Affine(1, 0, EAST, 0, -1, NORTH), UTM).to_lonlat(32, 24)
    x, y = scene.pixel_of(lat=lat, lon=lon)
    assert (x, y) == pytest.approx((64, 48), abs=0.5)
    inner = scene.bands[:, 10:80, 10:110].astype(int)
    assert np.abs(inner - ground()[:, 10:80, 10:110]).mean() < 6


# -- bad input --------------------------------------------------------------------------------


def test_points_outside_or_on_no_data(tmp_path: Path) -> None:
    values = ground()
    values[:, :20] = 0
    path = write(tmp_path / "x.tif", values, nodata=0, photometric="RGB")
    grid = SceneReader.open(path).grid
    lon, lat = grid.to_lonlat(64, 48)
    with pytest.raises(PointOutsideError, match="covers lat"):
        read_scene(path, lat=lat + 1, lon=lon)
    with pytest.raises(PointOutsideError, match=f"look swapped: try lat={lat} lon={lon}"):
        read_scene(path, lat=lon, lon=lat)
    lon, lat = grid.to_lonlat(64, 5)
    with pytest.raises(PointOutsideError, match="no data"):
        read_scene(path, lat=lat, lon=lon)


def test_no_crs_no_position(tmp_path: Path) -> None:
    path = write(tmp_path / "x.tif", ground(), crs=None)
    with pytest.raises(CRSError, match="does not name its coordinate reference system") as told:
        read_scene(path, lat=-33.5, lon=150.0)
    assert "EPSG:32756 (UTM zone 56S)" in str(told.value.hint)  # the zone of the place
    assert read_scene(path, crs=UTM).grid.crs.to_epsg() == 32636
    from PIL import Image

    Image.fromarray(np.moveaxis(ground(), 0, -1)).save(tmp_path / "photo.png")
    for named in (None, UTM):  # a CRS would not help
        with pytest.raises(CRSError, match="no position on the ground"):
            read_scene(tmp_path / "photo.png", crs=named)


def test_unreadable_truncated_empty(tmp_path: Path, rgb: str) -> None:
    with pytest.raises(ImageryError, match="There is no picture"):
        read_scene(tmp_path / "missing.tif")
    (tmp_path / "text.tif").write_text("not a picture")
    with pytest.raises(ImageryError, match="cannot be opened"):
        read_scene(tmp_path / "text.tif")
    with zipfile.ZipFile(tmp_path / "packed.zip", "w") as archive:
        archive.write(rgb, "ortho.tif")
    with pytest.raises(ImageryError, match="cannot be opened") as refused:
        read_scene(tmp_path / "packed.zip")
    assert "unpacked from its archive" in str(refused.value.hint)
    (tmp_path / "zero.tif").touch()
    with pytest.raises(ImageryError, match="0 bytes"):
        read_scene(tmp_path / "zero.tif")
    data = Path(rgb).read_bytes()
    (tmp_path / "cut.tif").write_bytes(data[: len(data) // 2])
    with pytest.raises(ImageryError, match="truncated or damaged"):
        read_scene(tmp_path / "cut.tif")


def test_nothing_to_see(tmp_path: Path) -> None:
    path = write(tmp_path / "x.tif", np.full((3, 9, 9), np.nan, np.float32))
    with pytest.raises(ImageryError, match="holds no data"):
        read_scene(path)
    path = write(tmp_path / "c.tif", np.zeros((1, 9, 9), np.complex64))
    with pytest.raises(ImageryError, match="complex"):
        read_scene(path)


def test_half_a_point_or_two_sizes(rgb: str) -> None:
    with pytest.raises(ImageryError, match="both lat and lon"):
        read_scene(rgb, lat=35.0)
    with pytest.raises(ImageryError, match="needs a point"):
        read_scene(rgb, size_px=30)
    with pytest.raises(ImageryError, match="given twice"):
        read_scene(rgb, lat=35.0, lon=33.5, size_px=30, size_m=3)


# -- writing -----------------------------------------------------------------------------------


@settings(max_examples=15, deadline=None)
@given(
    zoom=st.integers(0, 22),
    lat=st.floats(-80, 80),
    lon=st.floats(-179, 179),
    width=st.integers(1, 40),
    height=st.integers(1, 40),
)
def test_georeference_survives_exactly(
    tmp_path_factory: pytest.TempPathFactory,
    zoom: int,
    lat: float,
    lon: float,
    width: int,
    height: int,
) -> None:
    grid = Grid.web_mercator(lat=lat, lon=lon, zoom=zoom, width_px=width, height_px=height)
    scene = Scene(
        grid, np.ones((1, height, width), np.uint8), ("grey",), np.ones((height, width), bool)
    )
    path = write_scene(scene, tmp_path_factory.mktemp("exact") / "x.tif")
    with rasterio.open(path) as file:
        assert file.transform == grid.transform
        assert file.crs.to_epsg() == 3857


@pytest.mark.parametrize(
    "roles", [("grey",), ("red", "green", "blue"), ("red", "green", "blue", "nir"), ("nir", "red")]
)
@pytest.mark.parametrize("holes", [False, True])
def test_a_written_scene_is_read_back_equal(
    tmp_path: Path, roles: tuple[str, ...], holes: bool
) -> None:
    from rio_cogeo import cog_validate

    values = ground(700, 600, len(roles))
    valid = np.ones(values.shape[1:], bool)
    valid[100:200, 100:200] = not holes
    scene = Scene(
        Grid(600, 700, Affine(0.3, 0.01, EAST, 0.01, -0.3, NORTH), UTM),
        np.where(valid, values, np.uint8(0)),
        roles,
        valid,
        ImagerySource(
            "survey", "2024-05-01", "© Survey", "CC BY 4.0", zoom=18, details=(("fetched", "x"),)
        ),
        scaling=(3.0, 4000.5),
        notes=("Reprojected.",),
    )
    path = write_scene(scene, tmp_path / "a.tif")
    back = read_scene(path)
    assert back.grid == scene.grid
    assert back.roles == scene.roles
    assert np.array_equal(back.bands, scene.bands)
    assert np.array_equal(back.valid, scene.valid)
    assert back.source == scene.source
    assert back.scaling == scene.scaling
    assert back.notes[:1] == scene.notes
    good, errors, warnings = cog_validate(path, strict=True)
    assert (good, errors, warnings) == (True, [], [])
    with rasterio.open(path) as file:
        assert file.block_shapes[0] == (512, 512)
        assert file.overviews(1) == [2]
        assert (rasterio.enums.MaskFlags.per_dataset in file.mask_flag_enums[0]) is holes
    again = write_scene(scene, tmp_path / "b.tif")
    assert hashlib.sha256(path.read_bytes()).digest() == hashlib.sha256(again.read_bytes()).digest()


def test_an_existing_file_is_refused_and_nothing_is_left(tmp_path: Path, rgb: str) -> None:
    scene = read_scene(rgb)
    target = tmp_path / "out.tif"
    write_scene(scene, target)
    with pytest.raises(OutputExistsError):
        write_scene(scene, target)
    write_scene(scene, target, overwrite=True)
    with pytest.raises(FormatError, match="folder exists"):
        write_scene(scene, tmp_path / "no" / "out.tif")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.tif", "rgb.tif"]


def test_near_infrared_tagged_as_alpha_in_degrees(tmp_path: Path) -> None:
    """GDAL writes the fourth band of a camera as alpha; degrees are reprojected."""
    path = tmp_path / "camera.tif"
    values = np.random.default_rng(0).integers(1, 255, (4, 300, 300), dtype=np.uint8)
    transform = Affine(6e-6, 0, 10.0, 0, -5e-6, 60.0)
    profile = {"driver": "GTiff", "width": 300, "height": 300, "count": 4, "dtype": "uint8"}
    place = {"crs": "EPSG:4326", "transform": transform}
    with rasterio.open(path, "w", **profile, **place, photometric="RGB", alpha="YES") as data:
        data.write(values)
    scene = read_scene(path, lat=59.99925, lon=10.0009)
    assert scene.roles == ("red", "green", "blue", "nir")
    assert scene.valid.mean() > 0.9
    near = scene.bands[3][scene.valid]
    assert near.mean() == pytest.approx(values[3].mean(), abs=2)


def test_a_picture_that_the_disk_cut_off_is_told(tmp_path: Path, simulated: SimulatedField) -> None:
    """GDAL told nobody: a picture without its last rows was left, and the command was content."""
    resource = pytest.importorskip("resource")
    whole = write_scene(simulated.scene, tmp_path / "whole.tif").stat().st_size
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    for room in (whole // 2, whole - 4096):
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, limits[1]))
        try:
            with pytest.raises(FormatError, match="to its end"):
                write_scene(simulated.scene, tmp_path / "cut.tif")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [path.name for path in tmp_path.iterdir()] == ["whole.tif"]
