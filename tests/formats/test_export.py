"""Staging, refusing, warning: the previous product stays whole whatever happens."""

from __future__ import annotations

import dataclasses
import errno
import os
import sqlite3

import pytest
import shapely

from geofield.errors import FormatError, FormatWarning, OutputExistsError
from geofield.formats import FORMATS, detect, format_named, read_dataset, write_dataset
from geofield.formats.export import dropped
from geofield.staging import staged as staging_module
from geofield.staging import staged_file, staged_folder

pytestmark = pytest.mark.filterwarnings("ignore:.*cannot carry.*:geofield.errors.FormatWarning")


def listing(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_unknown_format_suggests_the_nearest(dataset, tmp_path):
    with pytest.raises(FormatError, match="Did you mean 'shapefile'"):
        write_dataset(dataset, tmp_path, ["shapfile"])
    with pytest.raises(FormatError, match="Did you mean 'gpkg'"):
        format_named("geopackage 1")
    assert listing(tmp_path) == []


def test_unknown_option_suggests_the_nearest(dataset, tmp_path):
    with pytest.raises(FormatError, match="Did you mean 'profile'"):
        write_dataset(dataset, tmp_path, ["shapefile"], options={"profil": "aggps"})


def test_existing_products_need_overwrite(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["gpkg"])
    before = (tmp_path / "field.gpkg").read_bytes()
    with pytest.raises(OutputExistsError, match="is there already"):
        write_dataset(dataset, tmp_path, ["gpkg"])
    assert (tmp_path / "field.gpkg").read_bytes() == before
    write_dataset(dataset, tmp_path, ["gpkg"], overwrite=True)
    assert listing(tmp_path) == ["field.gpkg", "field.gpkg.bak", "field.qgz"]


def test_an_input_is_never_an_output(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["gpkg"])
    with pytest.raises(FormatError, match="is an input"):
        write_dataset(dataset, tmp_path, ["gpkg"], overwrite=True, inputs=[tmp_path / "field.gpkg"])


def test_one_failing_format_leaves_nothing(dataset, tmp_path):
    bad = dataset.tables["field"].assign(name="é" * 128)
    broken = dataclasses.replace(dataset, tables={**dataset.tables, "field": bad})
    with pytest.raises(FormatError, match=r"'name' has 256 bytes, 254 fit"):
        write_dataset(broken, tmp_path / "out", ["gpkg", "shapefile"])
    assert not (tmp_path / "out").exists()


def test_a_failed_move_puts_everything_back(dataset, tmp_path, monkeypatch):
    for name in ("a", "b", "c"):
        (tmp_path / name).write_text(f"old {name}")
    keep = staging_module._keep

    def failing(place, kept):
        if place.name == "c":
            raise OSError(errno.ENOSPC, "No space left on device", str(place))
        keep(place, kept)

    monkeypatch.setattr(staging_module, "_keep", failing)

    def work():
        with staged_folder(tmp_path, overwrite=True) as staging:
            for name in ("a", "b", "c", "d"):
                (staging / name).write_text("new")

    with pytest.raises(FormatError, match="disk is full"):
        work()
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {
        name: f"old {name}" for name in "abc"
    }


def test_staged_file_refuses_before_the_work(tmp_path):
    target = tmp_path / "x.txt"
    target.write_text("old")
    for place, error in ((target, OutputExistsError), (tmp_path, FormatError)):
        with pytest.raises(error), staged_file(place):
            pytest.fail("The work began.")
    with pytest.raises(FormatError, match="input"), staged_file(target, inputs=iter([target])):
        pytest.fail("The work began.")
    assert target.read_text() == "old"


def test_staged_file_appears_whole_or_not_at_all(tmp_path):
    with staged_file(tmp_path / "x.txt") as path:
        path.write_text("whole")
        assert listing(tmp_path) != ["x.txt"]
    assert (tmp_path / "x.txt").read_text() == "whole"

    def interrupted():
        with staged_file(tmp_path / "y.txt") as path:
            path.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert listing(tmp_path) == ["x.txt"]


def test_no_hard_links_needed(tmp_path, monkeypatch):
    (tmp_path / "x.txt").write_text("old")

    def no_links(*_args, **_kwargs):
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", no_links)
    with staged_file(tmp_path / "x.txt", overwrite=True) as path:
        path.write_text("new")
    assert (tmp_path / "x.txt").read_text() == "new"


def test_a_geopackage_open_elsewhere_is_refused(dataset, tmp_path):
    write_dataset(dataset, tmp_path, ["gpkg"])
    path = tmp_path / "field.gpkg"
    # What QGIS does: WAL mode, and a connection that stays open.
    other = sqlite3.connect(path)
    other.execute("PRAGMA journal_mode = WAL")
    other.execute("SELECT count(*) FROM field").fetchone()
    try:
        with pytest.raises(FormatError, match="open in another program"):
            write_dataset(dataset, tmp_path, ["gpkg"], overwrite=True)
    finally:
        other.close()
    write_dataset(dataset, tmp_path, ["gpkg"], overwrite=True)
    assert listing(tmp_path) == ["field.gpkg", "field.gpkg.bak", "field.qgz"]


def test_read_only_folder(dataset, tmp_path, monkeypatch):
    def refused(*_args, **_kwargs):
        # Not by permissions: the tests may run as root, who may write everywhere.
        raise PermissionError(errno.EACCES, "Permission denied", str(tmp_path))

    monkeypatch.setattr("tempfile.mkdtemp", refused)
    with pytest.raises(FormatError, match="cannot be written"):
        write_dataset(dataset, tmp_path, ["gpkg"])
    with pytest.raises(FormatError, match="cannot be written"):
        write_dataset(dataset, tmp_path / "deeper" / "still", ["gpkg"])
    assert listing(tmp_path) == []


def test_target_that_is_a_file(dataset, tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(FormatError, match="not a folder"):
        write_dataset(dataset, tmp_path / "out", ["gpkg"])
    assert (tmp_path / "out").read_text() == "mine"


def test_what_is_dropped_is_said_once_and_only_if_it_is_there(dataset, tmp_path):
    with pytest.warns(FormatWarning) as caught:
        write_dataset(dataset, tmp_path, ["shapefile"])
    (only,) = caught
    assert "cannot carry gaps, track points and settings and evidence" in str(only.message)
    bare = dataclasses.replace(
        dataset,
        tables={"field": dataset.tables["field"]},
        points=None,
        provenance=type(dataset.provenance)(),
    )
    write_dataset(bare, tmp_path / "bare", ["shapefile"])


@pytest.mark.filterwarnings("ignore:.* no radius:geofield.errors.FormatWarning")
def test_columns_of_a_persons_own_come_back_or_it_is_told(dataset, tmp_path):
    """Linked data left them out without a word, and with them a plan that was imported from it."""
    layers = ("field", "obstacles", "tracks", "segments")
    own = {name: dataset.tables[name].assign(note="mine") for name in layers}
    mine = dataclasses.replace(dataset, tables={**dataset.tables, **own})
    words = "columns of your own"
    for name, each in FORMATS.items():
        assert words not in dropped(dataset, each)
        if each.reader and name != "rdf-study":
            write_dataset(mine, tmp_path / name, [name])
            files = sorted(p for p in (tmp_path / name).iterdir() if p.suffix != ".qgz")
            back = read_dataset(files[0])
            came = all("note" in back.table(layer) for layer in layers)
            assert came != (words in " ".join(dropped(mine, each))), name


def test_mixed_geometries_are_refused(dataset, tmp_path):
    mixed = dataset.tables["gaps"].copy()
    mixed.loc[1, "geometry"] = shapely.Point(0, 0)
    broken = dataclasses.replace(dataset, tables={**dataset.tables, "gaps": mixed})
    with pytest.raises(FormatError, match=r"holds LineString geometries; row 2 has Point"):
        write_dataset(broken, tmp_path, ["gpkg"])


@pytest.mark.parametrize("stem", ["", "a/b", "..", "a:b", "x\0", "a\nb"])
def test_impossible_stems(dataset, tmp_path, stem):
    with pytest.raises(FormatError, match="not a file name"):
        write_dataset(dataset, tmp_path, ["gpkg"], stem=stem)


def test_products_are_recognised(dataset, tmp_path):
    names = [name for name, each in FORMATS.items() if each.reader and name != "rdf-study"]
    for name in names:
        write_dataset(dataset, tmp_path / name, [name])
        found = detect(next(p for p in (tmp_path / name).iterdir() if p.suffix != ".qgz"))
        assert found.name == name


def test_missing_and_unknown_files(tmp_path):
    with pytest.raises(FormatError, match="no file"):
        read_dataset(tmp_path / "nothing.gpkg")
    (tmp_path / "x.abc").write_text("?")
    with pytest.raises(FormatError, match="is not known") as told:
        read_dataset(tmp_path / "x.abc")
    # What is only written is no way out.
    assert ".html" not in str(told.value)
    assert "ogr2ogr NAME.gpkg FILE" in str(told.value)
    (tmp_path / "x.tif").write_bytes(b"II*\0")
    with pytest.raises(FormatError, match=r"x.tif is a picture") as told:
        read_dataset(tmp_path / "x.tif")
    assert "geofield run" in str(told.value)
    (tmp_path / "x.gpkg").write_text("not a database, only text that is long enough" * 10)
    with pytest.raises(FormatError, match="not a GeoPackage"):
        read_dataset(tmp_path / "x.gpkg")


def test_writers_name_their_files_as_registered():
    for each in FORMATS.values():
        assert each.files
        assert set(each.layers) <= {
            "field", "obstacles", "tracks", "segments", "gaps", "track_points"
        } | {"headland", "headland_tracks", "route", "turns"}  # fmt: skip
