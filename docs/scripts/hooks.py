"""Pages that are generated while the documentation is built, so that they cannot fall behind.

MkDocs calls :func:`on_files`; the pages are the command line's own help, the settings, the
layers of the schema, the measured benchmarks, the notebooks and the list of changes.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


def on_files(files: Any, config: Any) -> Any:
    """Add the generated pages to those that lie in the folder."""
    from mkdocs.structure.files import File

    # MkDocs restores the path after it has loaded a hook.
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    from pages import generated_pages

    for path, text in generated_pages(ROOT).items():
        files.append(File.generated(config, path, content=text))
    return files


def on_post_build(config: Any) -> None:
    """Put the notebooks beside the page that tells of them, to take away."""
    target = Path(config["site_dir"]) / "notebooks"
    target.mkdir(parents=True, exist_ok=True)
    for notebook in sorted((ROOT / "notebooks").glob("*.ipynb")):
        shutil.copyfile(notebook, target / notebook.name)
