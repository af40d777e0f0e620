"""The review page on a phone, by fingers: the touches that a browser gets from a screen."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from browser import Page, chromium, served
from selenium import webdriver

from geofield.plan import read_plan
from geofield.plan_files import save_plan

pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.xdist_group("review")]

Spot = tuple[float, float]


class Fingers:
    """One or more fingers on the screen."""

    def __init__(self, driver: webdriver.Chrome) -> None:
        self.driver = driver

    def _send(self, kind: str, *spots: Spot) -> None:
        points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(spots)]
        given = {"type": kind, "touchPoints": points}
        self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", given)

    def move(self, *ways: tuple[Spot, Spot], steps: int = 8) -> None:
        """Put each finger down at the first of two spots and lift it at the second."""
        self._send("touchStart", *(start for start, _ in ways))
        for step in range(1, steps + 1):
            share = step / steps
            spots = ((a + (c - a) * share, b + (d - b) * share) for (a, b), (c, d) in ways)
            self._send("touchMove", *spots)
            time.sleep(0.02)
        self._send("touchEnd")
        time.sleep(0.5)

    def pinch(self, x: float, y: float, steps: int = 6) -> None:
        """Put a finger down and move it a little, then a second one, and move them apart."""
        self._send("touchStart", (x, y))
        self._send("touchMove", (x + 12, y))
        time.sleep(0.1)
        self._send("touchStart", (x + 12, y), (x + 50, y))
        for step in range(1, steps + 1):
            self._send("touchMove", (x + 12 - 8 * step, y), (x + 50 + 8 * step, y))
            time.sleep(0.02)
        self._send("touchEnd", (x, y))
        self._send("touchEnd")
        time.sleep(0.5)

    def tap(self, x: float, y: float) -> None:
        """Touch a spot."""
        self._send("touchStart", (x, y))
        self._send("touchEnd")
        time.sleep(0.5)  # a second one would make it a double tap


@pytest.fixture
def page(plan_path: Path) -> Iterator[Page]:
    driver = chromium(390, 844)
    size = {"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    touch = {"enabled": True, "maxTouchPoints": 5}
    driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", touch)
    try:
        with served(plan_path) as (address, _):
            page = Page(driver, address)
            yield page
            assert not page.complaints()
    finally:
        driver.quit()


def test_a_field_is_reviewed_by_fingers(page: Page) -> None:
    fingers = Fingers(page.driver)
    left, top, width, height = page.run(
        "const b = document.getElementById('map').getBoundingClientRect();"
        "return [b.left, b.top, b.width, b.height];"
    )
    x, y = left + width / 2, top + height / 2

    middle, zoom = page.view()
    fingers.move(((x - 20, y), (x - 80, y)), ((x + 20, y), (x + 80, y)))
    assert page.view()[1] < 0.5 * zoom  # two fingers apart: nearer
    fingers.move(((x, y + 50), (x + 60, y + 50)))
    assert page.view()[0][0] < middle[0] - 5  # one finger: the map goes with it

    before = page.state()["obstacles"]
    number, spot = next(
        (row["no"], spot)
        for row in before
        if left + 40 < (spot := page.pixel(*row["centre"]))[0] < left + width - 80
        and top + 60 < spot[1] < top + height - 60
    )
    fingers.tap(*spot)
    chosen = "return document.querySelector('#list [aria-selected=true] b')?.textContent"
    assert page.run(chosen) == str(number)
    page.button("confirm")
    page.wait(lambda: page.obstacle(number)["status"] == "confirmed")

    page.run(f"document.querySelector('#list [data-no=\"{number}\"]').click()")
    time.sleep(0.4)
    spot = page.pixel(*page.obstacle(number)["centre"])
    fingers.move((spot, (spot[0] + 40, spot[1] + 10)))
    was = next(row["centre"] for row in before if row["no"] == number)
    page.wait(lambda: page.obstacle(number)["centre"][0] > was[0] + 2)

    page.run("document.querySelector('[data-tool=circle]').click()")
    fingers.move(((x - 100, y + 80), (x - 80, y + 80)))
    page.wait(lambda: len(page.state()["obstacles"]) == len(before) + 1)


def test_corners_of_the_outline_by_fingers(page: Page) -> None:
    fingers = Fingers(page.driver)
    page.run("document.querySelector('[data-tool=outline]').click()")
    ring = page.state()["field"]["rings"][0]
    at = max(range(len(ring)), key=lambda i: ring[i][0])
    x, y = page.pixel(*ring[at])
    fingers.move(((x, y), (x - 20, y + 5)))
    page.wait(lambda: page.state()["field"]["rings"][0][at] != ring[at])
    moved = page.state()["field"]["rings"][0]
    fingers.tap(*page.pixel(*moved[at]))
    page.run("document.getElementById('remove').click()")
    page.wait(lambda: len(page.state()["field"]["rings"][0]) == len(ring) - 1)
    left = {tuple(corner) for corner in page.state()["field"]["rings"][0]}
    assert tuple(moved[at]) not in left


def test_two_fingers_zoom_whatever_tool_one_of_them_touches(page: Page) -> None:
    """They drew an obstacle, turned the tracks, bent the outline and moved what was chosen."""
    fingers, before = Fingers(page.driver), page.state()
    number = before["obstacles"][10]["no"]
    page.run(f"document.querySelector('#list [data-no=\"{number}\"]').click()")
    page.wait(lambda: page.run("return document.querySelector('#list [aria-selected=true]')"))
    spots = [page.obstacle(number)["centre"]] * 3 + [before["field"]["rings"][0][0]]
    for tool, spot in zip(("select", "circle", "direction", "outline"), spots, strict=True):
        page.run(f"document.querySelector('[data-tool={tool}]').click()")
        if tool == "outline":
            page.driver.execute_async_script(
                "const done = arguments[0]; import('/map.js').then(({sources, view}) =>"
                " done(view.fit(sources.outline.getExtent(), {padding: [60, 60, 60, 60]})));"
            )
        nearer = page.view()[1]
        fingers.pinch(*page.pixel(*spot))
        assert page.view()[1] < 0.8 * nearer, tool
        after = page.state()
        assert not after["can_undo"], tool
        assert after["stamp"] == before["stamp"]
        assert page.text("message") == "", tool  # nor is one told how a circle is drawn
    # One finger does what the tool does again.
    at = page.pixel(*spots[-1])
    fingers.move((at, (at[0] + 30, at[1] + 20)))
    page.wait(lambda: page.state()["field"]["rings"] != before["field"]["rings"])


def test_what_matters_is_seen_on_a_small_screen(page: Page) -> None:
    """A doubtful outline lay below the list, unseen, and the menu was wider than the screen."""
    page.button("more")
    wide, room = page.run(
        "const one = document.getElementById('menu');return [one.scrollWidth, one.clientWidth];"
    )
    assert wide <= room
    first = "return document.querySelector('#panel section').getAttribute('aria-labelledby')"
    assert page.run(first) == "obstacles-h"
    # An outline up to the picture's edges is in doubt.
    page.driver.execute_async_script(
        "const [w, s, e, n] = arguments[0], done = arguments[1];"
        "import('/api.js').then(api => api.edit({do: 'outline',"
        " rings: [[[w - 9, s], [e, s], [e, n], [w - 9, n]]]})).then(done, done);",
        page.state()["bounds"],
    )
    assert page.state()["field"]["doubts"]
    page.driver.refresh()
    page.wait(lambda: page.run("return document.body.dataset.ready"))
    assert page.run(first) == "outline-h"


def test_long_names_leave_room_for_the_field(page: Page, plan_path: Path) -> None:
    """Of 300 letters the field's name took half the screen, and one in a message ran out of it."""
    plan, named = read_plan(plan_path), plan_path.with_name(f"{'x' * 200}.gpkg")
    save_plan(replace(plan, field=replace(plan.field, name="Nord " * 60)), named)
    with served(named) as (address, _):
        again = Page(page.driver, address)
        again.button("next")
        again.button("confirm")
        again.wait(lambda: again.judged() == 1)
        again.button("save")
        again.wait(lambda: "Saved in xxx" in again.text("message"))
        high, wide, room = again.run(
            "const [one, title] = ['message', 'title'].map(id => document.getElementById(id));"
            "return [title.clientHeight, one.scrollWidth, one.clientWidth];"
        )
    assert high < 60
    assert wide <= room


@pytest.mark.parametrize("size", [(390, 844), (360, 640), (640, 360), (900, 420), (768, 1024)])
def test_the_row_that_is_chosen_is_not_below_the_buttons(page: Page, size: tuple[int, int]) -> None:
    """Its number and status lay under the buttons that stay on top of the list.

    On a telephone that lay on its side there was no list at all, and words were cut.
    """
    given = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": True}
    page.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", given)
    page.run("localStorage.setItem('language', 'de')")
    page.driver.refresh()
    page.wait(lambda: page.run("return document.body.dataset.ready"))
    cut = page.run(
        "return [...document.querySelectorAll('#tools button, #panel')].filter(one =>"
        " one.scrollWidth > one.clientWidth"
        " || one.id !== 'panel' && one.scrollHeight > one.clientHeight)"
        ".map(one => one.id || one.textContent);"
    )
    assert cut == []
    for _ in range(3):
        # Who read on below comes back by a key, or by the buttons, which stay in view.
        page.run("document.getElementById('panel').scrollTop = 1e6")
        page.press("j")
        time.sleep(0.3)
        below, top, panel, bottom = page.run(
            "const box = query => document.querySelector(query).getBoundingClientRect();"
            "const row = box('#list [aria-selected=true]');"
            "return [box('#verdict').bottom, row.top, box('#panel').bottom, row.bottom];"
        )
        assert below - 1 <= top
        assert bottom <= panel + 1


@pytest.mark.parametrize("size", [(390, 844), (320, 256), (320, 568), (640, 360)])
def test_nothing_lies_over_another_part_and_a_touch_moves_none(
    page: Page, size: tuple[int, int]
) -> None:
    """The line below grew a second row at the first touch, and lay over the tools at 320 x 256."""
    given = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": True}
    page.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", given)
    page.driver.refresh()
    page.wait(lambda: page.run("return document.body.dataset.ready"))
    time.sleep(0.3)
    boxes = (
        "return ['header', '#tools', '#map', '#panel', 'footer'].map(query => {"
        " const box = document.querySelector(query).getBoundingClientRect();"
        " return [box.left, box.top, box.right, box.bottom]; });"
    )
    page.run("document.getElementById('map').scrollIntoView()")
    parts = page.run(boxes)
    for number, (left, top, right, bottom) in enumerate(parts):
        assert bottom - top > 20
        for other in parts[number + 1 :]:
            assert left >= other[2] or other[0] >= right or top >= other[3] or other[1] >= bottom
    left, top, right, bottom = parts[2]
    assert bottom - top > 140
    x, y = (left + right) / 2, (top + bottom) / 2
    Fingers(page.driver).move(((x, y), (x + 20, y + 20)))
    assert page.text("place")
    assert page.run(boxes) == parts


def test_what_stays_until_it_is_answered_covers_no_button(page: Page, plan_path: Path) -> None:
    """Below the words about another program nothing could be confirmed any more."""
    size = {"width": 360, "height": 740, "deviceScaleFactor": 2, "mobile": True}
    page.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    page.button("next")
    page.button("confirm")
    page.wait(lambda: page.judged() == 1)
    with closing(sqlite3.connect(plan_path)) as file, file:
        file.execute("UPDATE gpkg_contents SET description = 'edited' WHERE table_name = 'field'")
    page.button("save")
    page.wait(lambda: "Another program changed" in page.text("message"))
    page.button("confirm")
    page.wait(lambda: page.judged() == 2)
    confirmed = [one for one in page.state()["obstacles"] if one["status"] == "confirmed"]
    assert len(confirmed) == 2
