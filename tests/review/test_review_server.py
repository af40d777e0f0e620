"""The page's server from outside: who gets in, what is refused, what tiles show."""

from __future__ import annotations

import http.client
import io
import json
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from PIL import Image
from rasterio.warp import Resampling, calculate_default_transform, reproject

from geofield.errors import GeofieldError
from geofield.imagery.display import TILE_PX, TiledPicture
from geofield.plan import read_plan
from geofield.review.desk import Desk
from geofield.review.server import MOST_BYTES, ReviewServer
from geofield.review.shelf import Shelf
from geofield_command import run_geofield


class Visitor:
    """Sends requests with exactly the headers that are said."""

    def __init__(self, server: ReviewServer) -> None:
        self.server = server
        self.host = f"127.0.0.1:{server.server_port}"
        self.cookie = server.guard.cookie_header().split(";")[0]

    def ask(
        self, method: str, path: str, body: bytes | None = None, **headers: str
    ) -> tuple[int, dict[str, str], bytes]:
        connection = http.client.HTTPConnection("127.0.0.1", self.server.server_port, timeout=10)
        connection.putrequest(method, path, skip_host=True)
        sent = {"Host": self.host, **{k.replace("_", "-"): v for k, v in headers.items()}}
        if body is not None and "Content-Length" not in sent:
            sent["Content-Length"] = str(len(body))
        for name, value in sent.items():
            connection.putheader(name, value)
        connection.endheaders(body)
        answer = connection.getresponse()
        found = answer.status, dict(answer.getheaders()), answer.read()
        connection.close()
        return found

    def post(self, path: str, value: Any, **headers: str) -> tuple[int, Any]:
        keys = {"Cookie": self.cookie, "X_Geofield_Token": self.server.guard.token}
        given = {**keys, "X_Geofield_Tab": "one", **headers}
        body = value if isinstance(value, bytes) else json.dumps(value).encode()
        status, _, data = self.ask("POST", path, body, **given)
        return status, json.loads(data)


@pytest.fixture
def visitor(plan_path: Path) -> Iterator[Visitor]:
    server = ReviewServer()
    server.load(lambda: Shelf(plan_path))
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    yield Visitor(server)
    server.shutdown()
    server.server_close()
    thread.join()


def test_the_page_is_there_before_the_plan_is_read(plan_path: Path) -> None:
    server = ReviewServer()
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    visitor = Visitor(server)
    answers: list[int] = []
    asking = threading.Thread(
        target=lambda: answers.append(visitor.ask("GET", "/api/state", Cookie=visitor.cookie)[0])
    )
    asking.start()
    assert visitor.ask("GET", "/web/vendor/ol.js", Cookie=visitor.cookie)[0] == 200
    assert not answers
    server.load(lambda: Shelf(plan_path))
    asking.join(20)
    assert answers == [200]
    server.shutdown()
    server.server_close()


def test_a_plan_that_cannot_be_read_is_told_to_the_page(tmp_path: Path) -> None:
    server = ReviewServer()
    threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
    with pytest.raises(GeofieldError, match="no plan"):
        server.load(lambda: Shelf(tmp_path))
    visitor = Visitor(server)
    status, _, body = visitor.ask("GET", "/api/state", Cookie=visitor.cookie)
    assert (status, "no plan" in json.loads(body)["message"]) == (422, True)
    server.shutdown()
    server.server_close()


def test_no_page_is_opened_on_a_folder_without_a_plan(tmp_path: Path) -> None:
    (tmp_path / "other.gpkg").write_bytes(b"no plan")
    done = run_geofield("review", tmp_path, "--no-browser", timeout_s=60)
    assert done.returncode == 1
    assert "holds no plan of geofield" in done.stderr
    assert not done.stdout
    for content, told in ((b"", "is empty (0 bytes)"), (b"text", "is not a GeoPackage")):
        (file := tmp_path / "field.gpkg").write_bytes(content)
        done = run_geofield("review", file, "--no-browser", timeout_s=60)
        assert told in done.stderr
        assert not done.stdout  # no address
    assert done.stdout == ""


def test_only_the_printed_address_opens(visitor: Visitor) -> None:
    token = visitor.server.guard.token
    assert visitor.ask("GET", "/")[0] == 403
    assert visitor.ask("GET", "/?token=guess")[0] == 403
    assert visitor.ask("GET", f"/?token={token}", Host="evil.example")[0] == 403
    status, headers, _ = visitor.ask("GET", f"/?token={token}")
    assert (status, headers["Location"]) == (303, "/")
    assert "HttpOnly" in headers["Set-Cookie"]
    assert "SameSite=Strict" in headers["Set-Cookie"]
    status, headers, body = visitor.ask("GET", "/", Cookie=visitor.cookie)
    assert status == 200
    assert b"<title>geofield review" in body
    assert headers["Content-Security-Policy"].startswith("default-src 'self'")


def test_strangers_change_nothing(visitor: Visitor) -> None:
    edit = {"do": "status", "no": 3, "status": "rejected"}
    visitor.post("/api/take", {})
    before = visitor.server.shelf.desk.session.step
    # A name that was pointed at this machine, another site's page, no cookie, no key, wrong key.
    for wrong in (
        {"Host": "evil.example"},
        {"Host": f"evil.example:{visitor.server.server_port}"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Cookie": ""},
        {"X_Geofield_Token": ""},
        {"X_Geofield_Token": "guess"},
        {"X_Geofield_Token": "ü"},
    ):
        headers = {k: v.encode("utf-8").decode("latin-1") for k, v in wrong.items()}
        assert visitor.post("/api/edit", edit, **headers)[0] == 403, wrong
    assert visitor.server.shelf.desk.session.step is before
    assert visitor.post("/api/edit", edit)[0] == 200
    assert visitor.server.shelf.desk.session.step is not before


def test_odd_requests_get_an_answer_in_words(visitor: Visitor) -> None:
    visitor.post("/api/take", {})
    assert visitor.post("/api/edit", b"[1, 2]")[0] == 400
    assert visitor.post("/api/edit", b"\xff{")[0] == 400
    assert visitor.post("/api/edit", b"[" * 100_000)[0] == 400
    assert visitor.post("/api/nothing", {})[0] == 404
    assert visitor.post("/api/edit", {}, Content_Length=str(MOST_BYTES + 1))[0] == 413
    assert visitor.post("/api/edit", {}, Content_Length="-1")[0] == 413
    assert visitor.post("/api/edit", {}, Content_Length="\xb2")[0] == 413  # a digit, no number
    # Values of every wrong kind are refused in words, and the connection is not cut.
    for edit in (
        {"do": ["status"]},
        {"do": "status", "no": 3, "status": ["rejected"]},
        {"do": "status", "no": 3, "status": None},
        {"do": "polygon", "ring": {"0": [1, 2]}},
        {"do": "outline", "rings": [[1, 2, 3]]},
        {"do": "outline", "rings": [["ab", "cd", "ef"]]},
        {"do": "outline", "rings": [5]},
        {"do": "choose", "no": 10**30},
        {"do": "choose", "no": -1},
        {"do": "circle", "x": 10**400, "y": 0, "radius_m": 2},
        {"do": "move", "no": 3, "dx_m": 1e308, "dy_m": 1e308},
        {"do": "direction", "a": None, "b": [0, 0]},
        {"do": "direction", "a": [1e300, 1e300], "b": [0, 0]},
        {"do": "tracks", "settings": {"spacing_m": "wide"}},
        {"do": "tracks", "settings": {"spacing_m": 1e-9}},
        {"do": "tracks", "settings": {"direction": [5]}},
        {"do": "ground", "place": "ab"},
        {"do": "ground", "place": [1e300, 0]},
    ):
        for request in ("/api/edit", "/api/preview"):
            status, answer = visitor.post(request, edit)
            assert (status, bool(answer["message"])) == (422, True), (edit, answer)
    status, answer = visitor.post("/api/edit", {"do": "status", "no": 77, "status": "rejected"})
    assert (status, answer["message"]) == (422, "There is no obstacle 77.")
    for path in (
        "/../desk.py",
        "/%2e%2e/desk.py",
        "/web/vendor/../../desk.py",
        "/etc/passwd",
        "//x/",
    ):
        assert visitor.ask("GET", path, Cookie=visitor.cookie)[0] == 404
    for path in (
        "/tile/colour/0/99/0/0",
        "/tile/colour/0/0/-1/0",
        "/tile/colour/7/0/0/0",
        "/tile/x",
    ):
        assert visitor.ask("GET", f"/tile/{path}", Cookie=visitor.cookie)[0] == 404


def test_a_second_tab_is_told(visitor: Visitor) -> None:
    edit = {"do": "status", "no": 3, "status": "rejected"}
    assert visitor.post("/api/take", {})[1] == {"yours": True}
    assert visitor.post("/api/take", {}, X_Geofield_Tab="two")[1] == {"yours": False}
    status, answer = visitor.post("/api/edit", edit, X_Geofield_Tab="two")
    assert (status, answer["message"]) == (422, "Another tab is editing this plan.")
    assert visitor.post("/api/take", {"force": True}, X_Geofield_Tab="two")[1] == {"yours": True}
    assert visitor.post("/api/edit", edit, X_Geofield_Tab="two")[0] == 200
    assert visitor.post("/api/edit", edit)[0] == 422


def test_an_edit_of_a_state_that_is_no_more_is_refused(plan_path: Path, tmp_path: Path) -> None:
    folder = tmp_path / "Schlag #7 50%"  # no plan was found in such a folder
    folder.mkdir()
    for name in ("a.gpkg", "b.gpkg"):
        shutil.copy(plan_path, folder / name)
    server = ReviewServer()
    shelf = server.load(lambda: Shelf(folder))
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    page = Visitor(server)
    try:
        page.post("/api/take", {})
        seen = shelf.desk.stamp
        edit = {"do": "status", "no": 3, "status": "rejected"}
        status, answer = page.post("/api/edit", edit, X_Geofield_Seen=seen)
        assert (status, answer["stamp"]) == (200, shelf.desk.stamp)
        # A doubled tab has the name of the first one, and what that one showed.
        assert page.post("/api/edit", {"do": "undo"}, X_Geofield_Seen=seen)[0] == 422
        assert page.post("/api/open", {"plan": 1})[0] == 200
        seen = answer["stamp"]
        status, answer = page.post("/api/edit", edit, X_Geofield_Seen=seen)
        assert status == 422
        assert answer["other_tab"]
        assert not shelf.desk.session.edited
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def test_a_plan_that_was_deleted_or_broken_is_told_and_edits_stay(
    visitor: Visitor, plan_path: Path
) -> None:
    visitor.post("/api/take", {})
    edit = {"do": "status", "no": 3, "status": "rejected"}
    assert visitor.post("/api/edit", edit)[0] == 200
    whole = plan_path.read_bytes()
    plan_path.unlink()
    for request in ("/api/save", "/api/reload"):
        status, answer = visitor.post(request, {})
        assert (status, "not there any more" in answer["message"]) == (422, True)
    plan_path.write_bytes(b"half a download")
    assert visitor.post("/api/reload", {})[0] == 422
    # The other program's file is not taken for the one that was opened.
    assert visitor.post("/api/save", {})[0] == 409
    assert visitor.post("/api/edit", {**edit, "no": 4})[0] == 200
    plan_path.write_bytes(whole)
    again = Desk(plan_path)
    assert again.brought_back == "2 edits of a session that ended without saving were brought back."


def test_a_name_that_no_file_can_have_is_refused_in_words(visitor: Visitor) -> None:
    """That of 300 letters was an error of the server, with the whole path."""
    visitor.post("/api/take", {})
    for name in ("x" * 300, "\u00fc" * 120, "x" * 245):
        status, answer = visitor.post("/api/save", {"name": name})
        assert (status, answer["message"]) == (422, "That name is too long for a file.")
    name = "x" * 214
    assert visitor.post("/api/save", {"name": name})[1]["saved_as"] == f"{name}.gpkg"


def test_a_plan_in_capitals_is_saved_under_another_name(plan_path: Path) -> None:
    """Its edits could not be saved, and why was told in the words of a database."""
    named = plan_path.rename(plan_path.with_name("Field.GPKG"))
    words = "is not named as a plan, NAME.gpkg: save under another name."
    server = ReviewServer()
    desk = server.load(lambda: Shelf(named)).desk
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    page = Visitor(server)
    try:
        assert desk.opening()["brought_back"] == f"Field.GPKG {words}"
        page.post("/api/take", {})
        page.post("/api/edit", {"do": "status", "no": 3, "status": "rejected"})
        status, answer = page.post("/api/save", {})
        assert (status, "is not a GeoPackage name." in answer["message"]) == (422, True)
        assert page.post("/api/save", {"name": "mine"})[1]["saved_as"] == "mine.gpkg"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
    saved = read_plan(plan_path.with_name("mine.gpkg")).obstacles
    assert saved is not None
    assert saved.set_index("obstacle_no").loc[3, "status"] == "rejected"


def test_ground_off_the_picture_is_refused_as_everything_there_is(
    visitor: Visitor, plan_path: Path
) -> None:
    """The page spoke of an option of the command, in English."""
    visitor.post("/api/take", {})
    left, bottom, _, _ = Desk(plan_path).opening()["bounds"]
    ground = {"do": "ground", "place": [left - 20, bottom - 20], "belongs": True}
    status, answer = visitor.post("/api/edit", ground)
    assert (status, answer["message"]) == (422, "That place lies outside the picture.")


def test_no_session_is_ended_from_the_page_whose_edits_lie_nowhere(
    visitor: Visitor, plan_path: Path
) -> None:
    plan_path.with_name("field.gpkg.review.jsonl").mkdir()  # takes no notes, as a full disk
    visitor.post("/api/take", {})
    edit = {"do": "status", "no": 3, "status": "rejected"}
    assert visitor.post("/api/edit", edit)[1]["unnoted"]
    status, answer = visitor.post("/api/stop", {})
    assert (status, "would be lost" in answer["message"]) == (422, True)
    assert visitor.post("/api/save", {"name": "mine"})[0] == 200
    # It lies under the other name, and is noted nowhere.
    assert visitor.post("/api/stop", {}) == (200, {"stopped": True, "noted": False})


def test_who_ends_a_session_learns_that_what_was_not_saved_waits(visitor: Visitor) -> None:
    """The page said that the session has ended, and left open whether the edits had."""
    visitor.post("/api/take", {})
    edit = {"do": "status", "no": 3, "status": "rejected"}
    assert visitor.post("/api/edit", edit)[0] == 200
    assert visitor.post("/api/stop", {}) == (200, {"stopped": True, "noted": True})


def test_what_nobody_foresaw_is_told_in_words(
    visitor: Visitor, monkeypatch: pytest.MonkeyPatch
) -> None:
    visitor.post("/api/take", {})
    monkeypatch.setattr(Desk, "export", lambda *_: 1 / 0)
    status, answer = visitor.post("/api/export", {"format": "geojson"})
    assert (status, "division by zero" in answer["message"]) == (500, True)


def test_tiles_are_the_pictures_own_pixels(plan_path: Path) -> None:
    scene = plan_path.with_name("scene.tif")
    with rasterio.open(scene) as data:
        pixels, crs = np.moveaxis(data.read([1, 2, 3]), 0, -1), data.crs
    picture = TiledPicture.open(scene, Desk(plan_path).session.plan.field.crs)
    assert picture.direct
    assert picture.resolutions_m[-1] == pytest.approx(0.6)
    data, kind = picture.tile(len(picture.resolutions_m) - 1, 0, 0, "colour")
    # 480 px of picture in a tile of 512: what is not picture is transparent.
    assert kind == "image/png"
    shown = np.asarray(Image.open(io.BytesIO(data)))
    assert shown.shape == (TILE_PX, TILE_PX, 4)
    np.testing.assert_array_equal(shown[:480, :480, :3], pixels)
    assert (shown[:480, :480, 3] == 255).all()
    assert not shown[480:, :, 3].any()
    assert crs is not None


def test_a_picture_in_another_crs_lies_in_the_same_place(plan_path: Path, tmp_path: Path) -> None:
    """Warped to Web Mercator and shown in the plan's zone, it covers the original."""
    plain = plan_path.with_name("scene.tif")
    other = tmp_path / "mercator.tif"
    with rasterio.open(plain) as data:
        made, width, height = calculate_default_transform(
            data.crs, "EPSG:3857", data.width, data.height, *data.bounds
        )
        profile = {**data.profile, "crs": "EPSG:3857", "transform": made}
        profile |= {"width": width, "height": height, "driver": "GTiff", "nodata": 0}
        with rasterio.open(other, "w", **profile) as out:
            for band in range(1, data.count + 1):
                target = np.zeros((height, width), np.uint8)
                reproject(
                    data.read(band),
                    target,
                    src_transform=data.transform,
                    src_crs=data.crs,
                    dst_transform=made,
                    dst_crs="EPSG:3857",
                    resampling=Resampling.cubic,
                )
                out.write(target, band)
    crs = Desk(plan_path).session.plan.field.crs
    here, there = TiledPicture.open(plain, crs), TiledPicture.open(other, crs)
    assert not there.direct
    assert there.resolutions_m[-1] == pytest.approx(0.6, rel=0.01)
    tile, _ = there.tile(len(there.resolutions_m) - 1, 0, 0, "colour")
    shown = np.asarray(Image.open(io.BytesIO(tile)).convert("RGB"))[100:400, 100:400].astype(float)
    tile, _ = here.tile(len(here.resolutions_m) - 1, 0, 0, "colour")
    own = np.asarray(Image.open(io.BytesIO(tile)).convert("RGB")).astype(float)
    # The corner and the pixel size differ a little: find the shift that fits best.
    left = (there.bounds[0] - here.bounds[0]) / 0.6
    top = (here.bounds[3] - there.bounds[3]) / 0.6
    scale = there.resolutions_m[-1] / 0.6
    at = np.arange(100, 400)
    columns = np.rint(left + (at + 0.5) * scale - 0.5).astype(int)
    rows = np.rint(top + (at + 0.5) * scale - 0.5).astype(int)
    error = np.abs(shown - own[np.ix_(rows, columns)]).mean()
    shifted = np.abs(shown - own[np.ix_(rows + 2, columns)]).mean()
    assert error < 4.0
    assert error < 0.6 * shifted
