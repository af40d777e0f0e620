"""The review page as a person feels it: ready, after a drag, on large fields and pictures.

Needs Chromium and its driver (Debian: chromium chromium-driver). Times are medians of wall time.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psutil
import rasterio
import shapely
from affine import Affine
from pyproj import CRS
from rasterio.windows import Window
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains

import geofield as gf
from common import machine, write_page
from geofield import schema
from geofield.model.obstacles import circle_polygons, from_polygons
from geofield.plan import Plan
from geofield.plan_files import save_plan
from geofield.settings import Settings

#: Modules lie compiled, as an installation leaves them, whatever this shell forbids.
INSTALLED = {
    **{name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"},
    "PYTHONPYCACHEPREFIX": str(Path(tempfile.gettempdir()) / "geofield-benchmark-compiled"),
}
SAMPLE = Path(__file__).resolve().parents[1] / "sample_data" / "field_1.tif"
TIMES = 9

# Counts what the browser has drawn of a drag, from outside: frames with other tracks while the
# pointer is down, and milliseconds from letting go to the frame with the answer to the edit.
WATCH = """
const done = arguments[0];
import("/map.js").then(({map, sources}) => {
  const begun = {frames: 0, ms: null, down: true}, seen = window.seen = {};
  let revision = 0, up = 0;
  const edits = () => performance.getEntriesByName(location.origin + "/api/edit");
  const answered = () => edits().at(-1)?.startTime >= up;
  addEventListener("pointerdown", () => Object.assign(seen, begun), true);
  addEventListener("pointerup", () => { seen.down = false; up = performance.now(); }, true);
  map.on("postrender", () => {
    const now = sources.tracks.getRevision();
    if (seen.down && now !== revision) seen.frames++;
    revision = now;
  });
  map.on("rendercomplete", () => {
    if (!seen.down && seen.ms === null && answered()) seen.ms = performance.now() - up;
  });
  performance.setResourceTimingBufferSize(100000);
  done();
});
"""
WHERE = """
const [number, done] = arguments;
import("/map.js").then(({map, sources}) => {
  map.renderSync();
  const box = map.getTargetElement().getBoundingClientRect();
  const shape = sources.obstacles.getFeatureById(number).getGeometry();
  const [x, y] = map.getPixelFromCoordinate(shape.getInteriorPoint().getCoordinates());
  done([box.left + x, box.top + y]);
});
"""
# Pans and zooms; the longest time in which tiles were missing on the screen.
PAN = """
const done = arguments[0];
(async () => {
  const {map, view} = await import("/map.js");
  let worst = 0;
  const [left, bottom, right, top] = view.getProjection().getExtent();
  view.setResolution(0.6);
  for (let i = 0; i < 12; i++) {
    const start = performance.now();
    const x = 0.1 + 0.065 * i, y = 0.85 - 0.06 * i;
    view.setCenter([left + (right - left) * x, bottom + (top - bottom) * y]);
    await new Promise(next => { map.once("rendercomplete", next); map.render(); });
    worst = Math.max(worst, performance.now() - start);
  }
  done(worst);
})();
"""


@contextlib.contextmanager
def served(plan: Path, *options: str) -> Iterator[tuple[str, psutil.Process, float, float]]:
    """Address, process, and seconds until the page answers and until it has the plan."""
    start = time.perf_counter()
    command = [sys.executable, "-m", "geofield", "review", str(plan), "--no-browser", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=INSTALLED)
    assert process.stdout is not None
    address = process.stdout.readline().strip()
    browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    browser.open(address).read()
    ready = time.perf_counter() - start
    browser.open(address.split("?")[0] + "api/state").read()
    plan_s = time.perf_counter() - start
    try:
        yield address, psutil.Process(process.pid), ready, plan_s
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20)


def started(plan: Path) -> tuple[float, float]:
    """Seconds until the page answers, and until it has the plan."""
    with served(plan) as (_, _, ready, known):
        return ready, known


def opened(driver: webdriver.Chrome, address: str) -> float:
    """Seconds until the page shows the plan."""
    start = time.perf_counter()
    driver.get(address)
    while not driver.execute_script("return document.body && document.body.dataset.ready"):
        time.sleep(0.02)
    driver.execute_async_script(
        "const done = arguments[0]; import('/map.js').then(({map}) => "
        "{ map.once('rendercomplete', () => done()); map.render(); });"
    )
    return time.perf_counter() - start


def dragged(driver: webdriver.Chrome, number: int, seconds: float = 2.0) -> tuple[float, float]:
    """Drag an obstacle about as a hand does.

    Returns
    -------
    float, float
        Milliseconds from letting go to new tracks on the screen; frames with new tracks a second.
    """
    driver.execute_script("window.seen.ms = null")
    column, row = driver.execute_async_script(WHERE, number)

    def mouse(kind: str, x: float, y: float) -> None:
        given = {"type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1}
        driver.execute_cdp_cmd("Input.dispatchMouseEvent", given)

    mouse("mousePressed", column, row)
    start, step = time.perf_counter(), 0
    while (passed := time.perf_counter() - start) < seconds:
        step += 1
        mouse("mouseMoved", column + 30 * np.sin(step / 9), row + 20 * np.cos(step / 9) - 20)
        time.sleep(0.008)
    mouse("mouseReleased", column + 8, row - 6)
    while (ms := driver.execute_script("return window.seen.ms")) is None:
        time.sleep(0.01)
    return ms, driver.execute_script("return window.seen.frames") / passed


def judged(driver: webdriver.Chrome, count: int) -> float:
    """Seconds until so many obstacles are confirmed or rejected by keys, each seen first."""
    waiting = driver.find_element("id", "left")

    def number() -> int:
        return int(re.findall("[0-9]+", waiting.text)[0])

    start, begun = time.perf_counter(), number()
    ActionChains(driver).send_keys("j").perform()  # what was dragged is judged already
    for at in range(count):
        ActionChains(driver).send_keys("r" if at % 3 == 0 else "c").perform()
        until = time.perf_counter() + 10
        while number() > begun - at - 1:
            if time.perf_counter() > until:
                raise TimeoutError(f"key {at + 1} judged nothing")
            time.sleep(0.01)
    return time.perf_counter() - start


def left(driver: webdriver.Chrome) -> None:
    """Leave the page though there are edits."""
    driver.execute_cdp_cmd("Page.enable", {})
    driver.get("about:blank")
    with contextlib.suppress(Exception):
        driver.switch_to.alert.accept()


def large_plan(folder: Path) -> Path:
    """100 ha with 400 obstacles, 3 m spacing."""
    x, y = 500_000.0, 4_000_000.0
    field = gf.Field(
        shapely.Polygon([(x, y), (x + 1000, y + 50), (x + 1020, y + 1000), (x + 10, y + 990)]),
        crs=CRS.from_epsg(32636),
    )
    rng = np.random.default_rng(7)
    cx, cy = x + 50 + 900 * rng.random(400), y + 80 + 880 * rng.random(400)
    radius = 2 + 6 * rng.random(400)
    circles = circle_polygons(cx, cy, radius + 1, field.crs)
    obstacles = from_polygons(circles, field.crs, buffer_m=0.0)
    obstacles["radius_m"], obstacles["buffer_m"], obstacles["kind"] = radius, 1.0, "tree"
    obstacles["status"], obstacles["confidence"] = "detected", rng.uniform(0.3, 1.0, 400)
    plan = Plan(
        field,
        schema.conform(schema.OBSTACLES, obstacles),
        settings=Settings(tracks={"spacing_m": 3.0}),
    )
    save_plan(plan, folder / "large.gpkg")
    return folder / "large.gpkg"


def large_picture(folder: Path, plan: Path, side_px: int = 20_000) -> Path:
    """A COG of 20 000 x 20 000 px of the sample repeated, around the sample's field."""
    with rasterio.open(SAMPLE) as data:
        block = data.read([1, 2, 3])
        profile, transform = data.profile, data.transform
    block = np.tile(block, (1, 2, 2))[:, :512, :512]
    shift = Affine.translation(-side_px // 2, -side_px // 2)
    profile = {
        **{"driver": "GTiff", "dtype": "uint8", "count": 3, "crs": profile["crs"]},
        **{"width": side_px, "height": side_px, "transform": transform @ shift},
        **{"tiled": True, "blockxsize": 512, "blockysize": 512},
        **{"compress": "JPEG", "photometric": "YCBCR", "jpeg_quality": 80},
    }
    path = folder / "large.tif"
    with rasterio.open(path, "w", **profile) as out:
        for row in range(0, side_px, 512):
            for column in range(0, side_px, 512):
                size = min(512, side_px - column), min(512, side_px - row)
                part = block[:, : size[1], : size[0]]
                out.write(part, window=Window(column, row, *size))
    with rasterio.open(path, "r+") as out:
        out.build_overviews([2, 4, 8, 16, 32], rasterio.enums.Resampling.average)
    return path


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1280,860"):
        options.add_argument(flag)
    driver = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
    driver.set_script_timeout(120)
    rows: list[tuple[str, str, str]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run = [sys.executable, "-m", "geofield", "run", str(SAMPLE), "--lat", "35.075373"]
        more = ["--lon", "33.531142", "--spacing", "4", "--format", "gpkg", "--out", str(folder)]
        subprocess.run([*run, *more], check=True, capture_output=True)
        for what, plan, number, goals in (
            ("3.6 ha, 20 obstacles", folder / "field.gpkg", 8, ("1 s", "150 ms", "10")),
            ("100 ha, 400 obstacles", large_plan(folder), 200, ("-", "500 ms", "-")),
        ):
            starts = [started(plan) for _ in range(5)]
            with served(plan) as (address, *_):
                opened(driver, address)
                driver.execute_async_script(WATCH)
                driver.find_element("css selector", f'#list [data-no="{number}"]').click()
                time.sleep(0.5)
                drags = [dragged(driver, number) for _ in range(TIMES)]
                keyed = judged(driver, 30) if plan.stem == "large" else None
                left(driver)
            ready, known = (statistics.median(each) for each in zip(*starts, strict=True))
            ms, frames = (statistics.median(each) for each in zip(*drags, strict=True))
            rows.append((f"{what}: command to answering page", f"{ready:.2f} s", goals[0]))
            rows.append((f"{what}: command to the plan's data", f"{known:.2f} s", goals[0]))
            rows.append((f"{what}: end of a drag to new tracks", f"{ms:.0f} ms", goals[1]))
            rows.append((f"{what}: tracks drawn a second in a drag", f"{frames:.0f}", goals[2]))
            if keyed is not None:
                rows.append((f"{what}: 30 of them judged by keys", f"{keyed:.1f} s", "60 s"))
        picture = large_picture(folder, folder / "field.gpkg")
        with served(folder / "field.gpkg", "--picture", str(picture)) as (address, process, *_):
            shown = opened(driver, address)
            worst = driver.execute_async_script(PAN)
            memory = process.memory_info().rss / 1e6
            rows.append(("20 000 x 20 000 px: page shown", f"{shown:.2f} s", "2 s"))
            rows.append(("the same: longest wait for tiles", f"{worst:.0f} ms", "500 ms"))
            rows.append(("the same: memory of the server", f"{memory:.0f} MB", "400 MB"))
    driver.quit()
    table = ["| what | measured | goal |", "| --- | --- | --- |"]
    table += [f"| {a} | {b} | {c} |" for a, b, c in rows]
    write_page(
        "review",
        "The review page",
        [
            *table,
            "",
            f"Medians of {TIMES} drags of two seconds by the mouse; headless Chromium.",
            "",
            *machine(),
        ],
    )
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
