"""Who is refused is told the next step."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import geofield
from geofield import errors
from geofield_command import run_geofield

PACKAGE = Path(geofield.__file__).parent
#: Where every error that geofield raises on purpose says it.
ROOMS = ("farm", "formats", "schema", "staging")
FIELD = "2026-11-29\n$FieldDir\nNorth\n$Offsets\n0,0\nStartFix\n52.1,8.2\n"


def without_hint(tree: ast.Module) -> Iterator[int]:
    """The lines on which an error of geofield is made that has a message alone."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or any(each.arg == "hint" for each in node.keywords):
            continue
        # One of two kinds, perhaps, as the case may be.
        names = (part.id for part in ast.walk(node.func) if isinstance(part, ast.Name))
        kinds: list[Any] = [getattr(errors, name, None) for name in names]
        if any(isinstance(one, type) and issubclass(one, errors.GeofieldError) for one in kinds):
            yield node.lineno


@pytest.mark.parametrize("room", ROOMS)
def test_every_error_has_a_hint(room: str) -> None:
    found = {
        f"{file.relative_to(PACKAGE)}:{line}"
        for file in (PACKAGE / room).rglob("*.py")
        for line in without_hint(ast.parse(file.read_text(encoding="utf-8")))
    }
    assert found == set()


@pytest.mark.parametrize(
    ("files", "words", "hint"),
    [
        ({"Field.txt": "North\n"}, "has no StartFix", "copy its whole folder again"),
        (
            {"Field.txt": FIELD, "Boundary.txt": "$Boundary\nFalse\n5\n0,0,0\n"},
            "breaks off or is damaged in ring 1",
            "copy its whole folder again",
        ),
        (
            {"TASKDATA/TASKDATA.XML": '<ISO11783_TaskData VersionMajor="4"/>'},
            "holds no field (PFD)",
            "Export the field with the task data",
        ),
        ({"trees.csv": "lat,lon,kind,kind\n52,8,a,b\n"}, "two columns 'kind'", "Rename one"),
        (
            {"TASKDATA/TASKDATA.XML": '<ISO11783_TaskData><XFR A="PFD00001"/></ISO11783_TaskData>'},
            "lacks PFD00001.XML",
            "Copy the whole folder TASKDATA",
        ),
    ],
    ids=["no start", "half a ring", "no field", "columns alike", "half of the task data"],
)
def test_a_damaged_file_is_told_with_what_helps(
    tmp_path: Path, files: dict[str, str], words: str, hint: str
) -> None:
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    done = run_geofield("import", tmp_path, "-o", tmp_path / "plan.gpkg")
    assert done.returncode == 1
    assert words in done.stderr
    assert hint in " ".join(done.stderr.split())
