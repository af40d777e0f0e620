"""The notebooks run, and the committed ones are what their texts give."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import nbformat
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs" / "scripts"))

import run_notebooks  # noqa: E402

SOURCES = run_notebooks.sources()
REMEDY = "run `make notebooks`"


def _committed(source: Path) -> Any:
    return nbformat.read(source.with_suffix(".ipynb"), as_version=4)


def test_all_are_there_with_their_outputs() -> None:
    assert [path.stem[:2] for path in SOURCES] == ["01", "02", "03", "04", "05", "06", "07"]
    assert {path.stem for path in (ROOT / "notebooks").glob("*.ipynb")} == {
        path.stem for path in SOURCES
    }


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_committed_notebook_is_in_step(source: Path) -> None:
    text, committed = run_notebooks.read_source(source), _committed(source)
    wanted = [(cell.cell_type, cell.source) for cell in text.cells]
    assert [(cell.cell_type, cell.source) for cell in committed.cells] == wanted, REMEDY


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_committed_notebook_shows_its_results(source: Path) -> None:
    committed = _committed(source)
    nbformat.validate(committed)
    code = [cell for cell in committed.cells if cell.cell_type == "code"]
    assert all(cell.execution_count for cell in code), REMEDY
    outputs = [output for cell in code for output in cell.outputs]
    assert outputs
    for output in outputs:
        assert output.output_type != "error"
        assert output.get("name") != "stderr", output.get("text")
    assert source.with_suffix(".ipynb").stat().st_size < 600_000


def test_a_notebook_that_fell_behind_is_noticed() -> None:
    one = run_notebooks.read_source(SOURCES[0])
    one.cells[1].source += "\n# changed"
    committed = _committed(SOURCES[0])
    assert [cell.source for cell in one.cells] != [cell.source for cell in committed.cells]


@pytest.mark.slow
@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
# A kernel's start in another thread leaves sockets to the garbage collector.
@pytest.mark.filterwarnings("ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_notebook_runs(source: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    # All 51 fields are in the committed one.
    monkeypatch.setenv("EXPERIMENT_EVERY", "10")
    notebook = run_notebooks.execute(run_notebooks.read_source(source), ROOT / "notebooks")
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            assert output.get("name") != "stderr", output.get("text")
