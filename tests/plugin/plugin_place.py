"""Where the plugin and the sample are."""

from __future__ import annotations

import hashlib
import textwrap
import zipfile
from pathlib import Path

CLIENT = Path(__file__).with_name("client.py")
ROOT = Path(__file__).parents[2]
PLUGINS = ROOT / "plugin"
SAMPLE = ROOT / "sample_data" / "field_1.tif"
POINT = "33.531142,35.075373 [EPSG:4326]"


def tiny_engine(folder: Path, main: str) -> tuple[Path, str]:
    """A wheel of the engine's name that does what a test needs, and its locked requirement.

    Parameters
    ----------
    main : str
        Lines of Python that are the command.
    """
    wheel, meta = folder / "geofield-0.1.0-py3-none-any.whl", "geofield-0.1.0.dist-info"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("tiny_engine.py", f"def main():\n{textwrap.indent(main, '    ')}\n")
        archive.writestr(
            f"{meta}/entry_points.txt", "[console_scripts]\ngeofield = tiny_engine:main\n"
        )
        archive.writestr(
            f"{meta}/METADATA", "Metadata-Version: 2.1\nName: geofield\nVersion: 0.1.0\n"
        )
        archive.writestr(
            f"{meta}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        archive.writestr(f"{meta}/RECORD", "")
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    return wheel, f"--no-index\ngeofield==0.1.0 --hash=sha256:{digest}\n"
