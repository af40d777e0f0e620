"""The command and its workers with all of geofield loaded, for `geofield_command`.

It has one thread of Python and starts none before it forks. The other one that it has, of
pyarrow's allocator, knows of forks.
"""

from __future__ import annotations

import gc
import importlib
import os
import pkgutil
import sys
from pathlib import Path

from fork_server import served

#: The word for a process that plans fields for `batch`.
WORKER = "a worker"
_ASKS = Path(__file__).with_name("asked_command.py")

#: What geofield loads when it needs it, for most commands.
LIBRARIES = (
    "pyarrow.compute", "pyarrow.pandas_compat", "pyarrow.parquet", "pyogrio.geopandas",
    "rasterio.features", "rdflib", "skimage.draw", "skimage.filters", "skimage.measure",
    "skimage.morphology", "skimage.segmentation", "PIL.PngImagePlugin",
)  # fmt: skip


def load() -> None:
    """All modules of geofield and what most commands use."""
    # As the command tells it before it loads NumPy.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    import geofield

    own = [each.name for each in pkgutil.walk_packages(geofield.__path__, "geofield.")]
    for name in (*own, *LIBRARIES):
        if not name.endswith("__main__"):
            importlib.import_module(name)
    # Neither looked through nor copied in each of the processes.
    gc.collect()
    gc.freeze()


def main() -> None:
    """Load, and run the command in a process of its own each time."""
    load()
    address = sys.argv[2]
    words = served()
    if words is None:
        return
    # A stream asks once whether one can seek in what it leads to: that is another thing now.
    sys.stdout = open(1, "w", encoding=sys.stdout.encoding, closefd=False)  # noqa: SIM115
    from geofield.cli import main as command
    from geofield.farm import pool, worker

    if words == [WORKER]:
        worker.main()
    else:
        pool.PROGRAM = (sys.executable, "-ES", str(_ASKS), address, WORKER)
        sys.argv[:] = ["geofield", *words]
        command()


if __name__ == "__main__":
    main()
