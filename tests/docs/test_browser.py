"""Every page of the documentation in a real browser, at phone and desktop width."""

from __future__ import annotations

import functools
import json
import queue
import shutil
import subprocess
import threading
from collections.abc import Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.browser, pytest.mark.xdist_group("site")]

WIDTHS_PX = {"phone": 390, "desktop": 1440}

# Frames of a chosen width in one page: a window cannot be as narrow as a phone everywhere.
HARNESS = """<!doctype html><meta charset="utf-8"><body><script>
const todo = %s, found = [];
async function look(page, name, width) {
  const frame = document.createElement("iframe");
  frame.style.cssText = `width:${width}px;height:900px;border:0`;
  frame.src = "/" + page;
  const loaded = new Promise(done => frame.onload = done);
  document.body.append(frame);
  await loaded;
  const inside = frame.contentDocument, root = inside.documentElement;
  const broken = [...inside.images].filter(i => i.complete && !i.naturalWidth).map(i => i.src);
  // Wide tables that a program printed may scroll; what a reader is to type may not.
  const cut = [...inside.querySelectorAll("pre > code")].filter(
    code => !code.closest(".language-text") && code.scrollWidth > code.clientWidth + 1
      && code.getClientRects().length);
  const longest = code => code.innerText.split("\\n").reduce((a, b) => b.length > a.length ? b : a);
  found.push({page, name, cut: name === "desktop" ? cut.map(longest) : [], broken,
              wide: root.scrollWidth, room: root.clientWidth,
              heading: inside.querySelector("h1")?.innerText || "",
              text: inside.querySelector("article")?.innerText.length || 0});
  frame.remove();
}
(async () => {
  for (const page of todo) for (const [name, width] of Object.entries(%s))
    await look(page, name, width);
  await fetch("/result", {method: "POST", body: JSON.stringify(found)});
})();
</script></body>"""


class _Handler(SimpleHTTPRequestHandler):
    """The site's files; the harness hands in what it saw."""

    def log_message(self, *_: Any) -> None:
        """Nothing."""

    server: Any

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(204)
        self.end_headers()
        self.server.results.put(json.loads(body))


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, folder: Path) -> None:
        super().__init__(("127.0.0.1", 0), functools.partial(_Handler, directory=str(folder)))
        self.results: queue.Queue[list[dict[str, Any]]] = queue.Queue()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that closes its frames early is no fault."""


@pytest.fixture(scope="module")
def server(site: Path) -> Iterator[_Server]:
    one = _Server(site)
    thread = threading.Thread(target=one.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    yield one
    one.shutdown()
    one.server_close()
    thread.join()


def _chromium() -> str:
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if path := shutil.which(name):
            return path
    pytest.skip("Chromium is not installed")


def test_pages_fit_phone_and_desktop(site: Path, server: _Server, tmp_path: Path) -> None:
    chromium = _chromium()
    pages = sorted(str(p.relative_to(site)) for p in site.rglob("*.html") if p.name != "404.html")
    harness = HARNESS % (json.dumps(pages), json.dumps(WIDTHS_PX))
    (site / "harness.html").write_text(harness, encoding="utf-8")
    browser = subprocess.Popen(
        [
            chromium,
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--remote-debugging-port=0",
            f"--user-data-dir={tmp_path / 'profile'}",
            "--window-size=1400,1000",
            f"http://127.0.0.1:{server.server_port}/harness.html",
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        found = server.results.get(timeout=240)
    finally:
        browser.terminate()
        browser.wait(20)
        (site / "harness.html").unlink()
    assert len(found) == len(pages) * len(WIDTHS_PX)
    problems = []
    for one in found:
        where = f"{one['page']} at {one['name']} width"
        if one["wide"] > one["room"]:
            problems.append(f"{where} scrolls sideways: {one['wide']} px in {one['room']}")
        problems += [f"{where} misses {picture}" for picture in one["broken"]]
        problems += [f"{where} cuts a block of code: {line}" for line in one["cut"]]
        if not one["heading"] or one["text"] < 100:
            problems.append(f"{where} is empty")
    assert not problems, "\n".join(problems)
