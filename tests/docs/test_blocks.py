"""Every code block of the documentation runs and prints what the page says."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from geofield_command import asked

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs" / "scripts"))

import blocks  # noqa: E402

PAGES = blocks.pages()
#: One after another: a page that starts a cluster names its port.
IN_TURN = pytest.mark.xdist_group("cluster of the documentation")


#: Here the command starts from nothing, as a reader's does; loaded once, it takes half the time.
FROM_NOTHING = ("README.md", "docs/tutorial.md", "docs/how-to/install.md")


@pytest.fixture(scope="session")
def loaded() -> Iterator[list[str]]:
    with asked() as program:
        yield program


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[IN_TURN] if "--scheduler" in page.read_text("utf-8") else [])
        for page in PAGES
    ],
    ids=lambda page: str(page.relative_to(ROOT)),
)
def test_blocks_run(page: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    shared = request.getfixturevalue("shared") if blocks.needs_shared(page) else None
    nothing = str(page.relative_to(ROOT)) in FROM_NOTHING
    program = blocks.COMMAND if nothing else request.getfixturevalue("loaded")
    assert blocks.run_pages([page], tmp_path, shared, program=program) > 0


def test_the_pages_of_beginners_are_there() -> None:
    assert {str(page.relative_to(ROOT)) for page in PAGES} > set(FROM_NOTHING)


@pytest.mark.slow
@IN_TURN
def test_a_reader_goes_through_all_of_them_in_one_folder(tmp_path: Path, loaded: list[str]) -> None:
    names = [page.relative_to(blocks.DOCS).as_posix() for page in blocks.course()]
    assert names[0] == "tutorial.md"
    how_to = {page for page in PAGES if page.parent.name == "how-to"}
    assert len(how_to) > 8
    assert how_to < set(blocks.course())
    shared = blocks.real_data()
    course = [page for page in blocks.course() if shared or not blocks.needs_shared(page)]
    assert blocks.run_pages(course, tmp_path, shared, program=loaded) > 40


def test_a_file_of_settings_grows_from_page_to_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(blocks, "ROOT", tmp_path)
    for name in ("one", "two"):
        (tmp_path / f"{name}.md").write_text(
            f'```toml title="words.toml"\n{name} = 1\n```\n\n```bash\ngrep {name} words.toml\n```\n'
        )
    (tmp_path / "three.md").write_text("```bash\ngrep one words.toml\n```\n")
    order = [tmp_path / f"{name}.md" for name in ("one", "two", "three")]
    assert blocks.run_pages(order, tmp_path / "a") == 3
    with pytest.raises(blocks.BlockError, match=r"three\.md, line 1"):
        blocks.run_pages(order[1:], tmp_path / "b")


def test_a_wrong_output_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocks, "ROOT", tmp_path)
    page = tmp_path / "page.md"
    page.write_text('```python\nprint(1 + 1)\n```\n\n```text title="Output"\n3\n```\n')
    with pytest.raises(blocks.BlockError, match="line 1 prints"):
        blocks.run_pages([page], tmp_path / "a")
    blocks.run_pages([page], tmp_path / "b", update=True)
    assert page.read_text().endswith('title="Output"\n2\n```\n')
    blocks.run_pages([page], tmp_path / "c")


def test_a_failing_command_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blocks, "ROOT", tmp_path)
    page = tmp_path / "page.md"
    page.write_text("```bash\nfalse | cat\n```\n")
    with pytest.raises(blocks.BlockError, match="ends with 1"):
        blocks.run_pages([page], tmp_path / "a")


@pytest.mark.parametrize(
    ("title", "want", "got", "same"),
    [
        ("Output", "12 trees", "12 trees\n", True),
        ("Output", "12 trees", "13 trees\n", False),
        ("Output", "... trees", "13 trees\n", True),
        ("For example", "12.5 m in 3 s", "11.25 m in 4 s\n", True),
        ("For example", "12.5 m in 3 s", "11.25 km in 4 s\n", False),
    ],
)
def test_agreement(title: str, want: str, got: str, same: bool) -> None:
    block = blocks.Block("text", title, want, 0, 0, 1)
    assert blocks.agrees(block, got) is same
