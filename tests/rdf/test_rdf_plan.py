"""Linked data through the doors that people take: the command, and a plan in Python."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import rdflib
import shapely

import geofield as gf
from geofield.errors import FormatWarning
from geofield.formats.rdf.namespaces import expand

SAMPLE = Path(__file__).resolve().parents[2] / "sample_data"


def geofield(*arguments):
    """The installed command as a process."""
    result = subprocess.run(
        [sys.executable, "-m", "geofield", *map(str, arguments)],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    return result


def classes(path):
    graph: Any = rdflib.Graph().parse(path)
    return {str(each).rpartition("#")[2] for each in graph.objects(predicate=rdflib.RDF.type)}


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    geofield(
        "tracks", SAMPLE / "field_2.gpkg", "--spacing", "12", "-o", folder / "field.gpkg"
    )  # fmt: skip
    return folder / "field.gpkg"


@pytest.mark.parametrize("name", ["rdf", "turtle"])
def test_export_brings_points_only_when_asked(plan, tmp_path, name):
    sizes = {}
    for option in ("--no-points", "--points", None):
        folder = tmp_path / str(option)
        geofield("export", plan, "-f", name, "--out", folder, *([option] if option else []))
        files = sorted(folder.glob("*.*"))
        found = set().union(*map(classes, files))
        assert {"Field", "Survey", "Track", "Segment"} <= found
        assert ("TrackPoint" in found) == (option == "--points")
        sizes[option] = sum(path.stat().st_size for path in files)
    assert sizes[None] == sizes["--no-points"] < sizes["--points"] / 2


def test_plan_write_brings_points_only_when_asked(plan, tmp_path):
    one = gf.read_plan(plan)
    for points, folder in ((None, "a"), (True, "b")):
        one.write(tmp_path / folder, formats=["turtle"], points=points)
        assert ("TrackPoint" in classes(tmp_path / folder / "field.ttl")) == bool(points)
    # No option of a format that has none.
    with pytest.warns(FormatWarning, match="KML 2.2 cannot carry track points"):
        one.write(tmp_path / "c", formats=["kml"], points=True)


@pytest.mark.slow
def test_run_brings_points_only_when_asked(tmp_path):
    for options in ([], ["--points"]):
        folder = tmp_path / ("with" if options else "without")
        geofield(
            "run", SAMPLE / "field_2.tif", "--lat", "35.0754287", "--lon", "33.531154",
            "--spacing", "16", "--format", "rdf", "--out", folder, *options,
        )  # fmt: skip
        assert ("TrackPoint" in classes(folder / "tracks.rdf")) == bool(options)


def test_a_plan_is_an_rdflib_graph(plan, tmp_path):
    one = gf.read_plan(plan)
    graph: Any = one.to_graph(base_iri="https://farm.example/")
    assert type(graph) is rdflib.Graph
    # Prefixes are bound: a query needs none.
    rows: Any = list(
        graph.query("SELECT ?no ?m { ?t a gf:Track ; gf:trackNo ?no ; geo:hasMetricLength ?m }")
    )
    assert {int(no): float(m) for no, m in rows} == pytest.approx(
        dict(zip(one.tracks.lines["track_no"], one.tracks.lines["length_m"], strict=True))
    )
    wkt: Any
    (wkt,) = graph.query("SELECT ?w { ?f a gf:Field ; geo:hasDefaultGeometry/geo:asWKT ?w }")
    outline = shapely.from_wkt(str(wkt[0]).partition("> ")[2])
    assert outline.symmetric_difference(one.field.polygon_lonlat).area < 1e-6 * outline.area
    (path, *_) = one.write(
        tmp_path, formats=["turtle"], options={"base_iri": "https://farm.example/"}
    )
    assert set(rdflib.Graph().parse(path)) == set(graph)
    assert not list(graph.subjects(rdflib.RDF.type, rdflib.URIRef(expand("gf:TrackPoint"))))
    assert list(
        one.to_graph(points=True).subjects(rdflib.RDF.type, rdflib.URIRef(expand("gf:TrackPoint")))
    )
