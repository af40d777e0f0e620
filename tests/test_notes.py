"""What geofield tells beside a result reaches whoever asked for that work, and nobody else."""

from __future__ import annotations

import json
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from pathlib import Path
from typing import Any

import pytest

from geofield.errors import FieldWarning, FormatWarning
from geofield.formats import read_dataset
from geofield.notes import listening, warn
from geofield.review.desk import Desk
from geofield_command import run_geofield

SAMPLE = Path(__file__).parents[1] / "sample_data" / "field_1.tif"


def test_notes_are_warnings_of_python_where_nobody_listens() -> None:
    with pytest.warns(FieldWarning, match="a word") as heard:
        warn("a word", FieldWarning)
    assert [Path(one.filename).name for one in heard] == ["test_notes.py"]


def test_a_warning_names_the_line_that_called_geofield_however_deep_it_arose(
    tmp_path: Path,
) -> None:
    tree = {"type": "Point", "coordinates": [33.53, 35.07]}
    file = tmp_path / "trees.geojson"
    file.write_text(json.dumps({"type": "Feature", "properties": {}, "geometry": tree}))
    with pytest.warns(FormatWarning, match="no radius") as heard:
        read_dataset(file)
    assert [Path(one.filename).name for one in heard] == ["test_notes.py"]


def test_only_the_kind_that_is_listened_to_is_heard() -> None:
    with listening() as all_of_it:
        with listening(FormatWarning) as formats:
            warn("of a format", FormatWarning)
            warn("of a field", FieldWarning)
        warn("of a format, later", FormatWarning)
    assert list(map(str, formats)) == ["of a format"]
    assert [(type(one), str(one)) for one in all_of_it] == [
        (FieldWarning, "of a field"),
        (FormatWarning, "of a format, later"),
    ]


def test_a_thread_is_heard_in_a_copy_of_the_context_alone() -> None:
    def in_a_thread(*work: Any) -> None:
        thread = threading.Thread(target=work[0], args=work[1:])
        thread.start()
        thread.join()

    with listening() as heard:
        in_a_thread(copy_context().run, warn, "from here", FieldWarning)
        with pytest.warns(FieldWarning, match="from elsewhere"):
            in_a_thread(warn, "from elsewhere", FieldWarning)
    assert list(map(str, heard)) == ["from here"]


def test_each_thread_hears_its_own() -> None:
    """Of fields planned by several threads of one worker nine notes in ten were told of another."""
    at_once = threading.Barrier(3, timeout=10)

    def work(name: str) -> list[str]:
        with listening() as heard:
            for _ in range(5):
                at_once.wait()
                warn(name, FieldWarning)
            at_once.wait()
        return list(map(str, heard))

    names = ("North", "South", "West")
    with ThreadPoolExecutor(3) as threads:
        heard = list(threads.map(work, names))
    assert heard == [[name] * 5 for name in names]


def test_notes_arrive_while_others_record_warnings_of_their_own() -> None:
    """Two in three could be lost: Python records warnings for the whole process."""
    inside, go_on = threading.Event(), threading.Event()

    def other() -> None:
        with warnings.catch_warnings(record=True):
            inside.set()
            go_on.wait(10)

    work = threading.Thread(target=other)
    work.start()
    inside.wait(10)
    with listening() as heard:
        warn("the first", FieldWarning)
        go_on.set()
        work.join()
        warn("the second", FieldWarning)
    assert list(map(str, heard)) == ["the first", "the second"]


def test_tiles_of_a_picture_leave_warnings_as_they_are(tmp_path: Path) -> None:
    """Each silenced one of all threads: notes on an edit were lost while the page loaded tiles."""
    where = ("--lat", 35.075373, "--lon", 33.531142)
    done = run_geofield("run", SAMPLE, *where, "--spacing", 4, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    picture = Desk(tmp_path / "out" / "field.gpkg").picture
    assert picture is not None
    silenced: list[str] = []
    quiet = warnings.catch_warnings

    def watched(**options: Any) -> Any:
        silenced.append(str(options))
        return quiet(**options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(warnings, "catch_warnings", watched)
        assert picture.tile(0, 0, 0, "colour")[1].startswith("image/")
        assert not silenced
