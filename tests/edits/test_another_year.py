"""The same field in the picture of another year: what was there and what was said of it stands."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from changed_plans import Frame, at, geofield, plan_in, rewritten, rows, run
from shapely import LineString
from shapely.affinity import translate

from geofield import read_farm
from geofield.simulate import SimulatedField
from geofield_command import run_geofield

#: A crown of the picture (tree 1) and a bare place in the field, middle column and row.
CROWN, BARE, HALF_PX = (265, 111), (230, 230), 16
TAGS = ("GEOFIELD_SOURCE", "GEOFIELD_IMAGERY_DATE")


def of_year(folder: Path, year: int, *, first: int = 0, tree: int = 0, date: str = "") -> Path:
    """The picture of another year: some of its columns, with one `tree` more or less."""
    path = folder / f"{year}.tif"
    with rasterio.open(folder / "picture.tif") as picture:
        pixels, profile, tags = picture.read(), picture.profile, picture.tags()
        if tree:
            (x, y), (to_x, to_y) = (CROWN, BARE) if tree > 0 else (BARE, CROWN)
            half = HALF_PX
            crown = pixels[:, y - half : y + half, x - half : x + half].copy()
            pixels[:, to_y - half : to_y + half, to_x - half : to_x + half] = crown
        shift = rasterio.Affine.translation(first, 0)
        profile.update(width=picture.width - first, transform=picture.transform * shift)
        with rasterio.open(path, "w", **profile) as written:
            written.write(pixels[:, :, first:])
            of = {"GEOFIELD_SOURCE": str(year), "GEOFIELD_IMAGERY_DATE": date or str(year)}
            written.update_tags(**(tags | of))
    return path


@pytest.mark.parametrize("status", ["confirmed", "rejected"])
def test_a_neighbour_of_what_was_reviewed_is_found_again(
    folder: Path, made: SimulatedField, status: str
) -> None:
    """Its centre lies in the reviewed shape: it was gone, and tracks ran through it."""
    before = rows(plan_in(folder))

    def beside(table: Frame) -> Frame:
        shapes = dict(zip(table["obstacle_no"], table.geometry, strict=True))
        x, y = (shapes[3].centroid.coords[0][i] - shapes[1].centroid.coords[0][i] for i in (0, 1))
        table.loc[at(table, 1), "geometry"] = translate(shapes[1], x + 2, y)
        table.loc[at(table, 1), "status"] = status
        return table

    rewritten(folder / "out/field.gpkg", "obstacles", beside)
    for _ in range(2):
        run(folder, made, "--overwrite")
        plan = plan_in(folder)
        after = rows(plan)
        assert after["status"][[1, 3]].tolist() == [status, "detected"]
        assert after.geometry[3].equals(before.geometry[3])
        assert len(after) == len(before)
    assert plan.tracks is not None
    assert not plan.tracks.segments.intersects(before.geometry[3].buffer(-0.1)).any()


def test_one_rejected_place_is_one_thing(folder: Path) -> None:
    """A tree that grew half into a rejected circle was taken for it, and driven through."""
    file = folder / "out/field.gpkg"
    crown = rows(plan_in(folder)).geometry[1].centroid
    told = geofield("obstacles", of_year(folder, 2017, tree=-1), file, "-o", file)
    assert " found again, 1 gone (1)" in " ".join(told.split())
    before = rows(plan_in(folder))
    number = int(before.distance(crown).idxmin())

    def rejected(table: Frame) -> Frame:
        line = LineString([before.geometry[number].centroid, crown])
        # The centres of both trees lie in it, and half of the new one.
        circle = line.interpolate(0.45, normalized=True).buffer(0.57 * line.length)
        table.loc[at(table, number), "geometry"] = circle
        table.loc[at(table, number), "status"] = "rejected"
        return table

    rewritten(file, "obstacles", rejected)
    told = geofield("obstacles", folder / "picture.tif", file, "-o", file)
    new = int(before.index.max()) + 1
    said = f"1 obstacle of yours kept, {len(before) - 1} found again, 1 new ({new})"
    assert said in " ".join(told.split())
    after = rows(plan_in(folder))
    assert after["status"][[number, new]].tolist() == ["rejected", "detected"]
    assert after.geometry[new].distance(crown) == 0


def test_what_a_picture_does_not_show_is_not_gone(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    rewritten(file, "obstacles", lambda table: table[~at(table, 4)].assign(note="seen"))
    picture = of_year(folder, 2018, first=200)
    told = geofield("obstacles", picture, file, "-o", file)
    left = before.index[(before["x_px"] < 200) & (before.index != 4)]
    assert len(left) == 4
    assert "4 left where the picture shows nothing" in told
    after = rows(plan_in(folder))
    assert after["status"][left].eq("detected").all()
    assert after["note"][left].eq("seen").all()
    # Where things lie in a picture is said of the plan's own.
    assert np.allclose(after["x_px"][left], before["x_px"][left] - 200, atol=0.01)
    assert 4 not in after.index
    assert not after.intersects(before.geometry[4].centroid).any()
    # It is nobody's word: a picture in which nothing stands there takes it out.
    geofield("obstacles", folder / "picture.tif", file, "-o", file)
    again = rows(plan_in(folder))
    assert sorted(again.index) == sorted(set(before.index) - {4})
    assert np.allclose(again["x_px"], before["x_px"][again.index], atol=0.01)


def test_a_confirmed_tree_that_is_not_there_any_more_stays_and_is_told(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    rewritten(file, "obstacles", lambda table: table.assign(status="confirmed"))
    told = geofield("obstacles", folder / "picture.tif", file, "-o", file)
    assert f"{len(before)} obstacles of yours kept" in told
    assert "not found" not in told
    assert "smaller" not in told
    told = geofield("obstacles", of_year(folder, 2018, tree=-1), file, "-o", file)
    assert "1 you confirmed not found (1)" in told
    assert rows(plan_in(folder))["status"][1] == "confirmed"


def test_a_tree_that_grew_out_of_its_confirmed_shape_is_told(folder: Path) -> None:
    file = folder / "out/field.gpkg"

    def small(table: Frame) -> Frame:
        table.loc[at(table, 1), "geometry"] = table.geometry[at(table, 1)].centroid.buffer(1)
        return table.assign(status=np.where(at(table, 2), "rejected", "confirmed"))

    rewritten(file, "obstacles", small)
    told = geofield("obstacles", folder / "picture.tif", file, "-o", file)
    assert "1 of yours smaller than what is found there (1)" in told


def test_no_plan_is_shown_on_the_picture_of_another_year(
    folder: Path, made: SimulatedField
) -> None:
    file, out = folder / "out/field.gpkg", folder / "out"
    run(folder, made, "--overwrite")
    assert b"scene.tif" in _project(out)
    told = geofield("obstacles", of_year(folder, 2018), file, "-o", file)
    assert "scene.tif beside field.gpkg is of simulated-11, the plan of 2018 (2018)" in told
    assert b"scene.tif" not in _project(out)
    geofield("tracks", file, "-o", file)
    assert "Shown without the picture" in geofield("refresh", file)
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert (report["source"]["name"], report["picture"]) == ("2018", {})
    # A run writes the picture, too; what it replaced is not shown on that.
    place = ["--lat", made.lat, "--lon", made.lon, "--out", out, "--format", "gpkg"]
    geofield("run", of_year(folder, 2020), *place, "--overwrite")
    assert b"scene.tif" in _project(out)
    geofield("export", file, "--format", "turtle", "--out", out)
    geofield("run", of_year(folder, 2022), *place, "--overwrite")
    geofield("undo", file)
    words = "is of 2022 (2022), the plan of 2020 (2020)"
    linked = ("export", out / "field.ttl", "--format", "dxf", "--out", folder / "linked")
    assert f"scene.tif beside field.ttl {words}" in geofield(*linked)
    assert f"scene.tif beside field.gpkg {words}" in geofield("refresh", file)


def test_a_plan_is_read_where_its_picture_may_not_be(
    folder: Path, made: SimulatedField, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(folder, made, "--overwrite")
    opened = Path.open

    def refused(path: Path, *args: Any, **more: Any) -> Any:
        if path.name == "scene.tif":
            raise PermissionError(13, "Permission denied", str(path))
        return opened(path, *args, **more)

    monkeypatch.setattr(Path, "open", refused)
    assert len(rows(plan_in(folder))) > 3


def _project(out: Path) -> bytes:
    with zipfile.ZipFile(out / "field.qgz") as project:
        return b"".join(map(project.read, project.namelist()))


@pytest.mark.parametrize(
    ("date", "day"), [("2018", None), ("07/01/2018", None), ("2018:07:01 10:20", "2018-07-01")]
)
def test_a_picture_may_say_its_date_as_it_likes(
    folder: Path, made: SimulatedField, date: str, day: str | None
) -> None:
    """The run ended behind all its work: the column holds days."""
    of_year(folder, 2018, date=date).replace(folder / "picture.tif")
    run(folder, made, "--overwrite")
    assert plan_in(folder).field.imagery_date == day
    report = json.loads((folder / "out/report.json").read_text(encoding="utf-8"))
    assert report["source"]["date"] == date


def test_a_reviewed_field_of_a_farm_is_searched_in_the_picture_of_another_year(
    folder: Path,
) -> None:
    """Only with other settings it was: what had grown there since was driven through."""
    outline = gpd.read_file(folder / "out/field.gpkg", layer="field").assign(id="a")
    outline[["id", "geometry"]].to_file(folder / "parcels.gpkg")
    batch = ["batch", folder / "parcels.gpkg"]
    more = ["--spacing", 6, "--workers", 1, "--out", folder / "farm"]
    geofield(*batch, folder / "picture.tif", *more)
    mine, reviewed = folder / "a.gpkg", folder / "farm/reviewed/a.gpkg"
    geofield("farm", "get", folder / "farm", "a", "-o", mine)

    def said(table: Frame) -> Frame:
        table.loc[at(table, 2), "status"] = "rejected"
        return table[~at(table, 6)]

    rewritten(mine, "obstacles", said)
    geofield("farm", "put", mine, folder / "farm")
    before = rows(read_farm(folder / "farm")["a"])
    told = geofield(*batch, of_year(folder, 2018, tree=1), *more, "--fresh")
    assert "Planned on 2018, no longer on simulated-11: " in told
    changes = "1 obstacle of yours kept, 9 found again, 1 new (12), 1 you took"
    assert changes in " ".join(told.split())
    plan = read_farm(folder / "farm")["a"]
    after = rows(plan)
    assert plan.source.name == "2018"
    assert after["status"][2] == "rejected"
    assert sorted(set(after.index) - set(before.index)) == [12]
    assert abs(after["x_px"][12] - BARE[0]) < 3
    assert abs(after["y_px"][12] - BARE[1]) < 3
    # Pictures that do not show it change nothing, and its own picture neither.
    aside = folder / "aside"
    aside.mkdir()
    of_year(folder, 2020, first=300).rename(aside / "2020.tif")
    kept = reviewed.read_bytes()
    for picture in (folder / "picture.tif", aside):
        done = run_geofield(*batch, picture, *more, "--fresh", check=True)
        assert "Planned on" not in done.stderr
        assert rows(read_farm(folder / "farm")["a"]).equals(before)
    assert "It stays as reviewed: " in done.stderr
    assert reviewed.read_bytes() == kept


def test_a_farm_knows_its_picture_by_what_it_shows(folder: Path) -> None:
    """By its name alone another year's in its place was no news: what grew there stayed unseen."""
    outline = gpd.read_file(folder / "out/field.gpkg", layer="field").assign(id="a")
    outline[["id", "geometry"]].to_file(folder / "parcels.gpkg")
    farm, picture, moved = folder / "farm", folder / "picture.tif", folder / "moved/picture.tif"
    batch = ["batch", folder / "parcels.gpkg", picture]
    more = ["--spacing", 6, "--workers", 1, "--out", farm]
    geofield(*batch, *more)
    geofield("farm", "get", farm, "a", "-o", folder / "a.gpkg")
    geofield("farm", "put", folder / "a.gpkg", farm)
    # Packed otherwise, with overviews and elsewhere it is the same.
    moved.parent.mkdir()
    with rasterio.open(picture) as whole:
        profile = whole.profile | {"compress": "lzw", "tiled": True}
        with rasterio.open(moved, "w", **profile) as written:
            written.write(whole.read())
            written.update_tags(**whole.tags())
            written.build_overviews([2])
            said = {name: whole.tags().get(name, "") for name in TAGS}
    told = geofield(*batch[:-1], moved, *more)
    assert "1 of 1" in told
    assert "Pace" not in told
    with rasterio.open(of_year(folder, 2018, tree=1), "r+") as later:
        later.update_tags(**said)
    (folder / "2018.tif").replace(picture)
    done = run_geofield(*batch, *more)
    assert "a farm of other work: the pictures or obstacles differ." in done.stderr
    told = geofield("export", farm, "-f", "map", "--out", folder / "map")
    assert "picture.tif is not what the farm was planned on, though it is called the same" in told
    told = geofield(*batch, *more, "--fresh")
    assert "Planned on simulated-11, no longer on what it showed before: " in told
    assert "1 new (12)" in " ".join(told.split())
    assert "no longer on" not in geofield(*batch[:-1], moved, *more, "--fresh")
