"""Build the plugin's zip, and the engine's wheel whose hash the zip carries.

    python plugin/package.py [FOLDER]       dist/ by default

The zip holds what the plugin site accepts: one folder, a licence, no binaries. Its requirements
name each file that may be installed by its hash, the engine's own wheel among them.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PLUGIN = ROOT / "plugin" / "geofield_qgis"
SUFFIXES = {".py", ".json", ".txt", ".svg", ".ts", ""}
#: Every file is dated so, that the same sources give the same zip.
DATE = (2020, 1, 1, 0, 0, 0)


def build(folder: Path) -> Path:
    """Build the wheel and the zip; returns the zip."""
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder.resolve())],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    wheel = max(folder.glob("geofield-*.whl"), key=lambda each: each.stat().st_mtime)
    version = wheel.name.split("-")[1]
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    locked = (ROOT / "requirements" / "run.txt").read_text(encoding="utf-8")
    requirements = f"{locked}\ngeofield=={version} \\\n    --hash=sha256:{digest}\n"
    metadata = (PLUGIN / "metadata.txt").read_text(encoding="utf-8") + _addresses()
    if f"\nversion={version}\n" not in metadata:
        raise SystemExit(f"metadata.txt does not say version={version}")
    target = folder / f"geofield_qgis-{version}.zip"
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for file in sorted(PLUGIN.rglob("*")):
            name = file.relative_to(PLUGIN.parent)
            if file.is_file() and file.suffix in SUFFIXES and "__pycache__" not in name.parts:
                whole = metadata.encode() if file.name == "metadata.txt" else file.read_bytes()
                _add(archive, str(name), whole)
        _add(archive, "geofield_qgis/requirements.txt", requirements.encode())
    return target


def _addresses() -> str:
    """Who to ask and where, as `pyproject.toml` says it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    author, urls = project["authors"][0], project["urls"]
    lines = {
        "author": author["name"],
        "email": author["email"],
        "homepage": urls["Homepage"],
        "repository": urls["Repository"],
        "tracker": urls["Issues"],
    }
    return "".join(f"{name}={value}\n" for name, value in lines.items())


def _add(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    info = zipfile.ZipInfo(name, DATE)
    info.external_attr = 0o644 << 16
    info.compress_type = zipfile.ZIP_DEFLATED
    archive.writestr(info, content)


if __name__ == "__main__":
    made = build(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "dist")
    print(made, f"{made.stat().st_size / 1000:.0f} kB")
