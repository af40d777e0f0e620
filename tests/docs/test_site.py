"""The built documentation: no warning, no dead link, nothing fetched from elsewhere."""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

ROOT = Path(__file__).resolve().parents[2]


class _Links(HTMLParser):
    """Links, resources and anchors of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.resources: list[str] = []
        self.anchors: set[str] = set()
        self.pictures_without_words: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        for name in ("id", "name"):
            if values.get(name):
                self.anchors.add(str(values[name]))
        if tag == "a" and values.get("href"):
            self.links.append(str(values["href"]))
        if tag in ("script", "img", "source", "iframe") and values.get("src"):
            self.resources.append(str(values["src"]))
        if tag == "link" and values.get("rel") in ("stylesheet", "preload", "icon", "preconnect"):
            self.resources.append(str(values["href"]))
        if tag == "img" and not values.get("alt"):
            self.pictures_without_words.append(str(values.get("src")))


def _read(page: Path) -> _Links:
    parser = _Links()
    parser.feed(page.read_text(encoding="utf-8"))
    return parser


def _pages(site: Path) -> list[Path]:
    return sorted(site.rglob("*.html"))


pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("site")]


def test_no_dead_link(site: Path) -> None:
    parsed = {page: _read(page) for page in _pages(site)}
    assert len(parsed) > 20
    dead = []
    for page, found in parsed.items():
        if page.name == "404.html":
            continue  # its links start at the address the site will have
        for link in [*found.links, *found.resources]:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            if target.is_dir():
                target /= "index.html"
            known = target in parsed
            if not target.is_file():
                dead.append(f"{page.relative_to(site)}: {link}")
            elif known and parts.fragment and unquote(parts.fragment) not in parsed[target].anchors:
                dead.append(f"{page.relative_to(site)}: {link} (no such anchor)")
    assert not dead, "\n".join(dead)


def test_nothing_is_fetched_from_elsewhere(site: Path) -> None:
    for page in _pages(site):
        for resource in _read(page).resources:
            assert not urlsplit(resource).netloc, f"{page.relative_to(site)}: {resource}"


def test_every_picture_has_words(site: Path) -> None:
    for page in _pages(site):
        assert not _read(page).pictures_without_words, page.relative_to(site)


def test_every_command_and_setting_is_in_the_reference(site: Path) -> None:
    from geofield.cli.main import COMMANDS
    from geofield.settings import SECTIONS, Settings

    commands = (site / "reference" / "cli" / "index.html").read_text(encoding="utf-8")
    for name in COMMANDS:
        assert f'id="geofield-{name}"' in commands
    settings = (site / "reference" / "settings" / "index.html").read_text(encoding="utf-8")
    for section in SECTIONS:
        model = Settings.model_fields[section].annotation
        assert model is not None
        for name in model.model_fields:
            assert f"{section}.{name}" in settings


def test_committed_pictures_and_notebooks_are_small() -> None:
    files = [
        path for folder in ("docs", "notebooks") for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    ]  # fmt: skip
    assert sum(path.stat().st_size for path in files) < 8_000_000
    assert all(path.stat().st_size < 600_000 for path in files)
