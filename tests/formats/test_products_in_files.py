"""A product of several files side by side is one, named by any of them, all, or their folder."""

from __future__ import annotations

import json

import pytest
from formats_plan import make_dataset

from geofield.formats import read_dataset, write_dataset
from geofield_command import run_geofield as geofield

FILES = ("field.rdf", "obstacles.rdf", "tracks.rdf")


@pytest.fixture
def linked(tmp_path):
    folder = tmp_path / "linked data"
    write_dataset(make_dataset(), folder, ["rdf"])
    assert sorted(path.name for path in folder.iterdir()) == sorted(FILES)
    return folder


@pytest.mark.parametrize("names", [(".",), FILES, FILES[::-1], ("tracks.rdf",)])
def test_the_files_of_a_linked_plan_are_imported_once(linked, tmp_path, names):
    done = geofield("import", *(linked / n for n in names), "-o", tmp_path / "a.gpkg", "--json")
    assert done.returncode == 0, done.stderr
    whole = read_dataset(linked / "tracks.rdf")
    rows = {name: len(whole.table(name)) for name in ("field", "obstacles", "tracks", "segments")}
    assert json.loads(done.stdout)["rows"].items() >= rows.items()
    out = tmp_path / "out"
    done = geofield("export", *(linked / n for n in names), "-f", "geojson", "--out", out)
    assert done.returncode == 0, done.stderr
    assert len(read_dataset(out / "geojson").table("obstacles")) == rows["obstacles"]


def test_every_file_of_a_folder_is_checked(linked):
    assert geofield("validate", linked).returncode == 0
    told = (linked / "obstacles.rdf").read_text(encoding="utf-8")
    broken = told.replace("possible", "unknown").replace("</rdf:RDF>", "")
    (linked / "obstacles.rdf").write_text(broken, encoding="utf-8")
    done = geofield("validate", linked)
    assert done.returncode == 1
    assert "obstacles.rdf" in done.stdout + done.stderr


def test_two_plans_in_a_folder_are_not_one(linked):
    (linked / "tracks.rdf").rename(linked / "north_tracks.rdf")
    done = geofield("import", linked, "-o", linked / "a.gpkg")
    assert done.returncode == 1
    assert "holds 3 files (RDF/XML" in done.stderr


@pytest.mark.filterwarnings("ignore:.*cannot carry:geofield.errors.FormatWarning")
@pytest.mark.parametrize("product", ["rdf", "isoxml", "agopengps"])
def test_what_is_not_read_as_rows_is_named_with_the_command_that_reads_it(tmp_path, product):
    write_dataset(make_dataset(), tmp_path / "out", [product])
    place = tmp_path / "out" / ("" if product == "rdf" else product)
    truth = tmp_path / "truth.geojson"
    truth.write_text("{}")
    for given in ("tracks", "batch", "evaluate"):
        out = tmp_path / given
        told = {"tracks": ("-o", out), "batch": ("--out", out), "evaluate": (truth,)}[given]
        if given == "evaluate":  # it takes files alone
            found = ("obstacles.rdf", "TASKDATA.XML", "Boundary.txt")
            place = next(file for file in place.rglob("*") if file.name in found)
        done = geofield(given, place, *told)
        assert done.returncode == 1
        assert "is not read as rows" in done.stderr
        assert "`geofield import " in done.stderr
