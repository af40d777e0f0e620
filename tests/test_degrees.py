"""Latitudes and longitudes as receivers show them and people type them."""

from __future__ import annotations

from pathlib import Path

import pytest
import rasterio

from geofield.angles import angle_of
from geofield_command import run_geofield

SAMPLE = Path(__file__).parents[1] / "sample_data/field_1.tif"


@pytest.mark.parametrize(
    ("text", "degrees"),
    [
        ("35 4.524 N", 35.0754),
        ("N35° 04.524'", 35.0754),
        ("35°4′31.44″", 35.0754),
        ("35° 4' 31.44'' n", 35.0754),
        ("35d4m31.44s S", -35.0754),
        ("-35:04:31.44", -35.0754),
        ("\N{MINUS SIGN}35.0754°", -35.0754),
        ("0 30 S", -0.5),
        ("35 04 31.44 S", -35.0754),
        ("35:04:31.44S", -35.0754),
        ("35d4m31.44s", 35.0754),
    ],
)
def test_an_angle_in_parts(text: str, degrees: float) -> None:
    assert angle_of(text, "NS") == pytest.approx(degrees, abs=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "35.0754 33.5311",
        "35 64 N",
        "35 4 60",
        "33 31 E",
        "-35 N",
        "35'4",
        "O 35",
        "N",
        "4 5 6 7",
        "35d4m31S",
    ],
)
def test_what_is_no_angle(text: str) -> None:
    assert angle_of(text, "NS") is None


def test_a_latitude_is_no_longitude() -> None:
    assert angle_of("33 31 52 S", "EW") is None


def test_a_place_as_a_receiver_shows_it(tmp_path: Path) -> None:
    places = {
        "plain.tif": ("35.0754", "33.5311"),
        "parts.tif": ("35 4.524 N", "33°31'51.96\"E"),
    }
    for name, (lat, lon) in places.items():
        cut = ("--size-m", "60", "-o", str(tmp_path / name))
        done = run_geofield("tiles", str(SAMPLE), "--lat", lat, "--lon", lon, *cut)
        assert done.returncode == 0, done.stderr
    with rasterio.open(tmp_path / "plain.tif") as one, rasterio.open(tmp_path / "parts.tif") as two:
        assert one.transform == two.transform
        assert (one.read() == two.read()).all()


@pytest.mark.parametrize(
    ("lat", "told"),
    [
        ("35,0754", "write 35.0754."),
        ("35 4,524 N", "write 35 4.524 N."),
        ("33.5 E", "write degrees, such as 35.0754 or 35 4.524 N."),
        ("nan", "write degrees,"),
    ],
)
def test_another_is_refused_with_what_to_write(lat: str, told: str) -> None:
    done = run_geofield("field", str(SAMPLE), "--lat", lat, "--lon", "33.5", "-o", "x.gpkg")
    assert done.returncode == 2
    assert told in " ".join(done.stderr.split())
