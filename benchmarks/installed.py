"""What an installation takes on the disk, by library: fresh environments from the package index.

python benchmarks/installed.py  (needs uv and the network, or a mirror of the index)
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from common import machine, write_page

ROOT = Path(__file__).resolve().parents[1]
CHOICES = {"core": "", "core and `plot`": "[plot]", "core and `batch`": "[batch]"}
#: Libraries that one sentence of the install page is about.
TOGETHER = {
    "pandas, GeoPandas": ("pandas", "geopandas", "python-dateutil", "six", "tzdata"),
    "scikit-image and what it brings": (
        "scikit-image",
        "networkx",
        "tifffile",
        "imageio",
        "lazy-loader",
    ),
    "pyoxigraph, rdflib": ("pyoxigraph", "rdflib", "pyparsing"),
}
SHOWN_MB = 5

# Run inside the new environment: bytes on the disk by distribution, libraries beside it included.
SIZES = """
import json
from importlib import metadata
sizes = {}
for one in metadata.distributions():
    files = {path.resolve() for path in map(one.locate_file, one.files or ()) if path.is_file()}
    name = one.metadata["Name"].lower().replace("_", "-")
    sizes[name] = sum(-(-path.stat().st_size // 4096) * 4096 for path in files)
print(json.dumps(sizes))
"""


def sizes(extra: str, folder: Path) -> dict[str, float]:
    """Megabytes by distribution of a fresh environment, without compiled bytecode."""
    home = folder / (extra.strip("[]") or "core")
    uv = Path(sys.executable).with_name("uv")
    subprocess.run([uv, "venv", "-q", "--python", sys.executable, home], check=True)
    python = home / "bin" / "python"
    project = f"geofield{extra} @ {ROOT.as_uri()}"
    install: list[str | Path] = [uv, "pip", "install", "-q", "--python", python, project]
    subprocess.run(install, check=True)
    found = subprocess.run(
        [python, "-B", "-c", SIZES], check=True, capture_output=True, text=True
    ).stdout
    return {name: size / 2**20 for name, size in json.loads(found).items()}


def main() -> None:
    """Measure, and write the page."""
    with tempfile.TemporaryDirectory() as folder:
        measured = {name: sizes(extra, Path(folder)) for name, extra in CHOICES.items()}
    rows = ["| installation | MB | libraries |", "| --- | --- | --- |"]
    for name, found in measured.items():
        rows.append(f"| {name} | {sum(found.values()):.0f} | {len(found)} |")
    groups = {one: group for group, members in TOGETHER.items() for one in members}
    parts: dict[str, float] = defaultdict(float)
    for name, size in measured["core"].items():
        parts[groups.get(name, name)] += size
    large = {name: size for name, size in parts.items() if size >= SHOWN_MB}
    rows += ["", "| library of the core | MB |", "| --- | --- |"]
    rows += [
        f"| {name} | {size:.0f} |" for name, size in sorted(large.items(), key=lambda x: -x[1])
    ]
    rest = sum(parts.values()) - sum(large.values())
    rows.append(f"| the other {len(parts) - len(large)} | {rest:.0f} |")
    write_page("installed", "What an installation takes", [*machine(), "", *rows])


if __name__ == "__main__":
    main()
