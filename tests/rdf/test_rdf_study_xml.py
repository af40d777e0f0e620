"""The study's plain XML."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest

from geofield.formats import FORMATS, read_dataset, write_dataset
from geofield.formats.study_xml import write_study_xml


def test_it_has_the_studys_elements(plan, tmp_path):
    obstacles, path = write_study_xml(plan, tmp_path, options={})
    root = ET.parse(obstacles).getroot()
    assert root.tag == "Obstacles"
    items = root.findall("Tree/Item")
    # Obstacle 3 is rejected, 7 is no tree.
    assert [item.findtext("Number") for item in items] == ["1", "2"]
    assert [child.tag for child in items[0]] == [
        "Number", "Position", "PixelCoordinates", "Radius", "Latitude", "Longitude",
        "GpsPositions",
    ]  # fmt: skip
    row = plan.tables["obstacles"].iloc[0]
    assert items[0].findtext("GpsPositions") == f"{float(row['lat'])!r},{float(row['lon'])!r}"
    assert root.findtext("Other/Item/Number") == "7"
    tracks = ET.parse(path).getroot().findall("Track")
    points = plan.tables["track_points"]
    assert [int(t.findtext("Number")) for t in tracks] == points["track_no"].unique().tolist()
    assert sum(len(t.findall("gpsPoint")) for t in tracks) == len(points)


@pytest.mark.parametrize("name", ["rdf", "turtle", "jsonld", "ntriples", "rdf-study"])
def test_the_registry_writes_and_reads(plan, tmp_path, name):
    from test_rdf_read import assert_same_tables

    paths = write_dataset(
        plan, tmp_path, [name], options={"base_iri": "https://a.example/", "points": "yes"}
    )
    assert {p.name for p in paths} == {f.format(stem="field") for f in FORMATS[name].files}
    assert_same_tables(read_dataset(paths[0]), plan, points=True)
