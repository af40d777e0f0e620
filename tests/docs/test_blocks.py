"""Every code block of the documentation runs and prints what the page says."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from geofield.settings import load_settings
from geofield_command import asking

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs" / "scripts"))

import blocks  # noqa: E402

PAGES = blocks.pages()

#: Here the command starts from nothing, as a reader's does; loaded once, it takes half the time.
FROM_NOTHING = ("README.md", "docs/tutorial.md", "docs/how-to/install.md")


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    PAGES,
    ids=lambda page: str(page.relative_to(ROOT)),
)
def test_blocks_run(page: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    shared = request.getfixturevalue("shared") if blocks.needs_shared(page) else None
    nothing = str(page.relative_to(ROOT)) in FROM_NOTHING
    program = blocks.COMMAND if nothing else asking()
    assert blocks.run_pages([page], tmp_path, shared, program=program) > 0
    left = {each.name.split(".")[0] for each in (tmp_path / "geofield").iterdir()}
    assert page not in blocks.course() or left - {"sample_data", "geofield"} <= blocks.written(page)


def test_the_pages_of_beginners_are_there() -> None:
    assert {str(page.relative_to(ROOT)) for page in PAGES} > set(FROM_NOTHING)


def test_a_reader_can_go_through_all_of_them_in_one_folder(tmp_path: Path) -> None:
    course = blocks.course()
    assert course[0] == blocks.DOCS / "tutorial.md"
    how_to = {page for page in PAGES if page.parent.name == "how-to"}
    assert len(how_to) > 8
    assert how_to < set(course)
    # What each of them leaves is known by its names: see test_blocks_run.
    names = [name for page in course for name in blocks.written(page)]
    assert {name for name in names if names.count(name) > 1} == set()
    with (tmp_path / "geofield.toml").open("w") as file:
        for page in course:
            for block in blocks.read_blocks(page.read_text("utf-8")):
                file.write(block.body if block.title == "geofield.toml" else "")
    settings = load_settings(tmp_path / "geofield.toml")
    assert {"drill", "sprayer"} <= set(settings.machines)


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
