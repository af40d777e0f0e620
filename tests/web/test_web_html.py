"""A plan as one HTML file, opened in a real browser from the disk."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axe_core_python.selenium import Axe
from PIL import Image
from pyproj import CRS, Transformer
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.ui import WebDriverWait

import geofield as gf
from geofield import theme
from geofield.formats import read_dataset
from geofield.model.map_words import figures_in_words
from geofield.web.view import place_table
from geofield_command import run_geofield

ROOT = Path(__file__).resolve().parents[2]
pytestmark = [pytest.mark.browser, pytest.mark.xdist_group("review")]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the main job, and the page exported from its plan."""
    folder = tmp_path_factory.mktemp("page")
    place = ["--lat", "35.075373", "--lon", "33.531142", "--spacing", "4", "--format", "gpkg"]
    picture = str(ROOT / "sample_data" / "field_1.tif")
    for command in (
        ["run", picture, *place, "--route", "shortest", "--turning-radius", "5"],
        ["export", str(folder / "field.gpkg"), "-f", "html"],
    ):
        run_geofield(*command, "--out", folder, check=True)
    return folder


def test_places_across_180_degrees_go_on() -> None:
    x, y = Transformer.from_crs(4326, 32701, always_xy=True).transform(-179.999, -17.0)
    table = place_table(CRS(32701), (x - 500, y - 500, x + 500, y + 500))
    assert np.ptp(table["lon"]) < 0.02  # a parabola through 179.9 and -179.9 leads nowhere


def test_the_page_opens_from_the_disk_and_asks_nobody(folder: Path, tmp_path: Path) -> None:
    binary, program = shutil.which("chromium"), shutil.which("chromedriver")
    if not binary or not program:
        pytest.skip("Chromium and its driver are not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1200,800"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(program))
    try:
        driver.get((folder / "field.html").as_uri())
        WebDriverWait(driver, 20).until(
            lambda d: d.execute_script("return document.body.dataset.ready")
        )
        asked = driver.execute_script(
            "return performance.getEntriesByType('resource').map(e => e.name)"
            ".filter(name => !name.startsWith('data:') && !name.startsWith('blob:'))"
        )
        assert asked == []
        assert not [e for e in driver.get_log("browser") if e["level"] == "SEVERE"]
        shown = driver.execute_script("return document.querySelector('aside').innerText")
        plan = gf.read_plan(folder / "field.gpkg")
        assert plan.tracks is not None
        assert f"{plan.field.area_ha:.2f} ha" in shown
        assert f"{len(plan.tracks.lines)} ·" in shown
        assert "Turn that does not fit" in shown
        pixels = np.asarray(Image.open(BytesIO(driver.get_screenshot_as_png())).convert("RGB"))
        like = np.abs(pixels[:, :880].astype(int) - theme.rgb(theme.UNFIT)).sum(axis=2) < 30
        assert plan.tracks.turns is not None
        assert (plan.tracks.turns["fits"] == "no").any()
        assert like.sum() > 7000  # 11 800, and 3800 when the obstacles' lines hid them
        # What no track goes around is not counted among the obstacles.
        assert plan.obstacles is not None
        some = plan.obstacles.assign(status=["rejected"] * 5 + ["confirmed"] * 16)
        driver.get(replace(plan, obstacles=some).explore().save(tmp_path / "a.html").as_uri())
        WebDriverWait(driver, 20).until(
            lambda d: d.execute_script("return document.body.dataset.ready")
        )
        shown = driver.execute_script("return document.querySelector('#facts').innerText")
        assert re.search(r"Obstacles\s+16\s+rejected\s+5", shown)
        driver.get((folder / "field.html").as_uri())
        size = {"width": 360, "height": 800, "deviceScaleFactor": 1, "mobile": True}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        assert driver.execute_script("return document.documentElement.scrollWidth") == 360
        assert not [(v["id"], v["nodes"][0]["html"]) for v in Axe().run(driver)["violations"]]
    finally:
        driver.quit()


def values_in(page: Path) -> dict[str, Any]:
    """What a page holds."""
    text = page.read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="plan">(.*?)</script>', text, re.S)
    assert found is not None
    values: dict[str, Any] = json.loads(found.group(1))
    return values


def test_the_page_holds_the_plan_in_its_own_zone(folder: Path) -> None:
    values = values_in(folder / "field.html")
    plan = gf.read_plan(folder / "field.gpkg")
    assert plan.obstacles is not None
    assert plan.tracks is not None
    assert values["field"]["rings"][0][0] == pytest.approx(
        list(plan.field.polygon.exterior.coords[0]), abs=6e-4
    )
    assert len(values["obstacles"]) == len(plan.obstacles)
    assert len(values["tracks"]) == len(plan.tracks.segments)
    assert values["picture"].startswith("data:image/webp;base64,")


def test_imported_tracks_are_shown_and_nothing_is_said_that_nobody_recorded(
    folder: Path, tmp_path: Path
) -> None:
    """The page had none of them, without a word, and the map said "heading nan"."""
    terminal, plan, out = tmp_path / "terminal", tmp_path / "plan.gpkg", tmp_path / "out"
    for words in (
        ["export", folder / "field.gpkg", "-f", "isoxml", "--out", terminal],
        ["import", terminal / "isoxml", "-o", plan],
        ["export", plan, "-f", "html", "--out", out],
    ):
        run_geofield(*words, check=True)
    values = values_in(out / "field.html")
    there = read_dataset(plan)
    assert len(values["tracks"]) == len(there.table("segments")) > 40
    figures = values["figures"]
    assert figures["length_m"] == pytest.approx(there.table("segments")["length_m"].sum())
    assert figures["coverage_percent"] is figures["heading_deg"] is None
    assert re.fullmatch(r"\d+ tracks, \d+ segments, \d\.\d\d km", figures_in_words(there)[2])


def test_names_cannot_break_out(folder: Path, tmp_path: Path) -> None:
    plan = gf.read_plan(folder / "field.gpkg")
    evil = "</script><script>document.title='owned'</script><!--"
    page = replace(plan, field=replace(plan.field, name=evil)).explore()
    assert evil not in page.text
    assert "sandbox" in page._repr_html_()
    assert len(repr(page)) < 100
    assert page.save(tmp_path / "map.html").read_text(encoding="utf-8") == page.text
