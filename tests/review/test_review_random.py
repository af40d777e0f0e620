"""The review page used at random: what it shows is what the server has, whatever was done."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest
from browser import Page, chromium, served
from selenium import webdriver
from selenium.webdriver.common.keys import Keys

pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.xdist_group("review")]

#: What the map and the list show, in the words of the server's state.
SHOWN = """
const done = arguments[0], each = row => row.split(' ')[0];
import('/map.js').then(({sources}) => {
  const drawn = name => sources[name].getFeatures(), id = name => document.getElementById(name);
  const open = rings => rings.map(ring => ring.slice(0, -1));
  const shape = one => open(one.getGeometry().getCoordinates());
  done({
    obstacles: drawn('obstacles').map(one => [one.getId(), one.get('status'), shape(one)]),
    listed: [...document.querySelectorAll('#list li')].map(one => Number(one.dataset.no)),
    outline: drawn('outline').map(shape)[0],
    tracks: drawn('tracks').map(one => [one.get('no'), one.getGeometry().getCoordinates()]),
    notes: id('notes').childElementCount,
    undo: id('undo').ariaDisabled === 'false', redo: id('redo').ariaDisabled === 'false',
  });
});
"""
RESTS = "return !document.body.matches('.busy') && performance.now() - (window.heard ?? 0) > 250"
#: Tells when the last answer came.
LISTEN = """
const real = window.fetch;
let flying = 0;
window.fetch = (...given) => {
  flying++;
  window.heard = Infinity;
  return real(...given).finally(() => { if (!--flying) window.heard = performance.now(); });
};
"""
KEYS = [*"jjkccru[]", Keys.ARROW_LEFT, Keys.DELETE, Keys.ESCAPE]
TOOLS = ["select", "select", "circle", "outline", "direction", "notground", "polygon", "measure"]


class Hand:
    """A person who knows no better."""

    def __init__(self, page: Page, seed: int) -> None:
        self.page, self.random = page, random.Random(seed)

    def _mouse(self, kind: str, spot: tuple[float, float], held: int) -> None:
        at = {"type": kind, "x": spot[0], "y": spot[1], "button": "left", "buttons": held}
        self.page.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {**at, "clickCount": 1})

    def drag(self) -> None:
        """From a tree or a corner to wherever, or not so far; keys are pressed meanwhile."""
        state, any_of = self.page.state(), self.random.choice
        chosen = "return document.querySelector('#list [aria-selected=true]')?.dataset.no"
        number = self.page.run(chosen)
        places = [any_of(state["field"]["rings"][0])]
        places += [one["centre"] for one in state["obstacles"] if str(one["no"]) == number] * 3
        x, y = self.page.pixel(*any_of(places))
        self._mouse("mouseMoved", (x, y), 0)
        self._mouse("mousePressed", (x, y), 1)
        for _ in range(self.random.randint(0, 3)):
            x, y = x + self.random.randint(-40, 40), y + self.random.randint(-40, 40)
            self._mouse("mouseMoved", (x, y), 1)
            if self.random.random() < 0.3:
                self.keys()
        self._mouse("mouseReleased", (x, y), 0)

    def keys(self) -> None:
        self.page.press(*self.random.choices(KEYS, k=self.random.randint(1, 3)))

    def tool(self) -> None:
        name = self.random.choice(TOOLS)
        self.page.run(f"document.querySelector('[data-tool={name}]').click()")

    def back(self) -> None:
        self.page.chord(*self.random.choice([(Keys.CONTROL, "z"), (Keys.CONTROL, Keys.SHIFT, "z")]))

    def act(self) -> None:
        acts = [self.drag, self.keys, self.tool, self.back]
        self.random.choices(acts, [5, 4, 2, 1])[0]()


def rests(page: Page) -> None:
    page.wait(lambda: page.run(RESTS))


def again(page: Page) -> None:
    """Redo all that was undone."""
    while page.state()["can_redo"]:
        page.chord(Keys.CONTROL, Keys.SHIFT, "z")
        rests(page)


def shown_as_it_is(page: Page) -> dict[str, Any]:
    """The server's state, when the page shows it."""
    rests(page)
    state, shown = page.state(), page.driver.execute_async_script(SHOWN)
    rows = state["obstacles"]
    assert sorted(shown["obstacles"]) == [[one["no"], one["status"], one["rings"]] for one in rows]
    assert sorted(shown["listed"]) == [one["no"] for one in rows]
    assert shown["outline"] == state["field"]["rings"]
    assert sorted(shown["tracks"]) == sorted(state["tracks"])
    assert shown["notes"] == len(set(state["notes"]))
    assert (shown["undo"], shown["redo"]) == (state["can_undo"], state["can_redo"])
    return {name: state[name] for name in ("obstacles", "field", "settings", "tracks", "notes")}


@pytest.fixture
def driver() -> Any:
    one = chromium()
    yield one
    one.quit()


@pytest.mark.parametrize("seed", [5])
def test_the_page_shows_what_the_server_has_whatever_is_done(
    driver: webdriver.Chrome, plan_path: Path, seed: int
) -> None:
    driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": LISTEN})
    with served(plan_path) as (address, _):
        page = Page(driver, address)
        hand, first = Hand(page, seed), shown_as_it_is(page)
        for _ in range(20):
            hand.act()
            shown_as_it_is(page)
        page.press(Keys.ESCAPE)
        again(page)
        last = shown_as_it_is(page)
        driver.refresh()
        page.wait(lambda: page.run("return document.body.dataset.ready"))
        assert shown_as_it_is(page) == last
        while page.state()["can_undo"]:
            page.chord(Keys.CONTROL, "z")
            rests(page)
        assert shown_as_it_is(page) == first
        again(page)
        assert shown_as_it_is(page) == last
        assert not page.complaints()
