"""A picture that is fetched grows with the field, as one on the disk does."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
import rasterio
import rasterio.shutil
from click.testing import CliRunner, Result

from geofield.cli.main import cli
from geofield.errors import FieldWarning, ImageryWarning, TermsError
from geofield.farm import read_farm
from geofield.plan import Plan, read_plan

from .tile_server import Handler, serving

SAMPLE = Path(__file__).parents[2] / "sample_data"
TRUTH = read_plan(SAMPLE / "field_1.gpkg")
POINT = ["--lat", "35.0754216", "--lon", "33.5310261"]
#: A square of this side shows a part of the field.
FIRST_M = 120


@pytest.fixture
def tiles(tmp_path: Path) -> Path:
    """The sample's colours as a file of tiles."""
    with rasterio.open(SAMPLE / "field_1.tif") as opened:
        profile = {**opened.profile, "count": 3, "driver": "GTiff"}
        pixels = opened.read([1, 2, 3])
    with rasterio.open(tmp_path / "rgb.tif", "w", **profile) as colour:
        colour.write(pixels)
    path = tmp_path / "farm.mbtiles"
    rasterio.shutil.copy(tmp_path / "rgb.tif", path, driver="MBTiles")
    return path


def told(*command: object) -> Result:
    done = CliRunner().invoke(cli, [str(each) for each in command])
    assert done.exit_code == 0, done.output
    return done


def overlap(plan: Plan) -> float:
    one, other = plan.field.polygon, TRUTH.field.polygon
    return float(one.intersection(other).area / one.union(other).area)


def side_m(plan: Plan) -> float:
    assert plan.grid is not None
    return max(plan.grid.shape) * plan.grid.ground_resolution_m


def test_a_file_of_tiles_is_read_as_far_as_the_field_goes(tiles: Path, tmp_path: Path) -> None:
    done = told("run", tiles, *POINT, "--size-m", FIRST_M, "--out", tmp_path / "out")
    assert "--size-m" not in done.stderr
    plan = read_plan(tmp_path / "out" / "field.gpkg")
    assert overlap(plan) > 0.97
    assert side_m(plan) > 2 * FIRST_M
    assert plan.grid is not None
    with rasterio.open(tmp_path / "out" / "scene.tif") as scene:
        assert scene.shape == plan.grid.shape
    assert plan.settings is not None
    assert plan.settings.imagery.size_m == FIRST_M
    assert plan.obstacles is not None
    assert len(plan.obstacles) > 12


def test_points_of_a_farm_are_looked_at_as_far_as_their_fields_go(
    tiles: Path, tmp_path: Path
) -> None:
    (tmp_path / "places.csv").write_text(f"id,lat,lon\none,{POINT[1]},{POINT[3]}\n")
    asked = ("--size-m", FIRST_M, "--workers", 1)
    told("batch", tmp_path / "places.csv", tiles, *asked, "--out", tmp_path / "farm")
    assert overlap(read_farm(tmp_path / "farm")["one"]) > 0.97


def test_no_more_is_fetched_unasked_than_is_read_at_once(
    tiles: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("geofield.imagery.reader.MAX_SIDE_PX", 300)
    command = ("field", tiles, *POINT, "--size-m", 100, "-o", tmp_path / "f.gpkg")
    with pytest.warns(FieldWarning, match="goes on outside"):
        done = told(*command)
    assert side_m(read_plan(tmp_path / "f.gpkg")) < 120
    assert "may be had with --size-m 2" in done.stderr
    assert "--size-m" not in told(*command[:-4], "--size-m", 400, "-o", tmp_path / "g.gpkg").stderr


def of_file(path: Path) -> dict[tuple[int, int, int], bytes]:
    with closing(sqlite3.connect(path)) as file:
        rows = file.execute("SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles")
        return {(zoom, x, 2**zoom - 1 - y): data for zoom, x, y, data in rows}


@pytest.mark.parametrize("all_there", [True, False])
def test_a_server_is_asked_for_more(
    tiles: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, all_there: bool
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    known = of_file(tiles)
    zoom = max(zoom for zoom, _, _ in known)
    least = min(y for level, _, y in known if level == zoom)

    def answer(handler: Handler, tile: tuple[int, int, int], attempt: int) -> bool:
        if tile in known and (all_there or tile[2] > least):
            handler.reply(200, known[tile], "image/png")
        elif all_there:
            return False  # other ground
        else:
            handler.reply(404, b"no", "text/plain")
        return True

    with serving(answer) as server:
        (tmp_path / "geofield.toml").write_text(
            f'[fetch.sources.county]\nurl = "{server.address}/{{z}}/{{x}}/{{y}}.png"\n'
            f"min_zoom = {zoom}\nmax_zoom = {zoom}\nmay_derive = true\n"
            '[fetch]\nallow = ["127.0.0.1"]\n'
        )
        monkeypatch.chdir(tmp_path)
        command = ("field", "county", *POINT, "--size-m", FIRST_M, "-o", tmp_path / "f.gpkg")
        if all_there:
            with pytest.warns(ImageryWarning, match="it is transparent there"):
                told(*command)
        else:
            with (
                pytest.warns(ImageryWarning, match="could not be had"),
                pytest.warns(FieldWarning, match="goes on outside"),
            ):
                assert "--size-m" not in told(*command).stderr
    plan = read_plan(tmp_path / "f.gpkg")
    if all_there:
        assert overlap(plan) > 0.97
    else:
        assert plan.frame_lines


@pytest.mark.parametrize("fetched", [False, True])
def test_a_further_point_is_shown_now_and_by_the_next_run(
    tiles: Path, tmp_path: Path, fetched: bool
) -> None:
    # 80 m from the point, in a first window that ends 30 m from it.
    picture, further = tiles if fetched else tiles.parent / "rgb.tif", (33.5318, 35.0758)
    command = ["field", picture, *POINT, "--size-m", 60, "-o", tmp_path / "f.gpkg"]
    told(*command, "--include-lonlat", "{},{}".format(*further))
    assert overlap(read_plan(tmp_path / "f.gpkg")) > 0.97
    told(*command, "--overwrite")
    again = read_plan(tmp_path / "f.gpkg")
    assert again.settings is not None
    assert again.settings.field.include == (further,)
    assert overlap(again) > 0.97
    slip = [*command[:-1], tmp_path / "slip.gpkg", "--include-lonlat", "34.5318,35.0758"]
    refused = CliRunner().invoke(cli, [str(each) for each in slip])
    assert "of include lies outside the picture" in str(refused.exception)


def test_terms_are_acknowledged_by_the_field_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "geofield.toml").write_text(
        f'[fetch.sources.drone]\nkind = "picture"\nurl = "{SAMPLE / "field_1.tif"}"\n'
        'attribution = "Me"\n'
    )
    monkeypatch.chdir(tmp_path)
    command = ["field", "drone", *POINT, "-o", str(tmp_path / "f.gpkg")]
    refused = CliRunner().invoke(cli, command)
    assert isinstance(refused.exception, TermsError)
    assert "--acknowledge-terms" in str(refused.exception.hint)
    told(*command, "--acknowledge-terms")
    assert overlap(read_plan(tmp_path / "f.gpkg")) > 0.97


def test_a_picture_of_ones_own_loads_nothing_of_what_fetches(tmp_path: Path) -> None:
    words = ["run", str(SAMPLE / "field_1.tif"), *POINT, "--out", str(tmp_path / "out")]
    code = (
        "import sys; from click.testing import CliRunner; from geofield.cli.main import cli; "
        f"done = CliRunner().invoke(cli, {words!r}); print(done.exit_code, "
        "[f'geofield.imagery.{name}' in sys.modules for name in ('scene', 'acquisition')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "0 [True, False]\n"
