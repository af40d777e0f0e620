"""Names that are formulas, HTML, SQL or paths: harmless in every format, equal where it is read.

Through the installed command: a person's file, `import`, `tracks`, `export` to all formats.
"""

from __future__ import annotations

import csv
import json
import re
import sqlite3
from contextlib import closing
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree as ET

import pyogrio
import pytest

from geofield.formats import FORMATS, read_dataset
from geofield_command import run_geofield as geofield

LON, LAT, SIDE = 15.0, 48.0, 0.0006
NAMES = {
    "formula": "@SUM(A1)*cmd|' /C calc'!A0",
    "html": "<!--<script>alert(1)</script><img src=x onerror=alert(2)>&amp;",
    "path and SQL": "../../../escaped'; DROP TABLE field;--\"",
    "lines": "two\nlines [% env('HOME') %]\tof ]]> $[name] %s",
}
#: Not of one plan by itself: the picture, which there is none of.
ALL = [name for name in FORMATS if name != "scene"]
#: Two formats write the same files; these of them come second.
SECOND = [name for name in ALL if name in ("rdf-study",)]


def plan_of(folder: Path, name: str) -> Path:
    """A field and a tree that bear a name, in all columns that a person may fill."""

    def square(x: float, y: float, side: float) -> list[list[list[float]]]:
        return [[[x, y], [x + side, y], [x + side, y + side], [x, y + side], [x, y]]]

    for file, side, start, own in (
        ("field", SIDE, 0.0, {"name": name, "owner": name}),
        ("trees", SIDE / 20, SIDE / 2, {"kind": name, "note": name}),
    ):
        shape = {"type": "Polygon", "coordinates": square(LON + start, LAT + start, side)}
        row = {"type": "Feature", "properties": own, "geometry": shape}
        text = json.dumps({"type": "FeatureCollection", "features": [row]})
        (folder / f"{file}.geojson").write_text(text)
    plan = folder / "plan.gpkg"
    files = (folder / "field.geojson", folder / "trees.geojson")
    assert geofield("import", *files, "-o", plan).returncode == 0
    with closing(sqlite3.connect(plan)) as connection, connection:
        # As a database client, which is bound to no list, would write it.
        for function in ("IsEmpty", "MinX", "MaxX", "MinY", "MaxY"):
            connection.create_function(f"ST_{function}", 1, lambda shape: 0)
        connection.execute("UPDATE obstacles SET kind = ?", [name])
    return plan


def exported(plan: Path, out: Path) -> Path:
    formats = [word for each in ALL if each not in SECOND for word in ("-f", each)]
    done = geofield("tracks", plan, "--spacing", 10, "-o", plan)
    assert done.returncode == 0, done.stderr
    for chosen in (formats, [word for each in SECOND for word in ("-f", each)]):
        place = out if chosen is formats else out / "second"
        done = geofield("export", plan, *chosen, "--out", place)
        assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same products of a field with an ordinary name."""
    folder = tmp_path_factory.mktemp("plain")
    return exported(plan_of(folder, "Home field"), folder / "out")


@pytest.mark.parametrize("kind", NAMES)
def test_a_hostile_name_is_only_a_name(kind: str, plain: Path, tmp_path: Path) -> None:
    name = NAMES[kind]
    folder = tmp_path / "a" / "b" / "c"
    folder.mkdir(parents=True)
    out = exported(plan_of(folder, name), folder / "out")

    # Nothing beside the products, and the same ones: only AgOpenGPS has a folder by the name.
    assert not [each for each in tmp_path.rglob("*escaped*") if out not in each.parents]
    assert files_of(out) == files_of(plain)
    (own,) = (out / "agopengps/Fields").iterdir()
    assert re.fullmatch(r"[\w.-]+", own.name)

    for found, format_ in read_back(out):
        field = found.table("field")
        assert len(field) == 1, format_
        if format_ == "agopengps":
            expected = " ".join(name.split())
        elif format_ == "dxf":
            expected = "field"  # its file's: it has no names
        elif format_.startswith("isoxml"):
            expected = name if len(name) <= 32 else f"{name[:31]}…"
        else:
            expected = name
        assert field["name"].iloc[0] == expected, format_

    for file in (out / "csv").glob("*.csv"):
        with file.open(newline="") as rows:
            cells = [cell for row in csv.reader(rows) for cell in row]
        assert not [cell for cell in cells if cell[:1] in "=@\t\r\n" and cell]
        assert not [cell for cell in cells if cell[:1] in ("+", "-") and not number(cell)]

    pages = [Page(out / "field.html"), Page(plain / "field.html")]
    assert pages[0].tags == pages[1].tags
    assert json.loads(pages[0].data)["name"] == name

    for file in (*out.rglob("*.kml"), *out.rglob("*.gpx"), *out.rglob("*.xml")):
        twin = plain / file.relative_to(out)
        assert [each.tag for each in ET.parse(file).iter()] == [
            each.tag for each in ET.parse(twin).iter()
        ]
    for told in ET.parse(out / "field.kml").iter("{*}description"):
        assert "<" not in str(told.text)

    for file in own.iterdir():
        (twin,) = (plain / "agopengps/Fields").glob(f"*/{file.name}")
        assert len(file.read_bytes().splitlines()) == len(twin.read_bytes().splitlines()), file
    with closing(sqlite3.connect(out / "field.gpkg")) as connection:
        assert connection.execute("SELECT name FROM field").fetchone() == (name,)
    json.loads((out / "report.json").read_text())
    assert len(pyogrio.read_dataframe(out / "field.dxf")) == len(
        pyogrio.read_dataframe(plain / "field.dxf")
    )


def test_control_characters_are_refused_with_a_word_or_carried(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "bell\x07")
    done = geofield("export", plan, "-f", "kml", "--out", tmp_path / "kml")
    assert done.returncode == 1
    assert "holds the character U+0007, which XML cannot carry" in done.stderr
    assert not (tmp_path / "kml").exists()
    done = geofield("export", plan, "-f", "geojson", "-f", "html", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert read_dataset(tmp_path / "out/geojson").name == "bell\x07"


def files_of(out: Path) -> set[str]:
    named = re.compile("agopengps/Fields/[^/]+")
    return {
        named.sub("agopengps/Fields/NAME", each.relative_to(out).as_posix())
        for each in out.rglob("*")
        if each.is_file()
    }


def read_back(out: Path):
    places = {
        "gpkg": "field.gpkg",
        "kml": "field.kml",
        "dxf": "field.dxf",
        "isoxml": "isoxml/TASKDATA",
        "isoxml-v3": "isoxml-v3/TASKDATA",
        "rdf": "field.rdf",
        "turtle": "field.ttl",
        "jsonld": "field.jsonld",
        "ntriples": "field.nt",
        "rdf-study": "second/field.rdf",
    }
    for name, each in FORMATS.items():
        if each.reader is not None and "field" in each.layers:
            place = out / places.get(name, name)
            if name == "agopengps":
                (place,) = (place / "Fields").iterdir()
            yield read_dataset(place), name


def number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


class Page(HTMLParser):
    """The tags of a page in order, and the data that it holds."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.data, self._is_data = "", False
        text = file.read_text(encoding="utf-8")
        self.feed(text)
        # A comment opened in a script takes its end away from browsers.
        scripts = re.findall(r"<script[^>]*json[^>]*>(.*?)</script>", text, re.DOTALL)
        assert not [each for each in scripts if "<" in each]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self._is_data = ("id", "plan") in attrs

    def handle_data(self, data: str) -> None:
        if self._is_data:
            self.data += data
            self._is_data = False
