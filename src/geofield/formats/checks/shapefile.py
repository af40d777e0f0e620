"""What makes a Shapefile whole."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from geofield.formats.foreign import files_in
from geofield.formats.validation import Finding

_PARTS: dict[str, tuple[Literal["error", "warning"], str]] = {
    ".shx": ("error", "the index"),
    ".dbf": ("error", "the attributes"),
    ".prj": ("warning", "the CRS: readers will guess"),
    ".cpg": ("warning", "the encoding: accents may break"),
}
_SHAPE_FILE_CODE = b"\x00\x00\x27\x0a"


def check(path: Path) -> Iterator[Finding]:
    """Findings in a Shapefile, or in all of a folder."""
    for file in files_in(path, ".shp"):
        beside = {other.name.lower() for other in file.parent.iterdir()}
        for suffix, (level, what) in _PARTS.items():
            if f"{file.stem}{suffix}".lower() not in beside:
                yield Finding(level, file.name, f"{file.stem}{suffix} is missing: {what}")
        with file.open("rb") as content:
            header = content.read(28)
        if len(header) < 28 or header[:4] != _SHAPE_FILE_CODE:
            yield Finding("error", file.name, "not a Shapefile")
        elif int.from_bytes(header[24:28], "big") * 2 != file.stat().st_size:
            yield Finding("error", file.name, "it is shorter or longer than its header says")
