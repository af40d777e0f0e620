"""The review page in a real browser: clicked, dragged and typed as a person would."""

from __future__ import annotations

import contextlib
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import cast, get_args

import geopandas as gpd
import pytest
import shapely
from axe_core_python.selenium import Axe
from browser import Page, chromium, served
from selenium import webdriver
from selenium.common.exceptions import NoAlertPresentException
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from shapely import Polygon

from geofield.errors import TrackWarning
from geofield.model.evidence import Evidence
from geofield.plan import read_plan
from geofield.plan_files import save_plan
from geofield.review import Session
from geofield.settings import DirectionName
from geofield_command import run_geofield
from told_notes import notes_of_tracks

GEOFIELD = str(Path(sys.executable).with_name("geofield"))
pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.xdist_group("review")]


@pytest.fixture(scope="module")
def driver() -> Iterator[webdriver.Chrome]:
    one = chromium()
    yield one
    one.quit()


@pytest.fixture
def page(driver: webdriver.Chrome, plan_path: Path) -> Iterator[Page]:
    with served(plan_path) as (address, _):
        page = Page(driver, address)
        yield page
        complaints = page.complaints()
        page.run("window.onbeforeunload = null")
        driver.get("about:blank")
        with contextlib.suppress(NoAlertPresentException):
            driver.switch_to.alert.accept()
    assert not complaints


def test_obstacles_reviewed_by_keys_and_saved(page: Page, plan_path: Path) -> None:
    page.press("j", "c")  # the most doubtful is confirmed, the next one chosen
    page.wait(lambda: page.judged() == 1)
    page.press("r")
    page.wait(lambda: page.judged() == 2)
    page.press("]")
    page.wait(lambda: page.judged() == 3)
    rows = page.state()["obstacles"]
    confirmed = [row for row in rows if row["status"] == "confirmed"]
    rejected = [row for row in rows if row["status"] == "rejected"]
    assert (len(confirmed), len(rejected)) == (2, 1)
    page.chord(Keys.CONTROL, "s")
    page.wait(lambda: "Saved in field.gpkg" in page.text("message"))
    saved = read_plan(plan_path)
    assert saved.obstacles is not None
    by_number = saved.obstacles.set_index("obstacle_no")
    for row in rows:
        assert by_number.loc[row["no"], "status"] == row["status"]
        assert by_number.loc[row["no"], "radius_m"] == pytest.approx(row["radius_m"], abs=1e-4)
    page.chord(Keys.CONTROL, "z")
    page.wait(lambda: page.judged() == 2)


def test_what_is_saved_equals_the_same_edits_made_in_python(page: Page, plan_path: Path) -> None:
    before = read_plan(plan_path)
    page.press("j", "r", "j", "c")
    page.wait(lambda: page.state()["can_undo"] and page.judged() == 2)
    rows = page.state()["obstacles"]
    page.button("save")
    page.wait(lambda: "Saved" in page.text("message"))
    session = Session(before)
    for row in rows:
        if row["status"] != "detected":
            session.do({"do": "status", "no": row["no"], "status": row["status"]})
    assert read_plan(plan_path) == session.plan


def test_drawing_moving_and_resizing_with_the_pointer(page: Page) -> None:
    before = page.state()
    field, known = before["field"], len(before["obstacles"])
    number = known + 1
    x = sum(place[0] for place in field["rings"][0]) / len(field["rings"][0])
    y = sum(place[1] for place in field["rings"][0]) / len(field["rings"][0])
    page.press("a")
    page.drag((x, y), (x + 6, y))
    page.wait(lambda: len(page.state()["obstacles"]) == number)
    added = page.obstacle(number)
    assert added["status"] == "added"
    assert added["radius_m"] == pytest.approx(6.0, abs=0.6)
    assert added["centre"] == pytest.approx([x, y], abs=0.6)
    # Tracks keep away from it as soon as it is there.
    for _, ((x0, y0), (x1, y1)) in page.state()["tracks"]:
        away = (
            abs((y1 - y0) * (x - x0) - (x1 - x0) * (y - y0))
            / ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
        )
        between = min(y0, y1) < y < max(y0, y1)
        assert away > 5.9 or not between
    page.press(Keys.ESCAPE)
    page.click(*added["centre"])
    page.wait(
        lambda: (
            page.run("return document.querySelector('#list [aria-selected=true] b').textContent")
            == str(number)
        )
    )
    page.press("k", "j")
    page.run(f"document.querySelector('#list [data-no=\"{number}\"]').click()")
    time.sleep(0.3)
    page.drag(tuple(added["centre"]), (x + 20, y - 10))
    page.wait(lambda: page.obstacle(number)["centre"][0] > x + 15)
    moved = page.obstacle(number)
    assert moved["centre"] == pytest.approx([x + 20, y - 10], abs=0.8)
    assert moved["radius_m"] == added["radius_m"]
    edge = moved["radius_m"] + moved["buffer_m"]
    cx, cy = moved["centre"]
    page.drag((cx + edge, cy), (cx + edge + 4, cy))
    page.wait(lambda: page.obstacle(number)["radius_m"] > 8)
    assert page.obstacle(number)["radius_m"] == pytest.approx(added["radius_m"] + 4, abs=0.8)
    page.press(Keys.ARROW_LEFT)
    page.wait(lambda: page.obstacle(number)["centre"][0] < cx - 0.3)
    assert page.obstacle(number)["centre"] == pytest.approx([cx - 0.5, cy], abs=0.01)
    page.press(Keys.DELETE)
    page.wait(lambda: len(page.state()["obstacles"]) == known)
    for _ in range(5):
        page.chord(Keys.CONTROL, "z")
    page.wait(lambda: not page.state()["can_undo"])
    page.chord(Keys.CONTROL, Keys.SHIFT, "z")
    page.wait(lambda: len(page.state()["obstacles"]) == number)


def test_a_click_draws_no_circle_and_tells_how_it_is_done(page: Page) -> None:
    before = page.state()
    x, y = before["obstacles"][0]["centre"]
    page.press("a")
    page.click(x, y)
    page.wait(lambda: "press at its middle and drag" in page.text("message"))
    page.press(Keys.ESCAPE, "a")
    page.drag((x, y), (x + 20, y), back=True)
    time.sleep(0.3)
    page.run("document.querySelector('[data-tool=direction]').click()")  # a click told nothing
    page.click(x, y)
    page.wait(lambda: "Turn the tracks: press and drag" in page.text("message"))
    after = page.state()
    assert (after["obstacles"], after["can_undo"]) == (before["obstacles"], False)


def test_what_is_done_is_spoken_and_done_without_a_pointer(page: Page) -> None:
    known = len(page.state()["obstacles"])

    def spoken() -> str:
        return str(page.run("return document.getElementById('spoken').textContent"))

    page.chord(Keys.CONTROL, "z")
    time.sleep(0.5)
    assert spoken() == ""  # there was nothing to undo
    page.press("j")
    page.wait(lambda: spoken().startswith("Obstacle"))
    first = int(
        page.run("return document.querySelector('#list [aria-selected=true] b').textContent")
    )
    page.press("c")
    # The word that was given, then the next one that waits for a word.
    page.wait(lambda: spoken().startswith(f"Obstacle {first}: confirmed. Obstacle "))
    page.chord(Keys.CONTROL, "z")
    page.wait(lambda: spoken().startswith(f"Undone. Obstacle {first}: "))
    page.chord(Keys.CONTROL, Keys.SHIFT, "z")
    page.wait(lambda: spoken() == f"Redone. Obstacle {first}: confirmed")
    page.press("a")
    page.wait(lambda: spoken() == "Add circle")
    page.run("document.getElementById('map').focus()")
    page.press(Keys.ENTER)
    page.wait(lambda: len(page.state()["obstacles"]) == known + 1)
    page.wait(lambda: spoken().startswith(f"Obstacle {known + 1}: added by hand"))
    page.press(Keys.DELETE)
    page.wait(lambda: spoken() == f"Obstacle {known + 1}: deleted")
    assert len(page.state()["obstacles"]) == known
    assert page.obstacle(first)["status"] == "confirmed"


def test_the_outline_is_edited_and_tracks_turn(page: Page) -> None:
    before = page.state()
    offered = page.run(
        "return [...document.querySelectorAll('#directions option')].map(one => one.value)"
    )
    assert offered == list(get_args(DirectionName))
    corner = max(before["field"]["rings"][0], key=lambda place: place[0])
    page.press("o")
    page.drag(tuple(corner), (corner[0] - 15, corner[1]))
    page.wait(lambda: page.state()["figures"]["area_ha"] < before["figures"]["area_ha"] - 0.05)
    after = page.state()
    assert after["field"]["method"] == "drawn"
    assert after["field"]["certainty"] is None
    assert "Drawn by a person" in page.text("certainty")
    page.driver.find_element(By.CSS_SELECTOR, "[data-tool=direction]").click()
    x, y = after["obstacles"][7]["centre"]
    page.drag((x - 20, y + 20), (x + 30, y - 30))
    page.wait(lambda: abs(page.state()["figures"]["heading_deg"] - 135) < 4)


def test_the_map_moves_with_the_mouse_whatever_has_the_focus(page: Page) -> None:
    page.run("document.querySelector('#list [data-no=\"8\"]').click()")
    time.sleep(0.3)
    before, zoom = page.view()
    x, y = before
    page.drag((x + 12, y + 14), (x + 30, y + 14))
    page.wait(lambda: page.view()[0][0] < x - 10)
    assert page.view()[1] == zoom


def test_corners_are_added_and_taken_away(page: Page) -> None:
    page.press("o")
    ring = page.state()["field"]["rings"][0]
    (x0, y0), (x1, y1) = sorted(ring, key=lambda place: place[1])[-2:]
    page.drag(((x0 + x1) / 2, (y0 + y1) / 2), ((x0 + x1) / 2, (y0 + y1) / 2 - 12))
    page.wait(lambda: len(page.state()["field"]["rings"][0]) == len(ring) + 1)
    corner = next(place for place in page.state()["field"]["rings"][0] if list(place) not in ring)
    page.click(*corner)
    page.press(Keys.DELETE)
    page.wait(lambda: len(page.state()["field"]["rings"][0]) == len(ring))
    assert {tuple(place) for place in page.state()["field"]["rings"][0]} == set(map(tuple, ring))


def test_bad_edits_are_refused_in_place_and_the_old_tracks_stay(page: Page) -> None:
    before = page.state()
    box = page.driver.find_element(By.NAME, "spacing_m")
    box.clear()
    box.send_keys("5000", Keys.ENTER)
    page.wait(lambda: "larger than the field" in page.text("message"))
    assert "for instance 3." in page.text("message")  # and not --spacing 3
    assert page.state()["tracks"] == before["tracks"]
    page.press(Keys.ESCAPE)
    # A corner dragged across the other side: the outline crosses itself.
    ring = before["field"]["rings"][0]
    corner = max(ring, key=lambda place: place[0])
    left = min(place[0] for place in ring)
    page.run("document.activeElement.blur()")
    page.press("o")
    high = max(place[1] for place in ring)
    page.drag(tuple(corner), (left - 10, high - 70))
    page.wait(lambda: "The outline crosses itself. Move" in page.text("message"))
    assert page.state()["field"]["rings"] == before["field"]["rings"]
    assert page.state()["tracks"] == before["tracks"]


def test_an_outline_without_room_for_turns_is_refused_when_it_is_drawn(
    driver: webdriver.Chrome, plan_path: Path
) -> None:
    """It was refused on saving only, after all that a person had edited on it."""
    wide = ["--spacing", "4", "--route", "boustrophedon", "--turning-radius", "40"]
    run_geofield("tracks", plan_path, "-o", plan_path, "--overwrite", *wide, check=True)
    with served(plan_path) as (address, _):
        page = Page(driver, address)
        before = page.state()
        x, y = shapely.Polygon(before["field"]["rings"][0]).centroid.coords[0]
        page.run("document.querySelector('[data-tool=anew]').click()")
        for corner in ((0, 0), (40, 0), (40, 30), (0, 30), (0, 0)):
            page.click(x + corner[0], y + corner[1])
        page.wait(lambda: "40 m is larger than the field (50 m across)" in page.text("message"))
        assert "Draw the outline wider, or choose no route." in page.text("message")
        now = page.state()
        assert (now["field"], now["edited"]) == (before["field"], False)
        page.press("j", "c")
        page.wait(lambda: page.judged() == 1)
        page.button("save")
        page.wait(lambda: "Saved" in page.text("message"))
        page.run("document.getElementsByName('route')[0].value = 'none'")
        page.run("document.querySelector('#settings button').click()")
        page.wait(lambda: page.state()["settings"]["route"] == "none")
        page.run("document.querySelector('[data-tool=anew]').click()")
        for corner in ((0, 0), (40, 0), (40, 30), (0, 30), (0, 0)):
            page.click(x + corner[0], y + corner[1])
        page.wait(lambda: len(page.state()["field"]["rings"][0]) == 4)
        assert not page.complaints()


def test_an_outline_that_allows_no_tracks_is_shown_and_put_right(
    driver: webdriver.Chrome, plan_path: Path
) -> None:
    """Made in another program, it could not even be opened here."""
    wide = ["--spacing", "4", "--route", "boustrophedon", "--turning-radius", "20"]
    run_geofield("tracks", plan_path, "-o", plan_path, "--overwrite", *wide, check=True)
    field = gpd.read_file(plan_path, layer="field")
    whole = field.geometry[0]
    x, y = whole.representative_point().coords[0]
    field.geometry = [shapely.box(x - 10, y - 10, x + 10, y + 10)]
    field.to_file(plan_path, layer="field", driver="GPKG", geometry_name="geom")
    with served(plan_path) as (address, _):
        page = Page(driver, address)
        page.wait(lambda: "no tracks for this outline: draw it anew" in page.text("message"))
        assert "radius of 20 m is larger than the field" in page.text("notes")
        assert page.text("figures") == ""
        assert page.state()["tracks"] == []
        page.button("save")
        page.wait(lambda: "no turn fits" in page.text("message"))
        page.run("document.querySelector('#alternatives button').click()")
        page.wait(lambda: len(page.state()["tracks"]) > 5)
        assert page.text("figures").startswith(f"{whole.area / 1e4:.2f} ha")
        page.button("undo")
        page.wait(lambda: page.text("figures") == "")
        page.button("redo")
        page.wait(lambda: page.text("figures") != "")
        page.button("save")
        page.wait(lambda: "Saved" in page.text("message"))
        assert not page.complaints()
    assert read_plan(plan_path).field.area_ha == pytest.approx(whole.area / 1e4, rel=0.01)


def test_what_is_typed_is_saved_with_a_comma_and_beside_other_edits(
    page: Page, plan_path: Path
) -> None:
    box = page.driver.find_element(By.NAME, "spacing_m")
    box.clear()
    box.send_keys("6,5")
    page.run("document.activeElement.blur()")
    page.press("j", "r")
    page.wait(lambda: page.judged() == 1)
    assert (box.get_attribute("value"), page.state()["settings"]["spacing_m"]) == ("6,5", 4)
    page.button("save")
    page.wait(lambda: "Saved" in page.text("message"))
    saved = read_plan(plan_path).settings
    assert saved is not None
    assert (saved.tracks.spacing_m, box.get_attribute("value")) == (6.5, "6.5")
    # What cannot be is not passed over: nothing is saved then.
    box.clear()
    box.send_keys("six")
    page.button("save")
    page.wait(lambda: "a number of metres above 0, not 'six'." in page.text("message"))
    assert page.state()["can_redo"] is page.state()["edited"] is False
    # The refusal went on standing beside a value that is right again.
    box.clear()
    box.send_keys("6.5", Keys.ENTER)
    page.wait(lambda: page.text("message") == "", seconds=4)
    assert page.text("figures").split(" · ")[1:2] == ["29 tracks"]
    assert page.text("figures").endswith(" % covered")


def test_numbers_are_what_a_person_means_by_them(page: Page) -> None:
    """Of 1,000 came 1, and of 0x10 came 16."""
    box = page.driver.find_element(By.NAME, "spacing_m")
    for language, typed, meant in (
        ("en", "1,000", None),
        ("en", "0x10", None),
        ("en", "6,125", None),
        ("de", "6,125", 6.125),
        ("de", ".5e1", 5),
        ("en", "6,5", 6.5),
        ("en", "12.125", 12.125),
    ):
        page.run(
            f"const one = document.getElementById('language'); one.value = '{language}';"
            "one.dispatchEvent(new Event('change'))"
        )
        after = meant or page.state()["settings"]["spacing_m"]
        box.clear()
        box.send_keys(typed, Keys.ENTER)
        if meant is None:
            page.wait(lambda typed=typed: f"above 0, not '{typed}'." in page.text("message"))
        else:
            page.wait(lambda after=after: page.state()["settings"]["spacing_m"] == after)
        assert page.state()["settings"]["spacing_m"] == after


def test_an_undone_edit_is_shown_and_keys_speak_of_it(page: Page) -> None:
    """What was undone stayed out of view, and the next key judged another obstacle."""

    def chosen() -> str:
        return str(
            page.run("return document.querySelector('#list [aria-selected=true] b').textContent")
        )

    page.press("c")  # nothing is chosen yet: the most doubtful is shown first
    page.wait(lambda: page.run("return document.querySelector('#list [aria-selected=true]')"))
    first = chosen()
    assert not page.state()["can_undo"]
    page.press("c", "r")
    page.wait(lambda: page.judged() == 2)
    page.chord(Keys.CONTROL, "z")
    page.chord(Keys.CONTROL, "z")
    page.wait(lambda: chosen() == first)
    centre, resolution = page.view()
    x, y = page.obstacle(int(first))["centre"]
    assert abs(centre[0] - x) + abs(centre[1] - y) < 400 * resolution
    page.press("r")
    page.wait(lambda: page.obstacle(int(first))["status"] == "rejected")


def test_a_shape_that_is_not_round_says_so_to_the_keys_of_size(
    driver: webdriver.Chrome, plan_path: Path
) -> None:
    plan = read_plan(plan_path)
    session = Session(plan)
    middle = plan.field.polygon.representative_point()
    square = shapely.box(*middle.buffer(5).bounds).exterior.coords[:-1]
    session.do({"do": "polygon", "ring": [list(place) for place in square]})
    save_plan(session.plan, plan_path, read_from=plan_path)
    with served(plan_path) as (address, _):
        page = Page(driver, address)
        page.run("document.querySelector('#list [data-no=\"22\"]').click()")
        # Where a keyboard has the bracket behind Alt.
        page.run("window.dispatchEvent(new KeyboardEvent('keydown', {key: ']', altKey: true}))")
        page.wait(lambda: "Obstacle 22 is not round." in page.text("message"))
        assert not page.state()["can_undo"]


def test_an_empty_plan_has_no_dead_buttons_and_a_telephone_shows_the_whole_field(
    driver: webdriver.Chrome, plan_path: Path
) -> None:
    plan = read_plan(plan_path)
    assert plan.obstacles is not None
    empty = replace(
        plan, obstacles=plan.obstacles.iloc[:0], evidence=replace(plan.evidence, written=None)
    )
    save_plan(Session(replace(empty, tracks=None)).plan, plan_path, read_from=plan_path)
    size = {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": True}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        with served(plan_path) as (address, _):
            page = Page(driver, address)
            assert page.text("left") == "None found"
            dead = [
                name
                for name in ("previous", "next", "confirm", "reject")
                if page.run(f"return document.getElementById('{name}').ariaDisabled === 'true'")
            ]
            assert dead == ["previous", "next", "confirm", "reject"]
            seen = driver.execute_async_script(
                "const [done] = arguments; import('/map.js').then(({map, view, sources}) =>"
                " done(ol.extent.containsExtent(view.calculateExtent(map.getSize()),"
                " sources.outline.getExtent())));"
            )
            assert seen
        # Nobody searched here: that is another thing than to find nothing.
        unsearched = replace(read_plan(plan_path), evidence=Evidence())
        save_plan(unsearched, plan_path, read_from=plan_path)
        with served(plan_path) as (address, _):
            assert Page(driver, address).text("left") == "Nobody searched for any"
    finally:
        driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_counts_are_right_for_one(driver: webdriver.Chrome, plan_path: Path) -> None:
    """The page said "1 of 1 wait" and "All 1 have a person's word"."""
    plan = read_plan(plan_path)
    assert plan.obstacles is not None
    alone = replace(
        plan, obstacles=plan.obstacles.iloc[:1], evidence=replace(plan.evidence, written=None)
    )
    save_plan(Session(replace(alone, tracks=None)).plan, plan_path, read_from=plan_path)
    with served(plan_path) as (address, _):
        page = Page(driver, address)
        assert page.text("left") == "Waiting for your word: 1 of 1"
        page.press("j", "c")
        page.wait(lambda: page.text("left") == "Waiting for your word: 0 of 1")
        page.run("window.onbeforeunload = null")


def test_numbers_lie_over_no_others(page: Page) -> None:
    """11 beside 109 was read as 1109, and a track's 37 over its neighbour's as nothing."""
    # Every number that is drawn, and the corners of its letters in the picture.
    script = (
        "const [resolution, done] = arguments, pen = CanvasRenderingContext2D.prototype;"
        "const write = pen.fillText, drawn = [];"
        "pen.fillText = function (text, x, y) {"
        " const m = this.getTransform(), box = this.measureText(text);"
        " const left = x - box.actualBoundingBoxLeft, right = x + box.actualBoundingBoxRight;"
        " const top = y - box.actualBoundingBoxAscent, low = y + box.actualBoundingBoxDescent;"
        " const corners = [[left, top], [right, top], [right, low], [left, low]];"
        " drawn.push([+text, this.font.includes('italic'), corners.map(([x, y]) =>"
        " [m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f])]);"
        " return write.call(this, text, x, y); };"
        "import('/map.js').then(({map, view}) => {"
        " view.setResolution(resolution); map.renderSync();"
        " drawn.length = 0; map.render(); map.once('rendercomplete', () => {"
        " pen.fillText = write; done(drawn); }); });"
    )
    spacing = page.driver.find_element(By.NAME, "spacing_m")
    spacing.clear()
    spacing.send_keys("2", Keys.ENTER)
    page.wait(lambda: page.state()["figures"]["tracks"] > 80)
    known = {each["no"] for each in page.state()["obstacles"]}
    seen = {}
    for resolution in (0.59, 0.34):
        drawn = page.driver.execute_async_script(script, resolution)
        seen[resolution] = {number for number, of_track, _ in drawn if not of_track}
        boxes = [(number, Polygon(corners)) for number, _, corners in drawn]
        over = [(a, b) for (a, one), (b, two) in combinations(boxes, 2) if one.intersects(two)]
        assert not over, f"at {resolution} m per pixel"
    assert seen[0.59] < seen[0.34] == known  # a closer look shows them all
    assert len(drawn) > len(known) + 20  # those of tracks, too


def test_what_was_dragged_off_the_picture_goes_back(page: Page) -> None:
    before = page.obstacle(8)
    page.run("document.querySelector('#list [data-no=\"8\"]').click()")
    time.sleep(0.3)
    page.driver.execute_async_script(
        "const done = arguments[0]; import('/map.js').then(({view}) => {"
        " view.setResolution(1.2); setTimeout(done, 300); });"
    )
    x, y = before["centre"]
    page.drag((x, y), (x + 400, y))
    page.wait(lambda: "outside the picture" in page.text("message"))
    assert page.obstacle(8) == before
    shown = page.driver.execute_async_script(
        "const done = arguments[0]; import('/map.js').then(({sources}) => "
        "done(sources.obstacles.getFeatureById(8).getGeometry().getExtent()));"
    )
    assert (shown[0] + shown[2]) / 2 == pytest.approx(x, abs=0.1)


def test_a_key_in_the_middle_of_a_drag_moves_no_other_obstacle(page: Page) -> None:
    """The verdict goes on to the next obstacle, which was moved by the hand that let go."""
    before = page.state()["obstacles"]
    page.click(*page.obstacle(8)["centre"])
    _, resolution = page.view()
    half_drag(page, page.pixel(*page.obstacle(8)["centre"]))
    page.press("c")
    page.wait(lambda: page.judged() == 1)
    ActionChains(page.driver).release().perform()
    page.wait(lambda: page.obstacle(8)["centre"] != before[7]["centre"])
    after = page.state()["obstacles"]
    pairs = zip(after, before, strict=True)
    assert [one["no"] for one, old in pairs if one["rings"] != old["rings"]] == [8]
    # The map went on to the next obstacle below the hand, and the tree with it: 109 m.
    x, y = before[7]["centre"]
    there = [x + 30 * resolution, y - 5 * resolution]
    assert after[7]["centre"] == pytest.approx(there, abs=resolution)


def half_drag(page: Page, spot: tuple[int, int]) -> None:
    """Press at a spot of the window, and move, without letting go."""
    hand = ActionChains(page.driver, duration=30)
    pointer = hand.w3c_actions.pointer_action
    pointer.move_to_location(*spot)
    pointer.pointer_down()
    pointer.move_to_location(spot[0] + 30, spot[1] + 5)
    hand.perform()


@pytest.mark.parametrize("tool", ["select", "outline", "direction"])
def test_what_a_hand_held_goes_back_when_the_drag_is_stopped(page: Page, tool: str) -> None:
    """The shape stayed where the hand had it, with the tracks of there: no file has them so."""
    state = page.state()
    place = state["obstacles"][7]["centre"]
    page.click(*place)
    if tool == "outline":
        place = max(state["field"]["rings"][0])
    drawn = (
        "const [done] = arguments; import('/map.js').then(({sources}) =>"
        " done(['obstacles', 'outline', 'tracks'].map(name => sources[name].getFeatures()"
        ".map(each => JSON.stringify(each.getGeometry().getCoordinates())).sort())));"
    )
    before = page.driver.execute_async_script(drawn)
    page.driver.find_element(By.CSS_SELECTOR, f"[data-tool={tool}]").click()
    half_drag(page, page.pixel(*place))
    page.wait(lambda: page.driver.execute_async_script(drawn) != before)
    page.press(Keys.ESCAPE)
    page.wait(lambda: page.driver.execute_async_script(drawn) == before, seconds=3)
    ActionChains(page.driver).release().perform()
    assert not page.state()["can_undo"]


def test_a_tool_that_was_taken_before_the_answer_is_kept(page: Page) -> None:
    """The tool before it gave the hand to Select, and the circle in the hand was gone."""
    x, y = page.obstacle(8)["centre"]
    page.driver.find_element(By.CSS_SELECTOR, "[data-tool=direction]").click()
    page.driver.execute_cdp_cmd("Network.enable", {})
    slow = {"offline": False, "latency": 900, "downloadThroughput": -1, "uploadThroughput": -1}
    page.driver.execute_cdp_cmd("Network.emulateNetworkConditions", slow)
    page.drag((x - 60, y), (x + 60, y + 9), steps=2)
    page.press("a")
    half_drag(page, page.pixel(x + 20, y + 20))
    page.wait(lambda: page.run("return document.getElementById('undo').ariaDisabled") == "false")
    time.sleep(0.2)
    page.driver.execute_cdp_cmd("Network.emulateNetworkConditions", {**slow, "latency": 0})
    ActionChains(page.driver).release().perform()
    page.wait(lambda: len(page.state()["obstacles"]) == 22, seconds=5)
    assert page.state()["obstacles"][-1]["status"] == "added"


@pytest.mark.parametrize("tool", ["select", "outline"])
def test_an_answer_takes_nothing_out_of_the_hand(page: Page, tool: str) -> None:
    """What was dragged once more jumped back, while the hand went on with it unseen."""
    shown = (
        "const [done] = arguments; import('/map.js').then(({sources}) => done(["
        "sources.obstacles.getFeatureById(8), sources.outline.getFeatures()[0]]"
        ".map(one => one.getGeometry().getExtent()[2])));"
    )
    which = ["select", "outline"].index(tool)

    def right() -> float:
        return float(page.driver.execute_async_script(shown)[which])

    page.run("document.querySelector('#list [data-no=\"8\"]').click()")
    page.driver.find_element(By.CSS_SELECTOR, f"[data-tool={tool}]").click()
    state = page.state()
    x, y = (page.obstacle(8)["centre"], max(state["field"]["rings"][0]))[which]
    page.driver.execute_async_script(
        "const [place, done] = arguments; import('/map.js').then(({view}) => {"
        " view.setCenter(place); view.setResolution(0.2); setTimeout(done, 400); });",
        [x, y],
    )
    before = right()
    page.driver.execute_cdp_cmd("Network.enable", {})
    slow = {"offline": False, "latency": 1000, "downloadThroughput": -1, "uploadThroughput": -1}
    page.driver.execute_cdp_cmd("Network.emulateNetworkConditions", slow)
    page.drag((x, y), (x + 8, y), steps=2)
    half_drag(page, page.pixel(x + 8, y))
    page.wait(lambda: page.run("return document.getElementById('undo').ariaDisabled") == "false")
    assert right() - before == pytest.approx(14, abs=0.5)
    page.driver.execute_cdp_cmd("Network.emulateNetworkConditions", {**slow, "latency": 0})
    ActionChains(page.driver).release().perform()
    page.wait(lambda: int(page.state()["stamp"].split(".")[1]) == 2)
    time.sleep(0.3)
    assert right() - before == pytest.approx(14, abs=0.5)


def test_a_size_that_was_dragged_is_kept_by_the_next_drag(page: Page) -> None:
    """The second one begins where the first one ended, and not where the last answer was."""
    page.run("document.querySelector('#list [data-no=\"8\"]').click()")
    time.sleep(0.3)
    before, (_, metre) = page.obstacle(8), page.view()
    x, y = before["centre"]
    corner = x + before["radius_m"] + before["buffer_m"]
    page.driver.execute_cdp_cmd("Network.enable", {})
    slow = {"offline": False, "latency": 1500, "downloadThroughput": -1, "uploadThroughput": -1}
    page.driver.execute_cdp_cmd("Network.emulateNetworkConditions", slow)
    for _ in range(2):
        page.drag((corner, y), (corner + 20 * metre, y), steps=2)
        corner += 20 * metre
    page.driver.execute_cdp_cmd("Network.emulateNetworkConditions", {**slow, "latency": 0})
    page.wait(lambda: page.obstacle(8)["radius_m"] > before["radius_m"] + 30 * metre)
    wider = page.obstacle(8)["radius_m"] - before["radius_m"]
    assert wider == pytest.approx(40 * metre, abs=3 * metre)


def reject_and_kill(page: Page, process: subprocess.Popen[str]) -> None:
    """Reject the first obstacle, and end the server as a power cut does."""
    page.press("j", "r")
    page.wait(lambda: page.judged() == 1)
    process.send_signal(signal.SIGKILL)
    process.wait()


def test_edits_come_back_after_the_server_is_killed(
    driver: webdriver.Chrome, plan_path: Path
) -> None:
    with served(plan_path, program=[GEOFIELD]) as (address, process):
        page = Page(driver, address)
        reject_and_kill(page, process)
        page.press("r")
        page.wait(lambda: "geofield has ended" in page.text("message"))
    with served(plan_path) as (address, _):
        page = Page(driver, address)
        assert "1 edit of a session" in page.text("message")
        assert page.judged() == 1


def test_what_came_back_is_told_once_and_own_edits_are_of_no_earlier_session(
    driver: webdriver.Chrome, plan_path: Path
) -> None:
    with served(plan_path, program=[GEOFIELD]) as (address, process):
        page = Page(driver, address)
        reject_and_kill(page, process)
    with served(plan_path) as (address, _):
        page = Page(driver, address)
        assert "1 edit of a session" in page.text("message")
        for press in ("driver.refresh", "reload"):
            page.run("document.body.dataset.ready = ''; onbeforeunload = null")
            if press == "reload":
                page.button("more")
                page.button("reload")
            else:
                driver.refresh()
            with contextlib.suppress(NoAlertPresentException):
                driver.switch_to.alert.accept()
            page.wait(lambda: page.run("return document.body.dataset.ready") == "yes")
            time.sleep(0.2)
            assert (page.text("message"), page.judged()) == ("", 1), press


def test_another_program_changed_or_locked_the_file(page: Page, plan_path: Path) -> None:
    page.press("j", "r")
    page.wait(lambda: page.judged() == 1)
    with closing(sqlite3.connect(plan_path)) as other:
        other.execute("BEGIN EXCLUSIVE")
        page.button("save")
        page.wait(lambda: "open in another program" in page.text("message"))
        other.rollback()
        other.execute("UPDATE gpkg_contents SET description = 'edited' WHERE table_name = 'field'")
        other.commit()
    page.button("save")
    page.wait(lambda: "Another program changed" in page.text("message"))
    assert page.text("message").count("under another name") == 1
    page.button("more")
    page.driver.find_element(By.ID, "save-name").send_keys("mine")
    page.button("save-as")
    page.wait(lambda: plan_path.with_name("mine.gpkg").exists())
    saved = read_plan(plan_path.with_name("mine.gpkg"))
    assert saved.obstacles is not None
    assert (saved.obstacles["status"] == "rejected").sum() == 1


def test_edits_to_be_made_by_hand_are_named_until_they_were_read(
    page: Page, plan_path: Path
) -> None:
    """They were shown for some seconds, and in German not at all."""
    page.press("j", "r", "r")
    page.wait(lambda: page.judged() == 2)
    first = min(each["no"] for each in page.state()["obstacles"] if each["status"] == "rejected")
    other = Session(read_plan(plan_path))
    other.do({"do": "status", "no": first, "status": "confirmed"})
    save_plan(other.plan, plan_path, read_from=plan_path)
    page.run("localStorage.setItem('language', 'de')")
    page.button("save")
    page.wait(lambda: "Another program" in page.text("message"))
    page.driver.find_element(By.CSS_SELECTOR, "#message button").click()
    page.wait(lambda: "von Ihren Änderungen: 1 von 2" in page.text("message"))
    assert f"von Hand: status: obstacle {first} is not there as it was." in page.text("message")
    page.driver.find_element(By.CSS_SELECTOR, "#message button").click()
    assert page.text("message") == ""


def test_what_is_told_together_is_all_in_german(page: Page, plan_path: Path) -> None:
    """Two things at once were in English, or one of them was left out."""
    with closing(sqlite3.connect(plan_path)) as file, file:
        for (name,) in file.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'"):
            file.execute(f'DROP TRIGGER "{name}"')
        file.execute("DELETE FROM obstacles WHERE obstacle_no = 1")
    plan_path.with_name("scene.tif").unlink()
    page.run("localStorage.setItem('language', 'de')")
    page.button("more")
    page.button("reload")
    page.wait(lambda: "hier sind die Spuren neu geplant" in page.text("message"))
    assert "Das Bild ist nicht zu sehen" in page.text("message")


def test_notes_of_tracks_are_in_german(page: Page) -> None:
    notes = notes_of_tracks()
    page.run("localStorage.setItem('language', 'de')")
    page.driver.refresh()
    told = page.driver.execute_async_script(
        "const [notes, done] = arguments;"
        "import('/web/words.js').then(words => done(notes.map(note => words.told(note))));",
        notes,
    )
    assert [text for text in told if text in notes] == []
    assert "Wege zwischen Abschnitten" in " ".join(told)
    assert re.findall(r"\d+\.\d+", " ".join(told)) == []  # as the page's own numbers are
    file = page.run("return import('/web/words.js').then(w => w.told('field.2.gpkg is there.'))")
    assert "field.2.gpkg" in file


def test_a_track_that_a_person_bent_is_shown_as_it_is(
    driver: webdriver.Chrome, bent_path: Path
) -> None:
    """Of its places the two ends were shown, and the arrow of the drive beside it."""
    shown = (
        "const [done] = arguments; import('/map.js').then(({sources}) =>"
        " done(sources.tracks.getFeatures().map(one => one.getGeometry().getCoordinates())));"
    )
    with served(bent_path) as (address, _):
        page = Page(driver, address)
        (bent,) = [xy for xy in driver.execute_async_script(shown) if len(xy) > 2]
        page.run("document.querySelector('[name=route]').value = 'boustrophedon'")
        page.driver.find_element(By.CSS_SELECTOR, "#settings [type=submit]").click()
        page.wait(lambda: page.state()["drive"])
        arrows = [shapely.Point(xy) for *xy, _ in page.state()["drive"]]
        assert shapely.LineString(bent).distance(shapely.MultiPoint(arrows)) < 0.002
        page.click(*page.obstacle(8)["centre"])
        half_drag(page, page.pixel(*page.obstacle(8)["centre"]))
        # What follows a hand is one shape.
        page.wait(lambda: bent in driver.execute_async_script(shown)[0])
        assert page.text("figures").endswith("covered · route planned on saving")
        ActionChains(driver).release().perform()
        page.wait(lambda: page.state()["can_undo"] and page.obstacle(8)["status"] == "confirmed")
        assert page.text("figures").endswith("covered · route planned on saving")
        page.button("save")
        page.wait(lambda: "Saved" in page.text("message"))
        assert "route" not in page.text("figures")
        assert page.state()["route"]
        assert bent in driver.execute_async_script(shown)
        page.press("j", "c")
        page.wait(lambda: "route planned on saving" in page.text("figures"))
        page.run("document.getElementById('more').click()")
        page.run("document.getElementById('export-format').value = 'geojson'")
        page.run("document.getElementById('export').click()")
        page.wait(lambda: "geojson" in page.text("message"))
        assert "route" not in page.text("figures")  # it was planned for the export
    tracks = read_plan(bent_path).tracks
    assert tracks is not None
    (saved,) = [one for one in tracks.segments.geometry if len(one.coords) > 2]
    assert saved.equals_exact(shapely.LineString(bent), 0.001)


def test_a_second_tab_is_told_and_can_take_over(page: Page) -> None:
    first = page.driver.current_window_handle
    address = page.run("return location.href")
    page.driver.switch_to.new_window("tab")
    second = Page(page.driver, address)
    assert "another tab" in second.text("message")
    other = page.driver.current_window_handle
    page.driver.switch_to.window(first)
    page.press("j", "r")
    page.wait(lambda: page.judged() == 1)
    page.driver.switch_to.window(other)
    taken_over(second)
    assert second.judged() == 1  # what the first tab did meanwhile is there
    second.press("j", "r")
    second.wait(lambda: second.judged() == 2)
    second.driver.close()
    second.driver.switch_to.window(first)
    page.press("j", "r")
    page.wait(lambda: "another tab" in page.text("message").lower())
    box = page.driver.find_element(By.NAME, "spacing_m")
    box.clear()
    box.send_keys("7")
    taken_over(page)
    assert page.judged() == 2
    # What was typed and not applied is still there, and goes along.
    box = page.driver.find_element(By.NAME, "spacing_m")
    assert box.get_attribute("value") == "7"
    page.button("save")
    page.wait(lambda: page.state()["settings"]["spacing_m"] == 7)


def taken_over(page: Page) -> None:
    page.run("delete document.body.dataset.ready")
    page.driver.find_element(By.CSS_SELECTOR, "#message button").click()
    page.wait(lambda: page.run("return document.body.dataset.ready"))


def test_saving_under_no_name_saves_nothing(page: Page, plan_path: Path) -> None:
    page.press("j", "r")
    page.wait(lambda: page.judged() == 1)
    before = plan_path.read_bytes()
    page.button("more")
    page.button("save-as")
    assert page.run("return document.activeElement.id") == "save-name"
    page.button("export")
    # What comes of it can be read where the dialog is.
    page.wait(
        lambda: (
            "Written"
            in page.run("return document.querySelector('dialog[open] #message')?.textContent ?? ''")
        )
    )
    assert plan_path.read_bytes() == before
    assert page.state()["edited"]


def test_another_plan_on_the_same_port_shows_its_own_picture(
    driver: webdriver.Chrome, plan_path: Path
) -> None:
    asked = "return performance.getEntriesByType('resource').map(e => e.name)"
    tiles = []
    port = "0"
    for _ in range(2):
        with served(plan_path, "--port", port) as (address, _):
            port = address.split(":")[2].split("/")[0]
            Page(driver, address).wait(lambda: "/tile/" in str(driver.execute_script(asked)))
            found = driver.execute_script(asked)
            tiles.append(next(name for name in found if "/tile/" in name))
    assert tiles[0] != tiles[1]  # the browser keeps tiles for an hour


def test_a_name_with_a_script_in_it_is_only_a_name(
    driver: webdriver.Chrome, plan_path: Path
) -> None:
    name = "<img src=x onerror=document.title='owned'><script>document.title='owned'</script>"
    with closing(sqlite3.connect(plan_path)) as file, file:
        for (trigger,) in file.execute(
            "SELECT name FROM sqlite_master WHERE type = 'trigger' AND tbl_name = 'field'"
        ).fetchall():
            file.execute(f"DROP TRIGGER {trigger}")
        file.execute("UPDATE field SET name = ?", (name,))
    with served(plan_path) as (address, _):
        page = Page(driver, address)
        assert page.text("title") == name
        assert driver.title == f"{name} – geofield"


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1280])
def test_accessibility_rules_hold(plan_path: Path, scheme: str, width: int) -> None:
    with served(plan_path) as (address, _):
        more = ["--force-dark-mode", "--blink-settings=preferredColorScheme=0"] * (scheme == "dark")
        driver = chromium(width, 844, *more)
        try:
            driver.execute_cdp_cmd(
                "Emulation.setDeviceMetricsOverride",
                {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": width < 500},
            )
            driver.execute_cdp_cmd(
                "Emulation.setEmulatedMedia",
                {"features": [{"name": "prefers-color-scheme", "value": scheme}]},
            )
            page = Page(driver, address)
            for opened in (None, "help", "more"):
                if opened:
                    page.button(opened)
                found = Axe().run(driver)
                assert not [(v["id"], v["nodes"][0]["html"][:200]) for v in found["violations"]]
                page.run("for (const one of document.querySelectorAll('dialog')) one.close()")
            assert page.run("return document.documentElement.scrollWidth <= innerWidth")
        finally:
            driver.quit()


def test_german_words_and_keys_switched_off(page: Page) -> None:
    page.press("?")
    page.wait(lambda: "Add a circle" in page.text("keys"))
    page.driver.find_element(By.ID, "keys-on").click()
    page.press(Keys.ESCAPE)
    page.press("j", "r")
    time.sleep(0.3)
    assert not page.state()["can_undo"]
    page.button("more")
    page.driver.find_element(By.CSS_SELECTOR, "#language option[value=de]").click()
    page.run("document.getElementById('menu').close()")
    assert page.text("confirm") == "Bestätigen"
    assert (
        page.run("return document.getElementById('redo').title") == "Wiederholen (Strg+Umschalt+Z)"
    )
    assert page.text("undo") == "Rückgängig"
    # Nothing is cut off.
    for width, height in ((360, 860), (720, 450), (1280, 860)):  # 720: a page enlarged twice
        page.driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
        )
        narrow = (
            "return [...document.querySelectorAll('button, h2, label span')]"
            ".filter(one => one.clientWidth && one.scrollWidth > one.clientWidth)"
            ".map(one => one.textContent)"
        )
        assert page.run(narrow) == []
    page.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    lefts = "[...document.querySelectorAll('#settings [name]')].map(one => one.offsetLeft)"
    assert len(set(page.run(f"return {lefts}"))) == 1  # one below the other
    assert page.run("return document.querySelector('[name=last_strip]').value") == "overrun"
    cut = page.run(
        "return [...document.querySelectorAll('#settings select')].filter(one => {"
        " const shown = one.offsetWidth;"
        " one.style.cssText = 'width: auto; max-width: none; flex: none';"
        " return one.offsetWidth > shown; }).map(one => one.name);"
    )
    assert cut == []
    box = page.driver.find_element(By.NAME, "spacing_m")
    box.clear()
    box.send_keys("5000", Keys.ENTER)
    page.wait(lambda: "5000 m ist größer als das Feld" in page.text("message"))
    assert page.text("left") == "Noch zu prüfen: 21 von 21"
    for name, typed, told in (
        ("spacing_m", "0", "Der Abstand ist eine Zahl in Metern über 0, nicht 0."),
        ("headland_m", "900", "Ein Vorgewende von 900 m lässt nichts vom Feld übrig. Wählen Sie"),
        ("direction", "quer", "ein Kurs in Grad oder eine aus der Liste, nicht 'quer'."),
    ):
        box = page.driver.find_element(By.NAME, name)
        box.clear()
        box.send_keys(typed, Keys.ENTER)
        page.wait(lambda told=told: told in page.text("message"))
        box.clear()
        box.send_keys(str(page.state()["settings"][name]))
    box.clear()
    box.send_keys("längste Kante", Keys.ENTER)
    page.wait(lambda: page.state()["settings"]["direction"] == "longest_edge")
    assert box.get_attribute("value") == "längste Kante"


def test_what_a_picture_lacks_is_not_offered(driver: webdriver.Chrome, plan_path: Path) -> None:
    """A field without a picture had "Near infrared", and two sliders that did nothing."""
    offered = (
        "return [...document.querySelectorAll('#view-h ~ label')]"
        ".filter(one => one.offsetHeight).map(one => one.querySelector('input').id)"
    )
    with served(plan_path) as (address, _):
        assert Page(driver, address).run(offered) == ["opacity", "contrast", "infrared"]
    (plan_path.parent / "scene.tif").unlink()
    with served(plan_path) as (address, _):
        assert Page(driver, address).run(offered) == []


def test_the_page_asks_nobody_else(page: Page) -> None:
    tiles = (
        "return performance.getEntriesByType('resource')"
        ".some(entry => entry.name.includes('/tile/'))"
    )
    page.wait(lambda: page.run(tiles))
    hosts = page.run(
        "return [...new Set(performance.getEntriesByType('resource')"
        ".map(entry => new URL(entry.name).host))]"
    )
    assert hosts == [page.run("return location.host")]


def test_the_session_ends_from_the_page(driver: webdriver.Chrome, plan_path: Path) -> None:
    with served(plan_path) as (address, process):
        page = Page(driver, address)
        page.button("more")
        page.button("stop")
        page.wait(lambda: "has ended" in page.text("message"))
        assert process.wait(10) == 0


def test_a_port_in_use_and_a_file_that_is_no_plan(plan_path: Path) -> None:
    with served(plan_path) as (address, _):
        port = address.split(":")[2].split("/")[0]
        with served(plan_path, "--port", port) as (nothing, process):
            assert nothing == ""
            assert process.wait(20) == 1
    other = shutil.copy(plan_path.with_name("scene.tif"), plan_path.with_name("x.gpkg"))
    with served(Path(other)) as (nothing, process):
        assert process.wait(20) == 1


def test_a_folder_of_plans_is_reviewed_in_one_session(
    driver: webdriver.Chrome, plan_path: Path
) -> None:
    folder = plan_path.parent
    second = "second" * 15
    (folder / second).mkdir()
    for name in ("field.gpkg", "scene.tif"):
        shutil.copy(folder / name, folder / second / name)
    (folder / "notes.gpkg").write_bytes(b"no plan")
    with served(folder) as (address, _):
        page = Page(driver, address)
        options = page.driver.find_elements(By.CSS_SELECTOR, "#plans option")
        assert [option.text for option in options] == ["field.gpkg", f"{second}/field.gpkg"]
        size = {"width": 360, "height": 740, "deviceScaleFactor": 1, "mobile": True}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        assert page.run("return document.documentElement.scrollWidth") == 360
        driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        # What is typed and cannot be goes along to no other plan, and the list says so.
        box = driver.find_element(By.NAME, "spacing_m")
        box.send_keys("six")
        options[1].click()
        page.wait(lambda: "a number of metres" in page.text("message"))
        assert options[0].is_selected()
        box.clear()
        box.send_keys("4")
        page.run("document.activeElement.blur()")
        page.press("j", "r")
        page.wait(lambda: page.judged() == 1)
        page.run("document.body.dataset.ready = ''")
        options[1].click()
        page.wait(lambda: page.run("return document.body.dataset.ready") == "yes")
        assert page.judged() == 0
        page.press("j", "r", "j", "r")
        page.wait(lambda: page.judged() == 2)
        page.button("save")
        page.wait(lambda: "Saved" in page.text("message"))
        # What was edited on the first plan is as it was left.
        page.run("document.body.dataset.ready = ''")
        page.driver.find_elements(By.CSS_SELECTOR, "#plans option")[0].click()
        page.wait(lambda: page.run("return document.body.dataset.ready") == "yes")
        assert page.judged() == 1
    other = read_plan(folder / second / "field.gpkg").obstacles
    assert other is not None
    assert (other["status"] == "rejected").sum() == 2
    first = read_plan(plan_path).obstacles
    assert first is not None
    assert (first["status"] == "rejected").sum() == 0
    assert plan_path.with_name("field.gpkg.review.jsonl").exists()


def test_ground_is_clicked_and_another_outline_chosen(doubtful_path: Path, page: Page) -> None:
    before = page.state()
    ring = before["field"]["rings"][0]
    middle = sum(x for x, _ in ring) / len(ring), sum(y for _, y in ring) / len(ring)
    high = max(place[1] for place in ring)
    page.press("g")
    page.click(middle[0] + 60, high + 3)
    page.wait(lambda: page.state()["can_undo"])
    wider = page.state()
    assert wider["figures"]["area_ha"] > before["figures"]["area_ha"] + 0.05
    page.chord(Keys.CONTROL, "z")
    page.wait(lambda: page.state()["field"]["rings"] == before["field"]["rings"])
    page.press(Keys.ESCAPE)
    others = page.driver.find_elements(By.CSS_SELECTOR, "#alternatives button")
    assert len(others) == len(before["field"]["alternatives"]) >= 2
    others[-1].send_keys(Keys.ENTER)
    page.wait(lambda: page.state()["can_undo"])
    focused = page.run("return document.activeElement.textContent")
    assert focused.startswith(f"Outline {len(others)} ")  # the next key goes on from there
    chosen = page.state()["field"]
    assert chosen["rings"] == before["field"]["alternatives"][-1]["rings"]
    assert page.text("certainty") == "Chosen by a person"


def test_keys_that_are_faster_than_the_answers_speak_of_one_after_the_other(page: Page) -> None:
    page.press("j")
    first = page.run("return document.querySelector('#list [aria-selected=true]').dataset.no")
    page.run(
        "for (const key of ['c', 'r', 'c', ']', ']', ']'])"
        " window.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true}));"
    )
    page.wait(lambda: page.judged() == 4)
    statuses = [row["status"] for row in page.state()["obstacles"]]
    assert (statuses.count("confirmed"), statuses.count("rejected")) == (3, 1)
    assert page.obstacle(int(first))["status"] == "confirmed"


def test_a_key_held_down_judges_once_and_a_slider_has_its_arrows(page: Page) -> None:
    page.press("j")
    page.run(
        "for (const repeat of [false, true, true, true]) window.dispatchEvent("
        "new KeyboardEvent('keydown', {key: 'c', repeat, bubbles: true}));"
    )
    page.wait(lambda: page.judged() == 1)
    slider = page.driver.find_element(By.ID, "opacity")
    slider.send_keys(Keys.ARROW_LEFT, Keys.ARROW_LEFT)
    page.press("u")  # comes after whatever the arrows did
    page.wait(lambda: float(slider.get_attribute("value") or 1) == pytest.approx(0.9))
    assert page.judged() == 1


def test_a_key_held_down_ends_with_the_hand(page: Page) -> None:
    """With 300 obstacles a tree went on for 18 s after an arrow had been held for 2 s."""
    (x, y), seen = page.obstacle(8)["centre"], page.state()["stamp"]
    page.run("document.querySelector('#list [data-no=\"8\"]').click()")
    held = (
        "for (const repeat of [arguments[0], true, true, true]) window.dispatchEvent("
        "new KeyboardEvent('keydown', {key: 'ArrowLeft', repeat, bubbles: true}));"
    )
    for steps in (1, 2):
        page.run(held, steps == 2)
        page.wait(lambda seen=seen: page.state()["stamp"] != seen)
        time.sleep(0.5)
        seen = page.state()["stamp"]
        assert page.obstacle(8)["centre"] == pytest.approx([x - 0.5 * steps, y], abs=0.01)


def test_a_hand_that_trembles_moves_nothing_by_a_click(page: Page) -> None:
    """A click beside the middle of the square made the tree larger, and confirmed it."""
    page.run("document.querySelector('#list [data-no=\"8\"]').click()")
    time.sleep(0.3)
    before, (_, metre) = page.obstacle(8), page.view()
    x, y = before["centre"]
    corner = x + before["radius_m"] + before["buffer_m"] + 5 * metre
    for spot in (x, corner):
        page.drag((spot, y), (spot + 2.4 * metre, y), steps=1)
        time.sleep(0.4)
        assert (page.obstacle(8), page.state()["can_undo"]) == (before, False)
    page.drag((corner, y), (corner + 30 * metre, y))
    page.wait(lambda: page.state()["can_undo"])
    wider = page.obstacle(8)["radius_m"] - before["radius_m"]
    assert wider == pytest.approx(30 * metre, abs=1.5 * metre)
    page.drag((x, y), (x + 9.4 * metre, y), steps=3)
    page.wait(lambda: page.obstacle(8)["centre"] != before["centre"])
    assert page.obstacle(8)["centre"] == pytest.approx([x + 9 * metre, y], abs=metre)


def test_a_hole_goes_whole_and_a_word_taken_back_leaves_what_was_found(
    driver: webdriver.Chrome, plan_path: Path
) -> None:
    plan = read_plan(plan_path)
    assert plan.obstacles is not None
    middle = plan.field.polygon.representative_point()
    hole = middle.buffer(12, quad_segs=1)
    obstacles = plan.obstacles.copy()
    obstacles.loc[obstacles["obstacle_no"] == 16, "status"] = "possible"
    detection = {**plan.evidence.detection, "threshold": 0.8}
    odd = replace(
        plan,
        obstacles=obstacles,
        field=replace(plan.field, polygon=cast(Polygon, plan.field.polygon.difference(hole))),
        evidence=replace(plan.evidence, detection=detection, written=None),
    )
    with pytest.warns(TrackWarning, match="out of the field"):
        save_plan(odd, plan_path, overwrite=True)
    with served(plan_path) as (address, _):
        page = Page(driver, address)
        page.run("document.querySelector('#list [data-no=\"16\"]').click()")
        page.press("u")  # there is no word to take back
        page.press("c")
        page.wait(lambda: page.obstacle(16)["status"] == "confirmed")
        page.run("document.querySelector('#list [data-no=\"16\"]').click()")
        page.press("u")
        page.wait(lambda: page.obstacle(16)["status"] == "possible")
        page.press("a")  # what was drawn stays drawn
        page.run("document.querySelector('#map').focus()")
        page.press(Keys.ENTER, "c")
        page.wait(lambda: page.obstacle(22)["status"] == "confirmed")
        page.run("document.querySelector('#list [data-no=\"22\"]').click()")
        page.press("u")
        page.wait(lambda: page.obstacle(22)["status"] == "added")
        page.press(Keys.DELETE)
        page.wait(lambda: len(page.state()["obstacles"]) == 21)
        for _ in range(4):
            page.chord(Keys.CONTROL, "z")
        page.chord(Keys.CONTROL, "z")
        page.chord(Keys.CONTROL, "z")
        page.wait(lambda: not page.state()["can_undo"])
        page.press("o")
        for left in (3, 0):
            rings = page.state()["field"]["rings"]
            driver.execute_async_script(
                "const [place, done] = arguments; import('/map.js').then(({view}) => {"
                " view.setCenter(place); view.setResolution(0.2); done(); });",
                rings[1][0],
            )
            page.click(*rings[1][0])
            page.press(Keys.DELETE)
            page.wait(lambda left=left: holes(page) == ([left] if left else []))
        assert len(page.state()["field"]["rings"]) == 1


def holes(page: Page) -> list[int]:
    return [len(ring) for ring in page.state()["field"]["rings"][1:]]
