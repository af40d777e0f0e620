"""The map as SVG and PDF: drawn as lines, with words that are words."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
from PIL import Image

import geofield as gf
from geofield import theme
from geofield.simulate import SimulatedField
from geofield_command import run_geofield

pytest.importorskip("matplotlib")

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def maps(simulated: SimulatedField, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("maps")
    plan = gf.plan_field(
        simulated.scene,
        lat=simulated.lat,
        lon=simulated.lon,
        spacing_m=10,
        name="Hill & Dale \N{LATIN SMALL LETTER D WITH PALATAL HOOK}",
    )
    plan.write(folder, formats=["gpkg"])
    export = ("export", folder / "field.gpkg", "-f", "map-svg", "-f", "map-pdf")
    run_geofield(*export, "--out", folder, check=True)
    return folder


def test_the_svg_holds_lines_and_words(maps: Path) -> None:
    plan = gf.read_plan(maps / "field.gpkg")
    root = ET.parse(maps / "map.svg").getroot()
    words = " ".join("".join(each.itertext()) for each in root.iter(f"{SVG}text"))
    assert "Hill & Dale" in words
    assert f"{len(plan.tracks.lines)} tracks, {len(plan.tracks.segments)} segments" in words
    assert "true north" in words or "north is up" in words
    assert "simulate" in words  # whose picture it is
    drawn = [each.get("d", "") for each in root.iter(f"{SVG}path")]
    assert len(drawn) > len(plan.tracks.segments)
    assert len(list(root.iter(f"{SVG}image"))) == 1


def test_obstacles_have_their_numbers_and_turns_that_do_not_fit_are_told(
    maps: Path, tmp_path: Path
) -> None:
    """The sheet had no number, and all turns in one colour."""
    plan = tmp_path / "route.gpkg"
    route = ("--route", "shortest", "--turning-radius", "6")
    run_geofield("tracks", maps / "field.gpkg", *route, "-o", plan, check=True)
    run_geofield("export", plan, "-f", "map-svg,map", "--out", tmp_path, check=True)
    root = ET.parse(tmp_path / "map.svg").getroot()
    words = ["".join(each.itertext()) for each in root.iter(f"{SVG}text")]
    obstacles = gpd.read_file(plan, layer="obstacles")
    assert {str(number) for number in obstacles["obstacle_no"]} <= set(words)
    turns = gpd.read_file(plan, layer="turns")
    unfit = int((turns["fits"] == "no").sum())
    assert 1 < unfit < len(turns)
    assert f"{unfit} turns that do not fit" in words
    styles = [each.get("style", "") for each in root.iter(f"{SVG}path")]
    assert sum("stroke: #ff1744" in style for style in styles) == unfit + 1  # and the legend
    with Image.open(tmp_path / "map.png") as image:
        picture = np.asarray(image.convert("RGB")).astype(int)
    shown = (np.abs(picture - theme.rgb(theme.UNFIT)).max(axis=2) < 40).sum()
    assert shown > 10_000  # 13 800, and 6200 where obstacles' lines hid them


@pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")
def test_a_name_is_no_formula(maps: Path, tmp_path: Path) -> None:
    """`Field $1 and $2` lost its blanks, others ended in a traceback."""
    plan = gf.read_plan(maps / "field.gpkg")
    for name in ("Field $1 and $2", r"A $\frac$ B"):
        named = replace(plan, field=replace(plan.field, name=name))
        named.write(tmp_path, formats=["map-svg"], overwrite=True)
        root = ET.parse(tmp_path / "map.svg").getroot()
        assert name in " ".join("".join(each.itertext()) for each in root.iter(f"{SVG}text"))
        assert named.plot().get_title() == name
        named.plot().figure.canvas.draw()


def test_the_pdf_is_one_page_of_a4(maps: Path) -> None:
    data = (maps / "map.pdf").read_bytes()
    assert data.startswith(b"%PDF")
    assert len(re.findall(rb"/Type /Page\b", data)) == 1
    (box,) = re.findall(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+)", data)
    long_mm, short_mm = (float(side) / 72 * 25.4 for side in box)
    assert (long_mm, short_mm) == pytest.approx((297, 210), abs=1.5)
    assert b"CreationDate" not in data


def test_letters_that_the_usual_font_lacks_are_drawn_with_another(maps: Path) -> None:
    fonts = set(re.findall(rb"/BaseFont /(?:[A-Z]{6}\+)?([\w-]+)", (maps / "map.pdf").read_bytes()))
    assert b"DejaVuSans" in fonts
    # matplotlib's font of last resort draws a box for every letter.
    assert not any(each.startswith(b"LastResort") for each in fonts)
    assert fonts - {b"DejaVuSans"}


def test_they_are_renewed_with_the_plan(maps: Path) -> None:
    plan = maps / "field.gpkg"
    run_geofield("tracks", plan, "--spacing", 20, "-o", plan, check=True)
    before = (maps / "map.svg").read_text(encoding="utf-8")
    run_geofield("refresh", plan, check=True)
    after = (maps / "map.svg").read_text(encoding="utf-8")
    assert after != before
    assert f"{len(gf.read_plan(plan).tracks.lines)} tracks" in after


def test_without_its_library_it_is_refused_before_the_work(sample: Path, tmp_path: Path) -> None:
    without = "import sys; sys.modules['matplotlib'] = None; from geofield.cli import main; main()"
    place = ("--lat", "35.075373", "--lon", "33.531142", "--out", "out")
    asked = ("run", sample / "field_1.tif", *place, "--format", "gpkg", "--format", "map-pdf")
    done = subprocess.run(
        [sys.executable, "-c", without, *asked],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "Map on a page for print (PDF) needs matplotlib." in done.stderr
    assert "pip install 'geofield[plot]'" in done.stderr
    assert not (tmp_path / "out").exists()
