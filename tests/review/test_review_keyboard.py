"""A whole review without a pointer: all is reached by Tab, seen where it is, and heard."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import geopandas as gpd
import pytest
from browser import Page, chromium, served
from selenium.webdriver.common.keys import Keys
from shapely import Polygon

from geofield.plan import read_plan

pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.xdist_group("review")]

_FOCUS = (
    "const one = document.activeElement, style = getComputedStyle(one),"
    " box = one.getBoundingClientRect();"
    "const over = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);"
    "return [one === document.body ? '' : one.id || one.name || one.dataset.tool || one.dataset.no"
    " || one.className || one.textContent,"
    " style.outlineStyle === 'none' ? 0 : parseFloat(style.outlineWidth),"
    " one === over || one.contains(over) || over?.contains(one)];"
)


class Hands:
    """Keys on the page of a session, and the ear of who cannot see it."""

    def __init__(self, page: Page, process: subprocess.Popen[str]) -> None:
        self.page, self.process = page, process

    def tab_to(self, name: str, *held: str) -> list[str]:
        """Press Tab until an element has the focus; what had it on the way."""
        passed: list[str] = []
        while not passed or passed[-1] != name:
            assert len(passed) < 90, f"{name} is not reached: {passed}"
            self.page.chord(*held, Keys.TAB)
            found, wide, uncovered = self.page.run(_FOCUS)
            passed.append(found)
            if found:
                assert wide >= 2, f"the focus on {found} is not seen"
                assert uncovered, f"{found} has the focus below something else"
        return passed

    def press_on(self, name: str) -> None:
        """Tab to a button and press it."""
        self.tab_to(name)
        self.page.press(Keys.ENTER)

    def stays_on(self, name: str) -> None:
        """That a button that does nothing any more says so, and still has the focus."""
        dead = f"return document.getElementById('{name}').ariaDisabled"
        self.page.wait(lambda: self.page.run(dead) == "true")
        # Chromium takes the focus from what is disabled when it draws next.
        self.page.run("return new Promise(done => requestAnimationFrame(() => setTimeout(done)))")
        assert self.page.run(_FOCUS)[0] == name

    def heard(self, words: str) -> None:
        """Wait until what is told to who hears the page has these words."""
        told = "return ['spoken', 'message'].map(id => document.getElementById(id).textContent)"
        self.page.wait(lambda: any(words in one for one in self.page.run(told)))

    def end(self) -> None:
        """End the session."""
        assert not self.page.complaints()
        self.press_on("more")
        self.press_on("stop")
        self.heard("The session has ended")
        assert self.process.wait(10) == 0


@pytest.fixture
def folder(plan_path: Path) -> Path:
    """Two plans."""
    (plan_path.parent / "second").mkdir()
    for name in ("field.gpkg", "scene.tif"):
        shutil.copy(plan_path.parent / name, plan_path.parent / "second" / name)
    return plan_path.parent


@pytest.fixture
def hands(folder: Path) -> Iterator[Hands]:
    driver = chromium()
    try:
        with served(folder) as (address, process):
            yield Hands(Page(driver, address), process)
    finally:
        driver.quit()


def test_a_whole_review_by_keys_alone(hands: Hands, folder: Path) -> None:
    page = hands.page
    before = page.state()
    corners = before["field"]["rings"][0]

    order = hands.tab_to("")  # around the whole page, once
    assert order.index("plans") < order.index("more") < order.index("select") < order.index("map")
    assert order.index("map") < order.index("next") < order.index("spacing_m")
    assert sum(name.isdigit() for name in order) == 1  # all obstacles are one stop

    # Every obstacle has a word.
    hands.press_on("next")
    hands.heard("Obstacle ")
    hands.press_on("confirm")
    hands.heard(": confirmed. Obstacle ")
    for done in range(1, len(before["obstacles"])):
        page.press("r")
        page.wait(lambda done=done: page.judged() == done + 1)
    hands.heard(": rejected")

    # A circle where the map is looked at, moved, made larger.
    hands.tab_to("circle", Keys.SHIFT)
    page.press(Keys.SPACE)
    hands.tab_to("map")
    page.press(Keys.ENTER)
    number = len(before["obstacles"]) + 1
    hands.heard(f"Obstacle {number}: added by hand")
    first = page.obstacle(number)
    page.press(Keys.ARROW_RIGHT, "]")
    page.wait(lambda: page.obstacle(number)["radius_m"] > first["radius_m"])
    assert page.obstacle(number)["centre"][0] == pytest.approx(first["centre"][0] + 0.5, abs=0.01)

    # The outline: from corner to corner, one moved, one added and taken away again.
    page.press("o", "j")
    hands.heard(f"Corner 1 of {len(corners)}")
    page.press("k")
    hands.heard(f"Corner {len(corners)} of {len(corners)}")
    x, y = corners[-1]
    to_middle = Keys.ARROW_LEFT if x > first["centre"][0] else Keys.ARROW_RIGHT
    page.press(to_middle, to_middle)
    page.wait(
        lambda: abs(page.state()["field"]["rings"][0][-1][0] - x) == pytest.approx(1, abs=0.01)
    )
    assert page.state()["field"]["rings"][0][:-1] == corners[:-1]
    page.chord(Keys.SHIFT, Keys.ARROW_UP)
    page.wait(lambda: abs(page.state()["field"]["rings"][0][-1][1] - y) < 0.11)
    page.press(Keys.ENTER)  # a corner in the middle of the map
    page.wait(lambda: len(page.state()["field"]["rings"][0]) == len(corners) + 1)
    page.press(Keys.DELETE)
    page.wait(lambda: len(page.state()["field"]["rings"][0]) == len(corners))
    assert page.obstacle(number)["centre"] == pytest.approx(
        [first["centre"][0] + 0.5, first["centre"][1]], abs=0.01
    )

    # Tracks turn to a line of two places, and to a heading.
    page.press(Keys.ESCAPE)
    hands.tab_to("direction", Keys.SHIFT)
    page.press(Keys.ENTER)
    hands.tab_to("map")
    page.press(Keys.ENTER, *[Keys.ARROW_RIGHT] * 3)
    page.run("return new Promise(done => setTimeout(done, 400))")  # the map glides
    page.press(Keys.ENTER)
    page.wait(lambda: page.state()["figures"]["heading_deg"] == pytest.approx(90, abs=1))
    hands.tab_to("spacing_m")
    hands.tab_to("direction")
    page.chord(Keys.CONTROL, "a")
    page.press("45", Keys.ENTER)
    page.wait(lambda: page.state()["figures"]["heading_deg"] == pytest.approx(45, abs=0.1))
    hands.heard(" tracks · ")

    hands.press_on("undo")
    hands.heard("Undone")
    page.wait(lambda: page.state()["figures"]["heading_deg"] == pytest.approx(90, abs=1))
    hands.press_on("redo")
    hands.heard("Redone")
    page.wait(lambda: page.state()["figures"]["heading_deg"] == pytest.approx(45, abs=0.1))
    hands.stays_on("redo")

    hands.press_on("save")
    hands.heard("Saved in field.gpkg")
    hands.stays_on("save")
    saved = (folder / "field.gpkg").stat().st_mtime_ns
    page.press(Keys.ENTER)  # it does nothing now
    hands.stays_on("save")
    page.chord(Keys.SHIFT, Keys.TAB)
    assert page.run(_FOCUS)[0] == "redo"
    assert (folder / "field.gpkg").stat().st_mtime_ns == saved
    hands.press_on("more")
    hands.tab_to("export-format")
    page.press("ES")
    hands.press_on("export")
    hands.heard("Written: ")
    page.press(Keys.ESCAPE)
    assert page.run(_FOCUS)[0] == "more"  # where it was before the dialog

    page.run("document.body.dataset.ready = ''")
    hands.press_on("onward")
    page.wait(lambda: page.run("return document.body.dataset.ready") == "yes")
    assert page.judged() == 0
    hands.end()

    after = read_plan(folder / "field.gpkg")
    assert after.obstacles is not None
    assert sorted(after.obstacles["status"]) == [
        "added", "confirmed", *["rejected"] * (len(before["obstacles"]) - 1)
    ]  # fmt: skip
    assert not Polygon(corners).equals(after.field.polygon)
    assert after.tracks is not None
    (lines,) = (folder / "export").rglob("guidance.shp")
    assert len(gpd.read_file(lines)) == len(after.tracks.segments)


def test_the_list_is_gone_through_by_arrow_keys(hands: Hands) -> None:
    page = hands.page
    listed = page.run(
        "return [...document.querySelectorAll('#list [role=option]')].map(one => one.dataset.no)"
    )
    chosen = (
        "return [...document.querySelectorAll('#list [aria-selected=true]')]"
        ".map(one => one.dataset.no)"
    )
    hands.tab_to(listed[0])
    assert page.run(chosen) == []  # to come by chooses nothing
    before = page.state()["obstacles"]
    for key, place in (
        (Keys.ARROW_DOWN, 1), (Keys.END, -1), (Keys.ARROW_DOWN, -1), (Keys.ARROW_UP, -2),
        (Keys.HOME, 0), (Keys.ARROW_UP, 0), (Keys.PAGE_DOWN, 5), (Keys.ARROW_RIGHT, 5), ("j", 6),
    ):  # fmt: skip
        page.press(key)
        page.wait(lambda place=place: page.run(chosen) == [listed[place]])
        assert page.run(_FOCUS) == [listed[place], 3, True], key
    assert page.state()["obstacles"] == before  # none was moved
    tree = page.driver.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
    rows = [one for one in tree if one["role"]["value"] == "option" and one["name"]["value"]]
    obstacles = [one for one in rows if one["name"]["value"].startswith(f"{listed[6]} detected ")]
    assert len(obstacles) == 1, [one["name"]["value"] for one in rows]

    # A word goes on to the next row, and Tab leaves the list, and comes back to the chosen one.
    page.press("r")
    page.wait(lambda: page.run(chosen) == [listed[7]])
    assert page.run(_FOCUS)[0] == listed[7]
    page.chord(Keys.SHIFT, Keys.TAB)
    assert page.run(_FOCUS)[0] == "reject"
    hands.tab_to(listed[7])
    # From the list to the map, where the arrow keys move the obstacle.
    page.press("m", Keys.ARROW_RIGHT)
    at = next(one["centre"] for one in before if str(one["no"]) == listed[7])
    page.wait(
        lambda: page.obstacle(int(listed[7]))["centre"][0] == pytest.approx(at[0] + 0.5, abs=0.01)
    )
    hands.end()


def test_shapes_ground_and_lengths_by_keys(hands: Hands) -> None:
    page = hands.page

    def glide(*keys: str) -> None:
        page.press(*keys)
        page.run("return new Promise(done => setTimeout(done, 400))")

    hands.tab_to("polygon")
    page.press(Keys.SPACE)
    hands.tab_to("map")
    known = len(page.state()["obstacles"])
    page.press(Keys.ENTER)
    hands.heard("Corner 1 of 1")
    glide(Keys.ARROW_RIGHT)
    page.press(Keys.ENTER)
    glide(Keys.ARROW_UP)
    page.press(Keys.ENTER)
    hands.heard("Corner 3 of 3")
    page.press(Keys.ENTER)  # the last one twice ends it
    page.wait(lambda: len(page.state()["obstacles"]) == known + 1)
    (shape,) = page.obstacle(known + 1)["rings"]
    assert len(shape) == 3

    hands.tab_to("measure", Keys.SHIFT)
    page.press(Keys.SPACE)
    hands.tab_to("map")
    page.press(Keys.ENTER)
    glide(Keys.ARROW_RIGHT)
    page.press(Keys.ENTER, Keys.ENTER)
    page.wait(lambda: page.text("measure").endswith(" m"))
    assert float(page.text("measure")[:-2].replace(",", "")) == pytest.approx(
        128 * page.view()[1], rel=0.02
    )

    # Letters can be switched off; the map is worked by the other keys.
    page.press("?")
    hands.tab_to("keys-on")
    page.press(Keys.SPACE, Keys.ESCAPE)
    page.press("c", "g")
    before = page.state()
    ring = before["field"]["rings"][0]
    beside = [sum(x for x, _ in ring) / len(ring) + 60, max(y for _, y in ring) + 3]
    page.run("return import('/map.js').then(({view}) => view.setCenter(arguments[0]))", beside)
    hands.tab_to("ground", Keys.SHIFT)
    page.press(Keys.SPACE)
    hands.tab_to("map")
    page.press(Keys.ENTER)
    page.wait(lambda: page.state()["figures"]["area_ha"] > before["figures"]["area_ha"] + 0.05)
    assert {each["status"] for each in page.state()["obstacles"]} == {"detected", "added"}
    hands.end()
