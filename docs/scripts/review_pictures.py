"""Draw the pictures of the review page in a real browser (python docs/scripts/review_pictures.py).

Needs Chromium and its driver (Debian: chromium chromium-driver).
"""

from __future__ import annotations

import io
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
SAMPLE = ROOT / "sample_data" / "field_1.tif"
SIZES = {"review_page": (1280, 800, "light"), "review_page_phone": (390, 844, "dark")}


def main() -> None:
    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1280,860"):
        options.add_argument(flag)
    with tempfile.TemporaryDirectory() as folder:
        place = ["--lat", "35.075373", "--lon", "33.531142", "--spacing", "4"]
        command = [sys.executable, "-m", "geofield"]
        run = [*command, "run", str(SAMPLE), *place, "--format", "gpkg", "--out", folder]
        subprocess.run(run, check=True)
        for name, (width, height, scheme) in SIZES.items():
            review = [*command, "review", f"{folder}/field.gpkg", "--no-browser"]
            served = subprocess.Popen(review, stdout=subprocess.PIPE, text=True)
            address = next(iter(served.stdout or ())).strip()
            driver = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
            size = {"width": width, "height": height, "deviceScaleFactor": 1}
            driver.execute_cdp_cmd(
                "Emulation.setDeviceMetricsOverride", {**size, "mobile": width < 500}
            )
            driver.execute_cdp_cmd(
                "Emulation.setEmulatedMedia",
                {"features": [{"name": "prefers-color-scheme", "value": scheme}]},
            )
            driver.get(address)
            while not driver.execute_script("return document.body.dataset.ready"):
                time.sleep(0.1)
            for key in "jcrc":
                ActionChains(driver).send_keys(key).perform()
                time.sleep(0.7)
            time.sleep(1.5)
            picture = Image.open(io.BytesIO(driver.get_screenshot_as_png())).convert("RGB")
            picture.save(IMAGES / f"{name}.jpg", quality=82, optimize=True)
            driver.quit()
            served.send_signal(signal.SIGINT)
            served.wait(20)
            Path(folder, "field.gpkg.review.jsonl").unlink(missing_ok=True)


if __name__ == "__main__":
    main()
