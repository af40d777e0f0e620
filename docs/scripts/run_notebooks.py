"""Run the notebooks and keep their outputs: NAME.py (text, in version control) to NAME.ipynb.

python docs/scripts/run_notebooks.py [NAME...]
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = ROOT / "notebooks"
_KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def sources() -> list[Path]:
    """The notebooks as text, in their order."""
    return sorted(NOTEBOOKS.glob("[0-9]*.py"))


def read_source(path: Path) -> Any:
    """The notebook that a text describes, with nothing but cells and a kernel."""
    import jupytext

    notebook = jupytext.read(path, fmt="py:percent")
    notebook.metadata = {"kernelspec": dict(_KERNEL), "language_info": {"name": "python"}}
    for index, cell in enumerate(notebook.cells):
        # The same ids every time: a run changes only what a run changed.
        cell.id = f"cell-{index}"
    return notebook


def execute(notebook: Any, folder: Path, timeout_s: int = 900) -> Any:
    """Run all cells of a notebook in a folder, in a kernel of this very Python."""
    from nbclient import NotebookClient

    os.environ["PYTHONPATH"] = str(ROOT / "src")
    os.environ.setdefault("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    client = NotebookClient(
        notebook, timeout=timeout_s, kernel_name="python3", resources={"metadata": {"path": folder}}
    )
    return client.execute()


def without_times(notebook: Any) -> Any:
    """A notebook without the clock times that would change with every run."""
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
    return notebook


def main() -> int:
    import nbformat

    parser = argparse.ArgumentParser(description="Run notebooks and keep their outputs.")
    parser.add_argument("names", nargs="*", help="parts of names; all when not given")
    names = parser.parse_args().names
    for path in sources():
        if names and not any(name in path.stem for name in names):
            continue
        start = time.perf_counter()
        notebook = execute(read_source(path), NOTEBOOKS)
        target = path.with_suffix(".ipynb")
        nbformat.write(without_times(notebook), target)
        size_kb = target.stat().st_size / 1024
        print(f"{path.stem}: {time.perf_counter() - start:.1f} s, {size_kb:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
