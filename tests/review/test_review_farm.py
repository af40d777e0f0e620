"""A farm on the page: its fields in the order of doubt, saved back into the farm."""

from __future__ import annotations

import contextlib
import shutil
import signal
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pyogrio
import pytest
from browser import Page, chromium, served
from selenium import webdriver
from selenium.common.exceptions import NoAlertPresentException

import geofield as gf
from geofield.errors import ChangedError, GeofieldError
from geofield.farm import read_farm
from geofield.farm.edits import put_edits
from geofield.farm.put_back import put_back
from geofield.review import Session
from geofield.review.shelf import Shelf
from geofield.simulate import SimulationSettings, simulate_field
from geofield_command import run_geofield

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A farm of two fields, as `geofield batch` leaves it."""
    folder = tmp_path_factory.mktemp("farm")
    options = ["--spacing", "4", "--workers", "1", "--out", str(folder / "farm")]
    picture = shutil.copy(SAMPLES / "field_1.tif", folder / "field_1.tif")
    seeds = SAMPLES / "seeds.csv"
    run_geofield("batch", seeds, picture, *options, check=True)
    return folder


@pytest.fixture
def farm(planned: Path, tmp_path: Path) -> Path:
    shutil.copytree(planned, tmp_path / "all")
    return tmp_path / "all" / "farm"


def statuses(farm: Path, field_id: str) -> list[str]:
    plan = read_farm(farm)[field_id]
    assert plan.obstacles is not None
    return list(plan.obstacles["status"])


def test_fields_come_in_the_order_of_doubt_and_go_back_into_the_farm(farm: Path) -> None:
    sure = dict(zip(*read_farm(farm).status[["field_id", "certainty"]].to_numpy().T, strict=True))
    shelf = Shelf(farm)
    shown = [name.split(" ")[0] for name in shelf.names]
    assert sorted(shown, key=lambda one: sure[one]) == shown
    desk = shelf.desk
    assert desk.picture is not None  # it lies beside the farm
    assert desk.export("kml")["files"] == [f"export/{desk.path.stem}/{desk.path.stem}.kml"]
    assert [path.name for path in (farm / "export").iterdir()] == [desk.path.stem]
    pages = (["export", farm, "-f", "html", "--out", farm / folder] for folder in ("a", "b"))
    run_geofield(*next(pages), check=True)
    assert "data:image/" in next((farm / "a").glob("*.html")).read_text()
    (farm.parent / "field_1.tif").rename(farm.parent / "elsewhere.tif")
    assert "Shown without the picture" in run_geofield(*next(pages), check=True).stderr
    small = SimulationSettings(width_px=96, height_px=96, obstacles=0, lat=36.0)
    other = gf.write_scene(simulate_field(1, small).scene, farm.parent / "other.tif")
    options = ["-f", "map", "--picture", other, "--out", farm / "c"]
    said = run_geofield("export", farm, *options, check=True).stderr
    assert "other.tif does not show field_" in said
    number = int(desk.session.plan.obstacles["obstacle_no"].iloc[0])  # type: ignore[index]
    desk.edit({"do": "status", "no": number, "status": "rejected"})
    assert "rejected" not in statuses(farm, shown[0])
    assert desk.save()["saved_as"] == "farm"
    assert "rejected" in statuses(farm, shown[0])
    assert read_farm(farm)[shown[0]] == desk.session.plan
    # The overview shows it, too, and knows of no edits of its own.
    overview = pyogrio.read_dataframe(farm / "farm.gpkg", layer="obstacles")
    assert set(overview.loc[overview["status"] == "rejected", "field_id"]) == {shown[0]}
    assert put_edits(farm, farm / "farm.gpkg") == ([], [])
    shelf.open(1)
    shelf.desk.edit({"do": "status", "no": 1, "status": "confirmed"})
    # Killed here: the edit of the second field comes back, and that field comes first.
    again = Shelf(farm)
    assert again.names[0].split(" ")[0] == shown[1]
    assert str(again.desk.brought_back).startswith("1 edit of")
    assert again.names[1].endswith("✓")
    again.desk.edit({"do": "undo"})
    assert again.end() == []
    shelf.desk_of(0).end()
    assert not (farm / "reviewing").exists()


def test_a_folder_of_pictures_is_shown_and_a_lost_one_told(farm: Path) -> None:
    picture = farm.parent / "field_1.tif"
    one = Shelf(farm).desk.picture
    assert one is not None
    first = one.tile(0, 0, 0, "colour")
    whole = picture.rename(farm.parent / "a.tif")
    picture.mkdir()
    whole.rename(picture / "a.tif")
    desk = Shelf(farm).desk
    assert desk.picture is not None
    assert desk.picture.tile(0, 0, 0, "colour") == first
    (picture / "a.tif").write_bytes(b"II*")
    assert "The picture is not shown: " in str(Shelf(farm).desk.brought_back)
    shutil.rmtree(picture)
    assert "The picture of this plan is not beside it" in str(Shelf(farm).desk.brought_back)


def test_a_field_that_was_put_back_by_somebody_else_is_not_replaced(
    farm: Path, tmp_path: Path
) -> None:
    shelf = Shelf(farm)
    desk, name = shelf.desk, shelf.names[0].split(" ")[0]
    desk.edit({"do": "status", "no": 1, "status": "confirmed"})
    other = gf.read_farm(farm)[name]
    session = Session(other)
    session.do({"do": "status", "no": 1, "status": "rejected"})
    session.plan.write(tmp_path / "other", formats=["gpkg"])
    put_back(tmp_path / "other" / "field.gpkg", farm)
    with pytest.raises(ChangedError, match="in the farm"):
        desk.save()
    assert statuses(farm, name)[0] == "rejected"
    desk.reload()
    assert "kept in" in str(desk.brought_back)
    assert desk.session.plan.obstacles["status"].iloc[0] == "rejected"  # type: ignore[index]


def test_edits_of_the_overview_are_not_lost_by_a_save(farm: Path) -> None:
    desk = Shelf(farm).desk
    with closing(sqlite3.connect(farm / "farm.gpkg")) as file, file:
        names = [
            row[0] for row in file.execute("SELECT name FROM sqlite_master WHERE type='trigger'")
        ]
        for name in names:
            file.execute(f'DROP TRIGGER "{name}"')
        file.execute(
            "UPDATE field SET name = 'Home' WHERE field_id != ?",
            (desk.session.plan.field.field_id,),
        )
    desk.edit({"do": "status", "no": 1, "status": "rejected"})
    desk.save()
    assert "geofield farm put" in str(desk.end())
    ids, _ = put_edits(farm, farm / "farm.gpkg")
    assert {read_farm(farm)[one].field.name for one in ids} == {"Home"}
    assert "rejected" in statuses(farm, desk.session.plan.field.field_id)


def test_a_farm_without_a_plan_is_refused(farm: Path) -> None:
    shutil.rmtree(farm / "status")
    with pytest.raises(GeofieldError, match="no plan yet"):
        Shelf(farm)


@pytest.fixture
def driver() -> Iterator[webdriver.Chrome]:
    one = chromium()
    yield one
    one.quit()


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.xdist_group("review")
def test_one_field_after_another_on_the_page(driver: webdriver.Chrome, farm: Path) -> None:
    with served(farm) as (address, process):
        page = Page(driver, address)
        first = page.state()["field_id"]
        # The list says which field it is, and beside it stands whether it is saved.
        assert page.run("return document.getElementById('title').className") == "spoken"
        page.press("j", "r")
        page.wait(lambda: page.judged() == 1)
        assert page.text("unsaved") == "not saved"
        page.button("save")
        page.wait(lambda: "Saved in farm" in page.text("message"))
        page.run("document.body.dataset.ready = ''")
        page.press("n")
        page.wait(lambda: page.run("return document.body.dataset.ready") == "yes")
        assert page.state()["field_id"] != first
        page.run("window.onbeforeunload = null")
        driver.get("about:blank")
        with contextlib.suppress(NoAlertPresentException):
            driver.switch_to.alert.accept()
        process.send_signal(signal.SIGINT)
        process.wait(20)
    assert "rejected" in statuses(farm, first)
    assert not (farm / "reviewing").exists()


def loaded_again(page: Page, work: Callable[[], object]) -> None:
    """Do what loads the page again, and wait for it."""
    page.run("document.body.dataset.ready = ''")
    work()
    page.wait(lambda: page.run("return document.body.dataset.ready") == "yes")


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.xdist_group("review")
def test_how_the_picture_is_shown_is_kept_from_field_to_field(
    driver: webdriver.Chrome, farm: Path
) -> None:
    """Near infrared was to be chosen for each field, and single keys were on again."""
    shown = (
        "const done = arguments[0]; import('/map.js').then(({map}) => { map.renderSync();"
        " const layer = map.getLayers().item(0), url = layer.getSource().getTileUrlFunction();"
        " const node = document.querySelector('#map .picture');"
        " done([url([0, 0, 0]).split('/').slice(1, 3).join(' '), layer.getOpacity(),"
        " getComputedStyle(node).filter, document.getElementById('keys-on').checked]); });"
    )
    with served(farm) as (address, _):
        page = Page(driver, address)
        assert driver.execute_async_script(shown) == ["colour 0", 1, "none", True]
        page.run(
            "for (const id of ['infrared', 'keys-on']) document.getElementById(id).click();"
            "for (const [id, value] of [['opacity', 0.4], ['contrast', 2]]) {"
            " const input = document.getElementById(id); input.value = value;"
            " input.dispatchEvent(new Event('input')); }"
        )
        seen = ["infrared 0", 0.4, "contrast(2)", False]
        assert driver.execute_async_script(shown) == seen
        loaded_again(page, lambda: page.button("onward"))
        assert driver.execute_async_script(shown) == ["infrared 1", *seen[1:]]
        page.press("j", "r")
        assert not page.state()["can_undo"]
        names = [page.run(f"return document.querySelector('.ol-zoom-{way}').ariaLabel")
                 for way in ("in", "out")]  # fmt: skip
        assert names == ["Nearer", "Farther away"]


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.xdist_group("review")
def test_a_tab_that_takes_over_goes_on_with_the_field_that_it_shows(
    driver: webdriver.Chrome, farm: Path
) -> None:
    """It showed the other tab's field instead, and what was typed in the form was gone."""
    typed = "return document.querySelector('[name=spacing_m]').value"
    with served(farm) as (address, _):
        page, first = Page(driver, address), driver.current_window_handle
        own = page.state()["field_id"]
        page.press("j", "r")
        page.wait(lambda: page.judged() == 1)
        driver.switch_to.new_window("tab")
        other = Page(driver, address)
        take = "document.querySelector('#message button').click()"
        loaded_again(other, lambda: other.run(take))
        loaded_again(other, lambda: other.button("onward"))
        other.press("j", "c")
        other.wait(lambda: other.judged() == 1)
        driver.switch_to.window(first)
        page.run(
            "const input = document.querySelector('[name=spacing_m]'); input.value = '6';"
            "input.dispatchEvent(new Event('input', {bubbles: true}))"
        )
        page.press("r")
        page.wait(lambda: "Another tab" in page.text("message"))
        loaded_again(page, lambda: page.run(take))
        assert page.state()["field_id"] == own
        assert page.judged() == 1
        assert page.run(typed) == "6"
        page.button("save")
        page.wait(lambda: "Saved" in page.text("message"))
        # What the other tab did to the other field is there as well.
        loaded_again(page, lambda: page.button("onward"))
        assert page.judged() == 1
    assert "rejected" in statuses(farm, own)
    settings = read_farm(farm)[own].settings
    assert settings is not None
    assert settings.tracks.spacing_m == 6
