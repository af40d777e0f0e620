"""A real browser on the page of a real `geofield review`, used as a person would."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from geofield_command import asking


@contextmanager
def served(
    plan_path: Path, *options: str, program: Sequence[str] = ()
) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """The address that the command prints, and its process.

    `program` is the command; one whose libraries are loaded when not given.
    """
    command = [*(program or asking()), "review", str(plan_path), "--no-browser"]
    process = subprocess.Popen(
        [*command, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        yield process.stdout.readline().strip(), process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)


def chromium(width: int = 1280, height: int = 860, *more: str) -> webdriver.Chrome:
    """A headless Chromium of Debian; the test is skipped where there is none."""
    binary, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not binary or not driver:
        pytest.skip("Chromium and its driver are not installed")
    options = webdriver.ChromeOptions()
    options.binary_location = binary
    for flag in (
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        "--no-first-run",
        "--disable-background-networking",
        "--lang=en",
        "--force-device-scale-factor=1",
        f"--window-size={width},{height}",
        *more,
    ):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(options=options, service=Service(driver))


class Page:
    """What a person does on the page."""

    def __init__(self, driver: webdriver.Chrome, address: str) -> None:
        self.driver = driver
        driver.get_log("browser")  # what earlier pages said is theirs
        driver.get(address)
        self.wait(lambda: self.run("return document.body.dataset.ready"))
        time.sleep(0.3)

    def wait(self, condition: Any, seconds: float = 20.0) -> Any:
        """Until a condition holds; what the page draws anew meanwhile is asked again."""
        waiting = WebDriverWait(
            self.driver,
            seconds,
            poll_frequency=0.05,
            ignored_exceptions=[StaleElementReferenceException],
        )
        return waiting.until(lambda _: condition())

    def run(self, script: str, *given: Any) -> Any:
        """Run a script in the page."""
        return self.driver.execute_script(script, *given)

    def state(self) -> dict[str, Any]:
        """The session as the server tells it."""
        value: dict[str, Any] = self.driver.execute_async_script(
            "const done = arguments[0];"
            "fetch('/api/state').then(answer => answer.json()).then(done);"
        )
        return value

    def obstacle(self, number: int) -> dict[str, Any]:
        """A row of the session."""
        return next(row for row in self.state()["obstacles"] if row["no"] == number)

    def judged(self) -> int:
        """How many obstacles have a person's word, as the page says it."""
        waiting, total = re.findall(r"[0-9]+", self.text("left"))
        return int(total) - int(waiting)

    def pixel(self, x: float, y: float) -> tuple[int, int]:
        """Where a place of the plan lies in the window."""
        found = self.driver.execute_async_script(
            "const done = arguments[2], place = [arguments[0], arguments[1]];"
            "import('/map.js').then(({map}) => { map.renderSync();"
            " const box = map.getTargetElement().getBoundingClientRect();"
            " const [x, y] = map.getPixelFromCoordinate(place);"
            " done([Math.round(box.left + x), Math.round(box.top + y)]); });",
            x,
            y,
        )
        return int(found[0]), int(found[1])

    def view(self) -> tuple[list[float], float]:
        """The middle of the map, a place of the plan, and metres per pixel."""
        found = self.driver.execute_async_script(
            "const done = arguments[0]; import('/map.js').then(({view}) =>"
            " done([view.getCenter(), view.getResolution()]));"
        )
        return found[0], found[1]

    def drag(
        self,
        start: tuple[float, float],
        end: tuple[float, float],
        steps: int = 6,
        *,
        back: bool = False,
    ) -> None:
        """Press at one place of the plan, move, and let go at another, or back at the first."""
        (x0, y0), (x1, y1) = self.pixel(*start), self.pixel(*end)
        action = ActionChains(self.driver, duration=30)
        action.w3c_actions.pointer_action.move_to_location(x0, y0)
        action.w3c_actions.pointer_action.pointer_down()
        for step in range(1, steps + 1):
            action.w3c_actions.pointer_action.move_to_location(
                round(x0 + (x1 - x0) * step / steps), round(y0 + (y1 - y0) * step / steps)
            )
        if back:
            action.w3c_actions.pointer_action.move_to_location(x0, y0)
        action.w3c_actions.pointer_action.pointer_up()
        action.perform()

    def click(self, x: float, y: float) -> None:
        """Click at a place of the plan."""
        column, row = self.pixel(x, y)
        action = ActionChains(self.driver, duration=20)
        action.w3c_actions.pointer_action.move_to_location(column, row)
        action.w3c_actions.pointer_action.click()
        action.perform()
        time.sleep(0.35)  # a second click would make it a double click

    def press(self, *keys: str) -> None:
        """Type keys, one after the other."""
        for key in keys:
            ActionChains(self.driver).send_keys(key).perform()

    def chord(self, *keys: str) -> None:
        """Keys held together."""
        action = ActionChains(self.driver)
        for key in keys[:-1]:
            action.key_down(key)
        action.send_keys(keys[-1])
        for key in keys[:-1]:
            action.key_up(key)
        action.perform()

    def button(self, name: str) -> None:
        """Press a button by its id."""
        self.driver.find_element(By.ID, name).click()

    def text(self, name: str) -> str:
        """The words of an element by its id."""
        return self.driver.find_element(By.ID, name).text

    def complaints(self) -> list[str]:
        """What the browser complained of: scripts that failed, rules that were broken.

        Refusals in words (status 4xx) are wanted, and so is the question before leaving.
        """
        wanted = ("status of 4", "confirmation panel")
        return [
            entry["message"]
            for entry in self.driver.get_log("browser")
            if entry["level"] == "SEVERE" and not any(each in entry["message"] for each in wanted)
        ]
