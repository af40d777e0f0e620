"""The shipped queries, in Oxigraph and in rdflib; the GeoSPARQL functions."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest
import rdflib
import shapely
from click.testing import CliRunner
from pyproj import Geod
from rdf_plans import small_plan

from geofield.cli.main import cli
from geofield.errors import FormatError
from geofield.formats.rdf import geosparql, write
from geofield.formats.rdf.namespaces import GEOF, expand
from geofield.formats.rdf.query import ask, open_store, queries


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The RDF/XML files of a plan in which a person has rejected obstacle 1 since."""
    plan = small_plan()
    plan.tables["obstacles"].loc[0, "status"] = "rejected"
    return write.write_rdfxml(plan, tmp_path_factory.mktemp("rdf"), options={})


@pytest.fixture(scope="module")
def store(files):
    return open_store(files)


@pytest.fixture(scope="module")
def tables():
    plan = small_plan()
    return plan.tables


def test_obstacles_larger_than(store, tables):
    answer = ask(store, queries()["obstacles-larger-than"], {"radius": "2"})
    # 1 and 3 are rejected, 7 is not round.
    assert [row[1:3] for row in answer.rows] == [(2, 2.5)]
    assert ask(store, queries()["obstacles-larger-than"], {"radius": "2.5"}).rows == ()


def test_tracks_interrupted_by(store, tables):
    gaps = tables["gaps"]
    wanted = gaps[gaps["obstacle_no"] == 7]
    assert len(wanted)
    answer = ask(store, queries()["tracks-interrupted-by"], {"obstacle_no": "7"})
    assert [row[1] for row in answer.rows] == wanted["track_no"].tolist()
    assert [row[3] for row in answer.rows] == wanted["length_m"].tolist()


def test_length_per_track(store, tables):
    answer = ask(store, queries()["length-per-track"])
    tracks = tables["tracks"]
    assert [row[1] for row in answer.rows] == tracks["track_no"].tolist()
    assert [row[2] for row in answer.rows] == tracks["segment_count"].tolist()
    assert [row[3] for row in answer.rows] == pytest.approx(tracks["length_m"].tolist())
    assert [row[3] for row in answer.rows] == pytest.approx([row[4] for row in answer.rows])


def test_gaps_of_rejected_obstacles(store, tables):
    answer = ask(store, queries()["gaps-of-rejected-obstacles"])
    gaps = tables["gaps"]
    assert len(answer.rows) == (gaps["obstacle_no"] == 1).sum() > 0
    assert {row[3] for row in answer.rows} == {1}


def test_derived_from_imagery(store, tables):
    answer = ask(store, queries()["derived-from-imagery"], {"name": "ortho 2018.tif"})
    counts: dict[str, int] = {}
    for _, cls, _ in answer.rows:
        counts[cls] = counts.get(cls, 0) + 1
    for cls, layer in {
        "Field": "field", "Survey": "field", "Track": "tracks", "Segment": "segments",
        "Gap": "gaps", "Turn": "turns", "RouteStep": "route", "Headland": "headland",
    }.items():  # fmt: skip
        assert counts[expand(f"gf:{cls}")] == len(tables[layer]), cls
    # 1 and 3 are rejected: candidates, no obstacles.
    assert counts[expand("gf:Obstacle")] == counts[expand("gf:Candidate")] == 2
    assert ask(store, queries()["derived-from-imagery"], {"name": "other"}).rows == ()


def test_driving_order(store):
    answer = ask(store, queries()["driving-order"])
    assert [row[:5] for row in answer.rows] == [
        (1, "work", 1, 1, "forward"),
        (2, "turn", None, None, None),
        (3, "work", 2, 1, "backward"),
        (4, "drive", None, None, None),
    ]


def test_obstacles_near_tracks_and_outside(store, tables):
    near = ask(store, queries()["obstacles-near-tracks"], {"distance_m": "0.5"})
    # Obstacle 2's buffer cuts tracks, so that segments end at it.
    assert {row[0] for row in near.rows} == {2, 7}
    assert ask(store, queries()["obstacles-outside-field"]).rows == ()


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("name", sorted(queries()))
def test_oxigraph_and_rdflib_give_the_same_answers_to_what_is_shown(files, store, name):
    shown = CliRunner().invoke(cli, ["query", name, "--show"]).stdout
    functions = {}
    if "geof:" in queries()[name].text:
        assert shown.startswith("# Needs a store with geof:")
        geosparql.register_in_rdflib()
        functions = geosparql.oxigraph_functions()
    graph: Any = rdflib.Graph()
    for path in files:
        graph.parse(path)
    theirs = [
        tuple(None if value is None else str(value) for value in row) for row in graph.query(shown)
    ]
    answer = ask(store, queries()[name])
    assert len(answer.rows) == len(list(store.query(shown, custom_functions=functions)))
    assert len(theirs) == len(answer.rows)
    for row, other in zip(answer.rows, theirs, strict=True):
        for value, text in zip(row, other, strict=True):
            if isinstance(value, float):
                assert float(text) == pytest.approx(value, rel=1e-12, abs=1e-9)
            else:
                assert text == (None if value is None else str(value))


SQUARE = (
    "<http://www.opengis.net/def/crs/OGC/1.3/CRS84> "
    "POLYGON ((33 35, 33.001 35, 33.001 35.001, 33 35.001, 33 35))"
)
SWAPPED = (
    "<http://www.opengis.net/def/crs/EPSG/0/4326> "
    "POLYGON ((35 33, 35 33.001, 35.001 33.001, 35.001 33, 35 33))"
)


def test_relations_know_axis_order():
    equals, _ = geosparql.FUNCTIONS["sfEquals"]
    assert equals(SQUARE, SWAPPED)


def test_measures_are_metres_on_the_ellipsoid():
    geod = Geod(ellps="WGS84")
    point = "POINT (33.002 35.0005)"
    wanted = geod.inv(33.001, 35.0005, 33.002, 35.0005)[2]
    assert geosparql.distance(SQUARE, point) == pytest.approx(wanted, rel=1e-6)
    square = shapely.from_wkt(SQUARE.split("> ")[1])
    assert geosparql.metric_area(SQUARE) == pytest.approx(
        abs(geod.geometry_area_perimeter(square)[0])
    )
    assert geosparql.metric_length("LINESTRING (33 35, 33 35.001)") == pytest.approx(
        geod.inv(33, 35, 33, 35.001)[2]
    )


def test_a_buffer_is_as_wide_as_it_says():
    grown = geosparql.buffer("POINT (33 35)", 10.0)
    assert geosparql.metric_area(grown) == pytest.approx(314.0, rel=0.005)


def test_a_wrong_unit_leaves_the_value_unbound(store):
    answer = ask(
        store,
        'SELECT ?d WHERE { BIND (geof:distance("POINT (1 1)", "POINT (1 2)", unit:FT) AS ?d) }',
    )
    assert answer.rows == ((None,),)


def test_all_functions_answer_in_oxigraph(store):
    points = shapely.Point(1, 1), shapely.Point(1, 2)
    wanted = {
        "distance": Geod(ellps="WGS84").inv(1, 1, 1, 2)[2],
        "metricLength": 0,
        "metricArea": 0,
    }
    for name in geosparql.FUNCTIONS:
        arguments = ['"POINT (1 1)"', '"POINT (1 2)"']
        if name in ("metricLength", "metricArea", "envelope", "convexHull"):
            arguments = arguments[:1]
        if name == "buffer":
            arguments = [arguments[0], "5.0"]
        call = f"SELECT ?x WHERE {{ BIND (<{GEOF}{name}>({', '.join(arguments)}) AS ?x) }}"
        told = ask(store, call).rows[0][0]
        if name in wanted:
            assert told == pytest.approx(wanted[name]), name
        elif name.startswith("sf"):
            assert told is bool(getattr(shapely, name[2:].lower())(*points)), name
        elif name == "buffer":
            assert geosparql.metric_area(told) == pytest.approx(25 * np.pi, rel=0.01)
        else:
            operation = getattr(shapely, "convex_hull" if name == "convexHull" else name)
            made = shapely.from_wkt(told.partition("> ")[2])
            assert made.equals(operation(*points[: len(arguments)])), name


@pytest.mark.parametrize(
    ("query", "values", "words"),
    [
        ("obstacles-larger-than", {"radius": "big"}, "not a number"),
        ("obstacles-larger-than", {"r": "1"}, "Parameters: radius"),
    ],
)
def test_wrong_parameters_are_named(store, query, values, words):
    with pytest.raises(FormatError, match=words):
        ask(store, queries()[query], values)


def test_a_value_cannot_break_out_of_its_literal(store):
    evil = '" } } DROP ALL # \\'
    assert ask(store, queries()["derived-from-imagery"], {"name": evil}).rows == ()


def test_broken_sparql_is_refused(store):
    with pytest.raises(FormatError, match="not valid SPARQL"):
        ask(store, "SELECT WHERE")
    with pytest.raises(FormatError, match="Only SELECT"):
        ask(store, "ASK { ?s ?p ?o }")


def test_the_command_answers_lists_and_shows(files, tmp_path):
    run = CliRunner().invoke
    names = [str(path) for path in files]
    result = run(cli, ["query", *names, "obstacles-larger-than", "--set", "radius=2", "--json"])
    assert json.loads(result.stdout)[0]["radius_m"] == 2.5
    result = run(cli, ["query", *names, "length-per-track"])
    assert result.stdout.startswith("track,track_no,segments,segments_m,track_m\n")
    assert set(queries()) <= set(run(cli, ["query", "--list"]).stdout.split())
    assert "PREFIX gf:" in run(cli, ["query", "driving-order", "--show"]).stdout
    own = tmp_path / "own.rq"
    own.write_text("SELECT (COUNT(*) AS ?n) WHERE { ?t a gf:Track }")
    assert run(cli, ["query", *names, str(own)]).stdout.splitlines()[0] == "n"
    own.write_bytes(b"SELECT \xff")
    result = run(cli, ["query", *names, str(own)])
    assert result.exit_code == 1
    assert "own.rq is no text in UTF-8" in str(result.exception) + result.stderr
    assert run(cli, ["query"]).exit_code == 2


def test_the_validate_command_tells_and_exits_with_one(files, tmp_path):
    run = CliRunner().invoke
    result = run(cli, ["validate", *map(str, files)])
    assert result.exit_code == 0, result.output
    broken = tmp_path / "broken.rdf"
    broken.write_text(files[1].read_text().replace("#Confirmed", "#Perhaps"))
    result = run(cli, ["validate", str(broken)])
    assert result.exit_code == 1
    words = "obstacle/2>: Its status (gf:status) is 'gf:Perhaps', which is not allowed"
    assert words in result.stderr
    result = run(cli, ["validate", "--json", str(broken)])
    (finding, *_) = json.loads(result.stdout)[str(broken)]
    assert re.match(r"line \d+, <https://example.org/geofield/field/", finding["where"])


def test_functions_across_180():
    """What lies beyond 180 is beside what lies before it, however a literal tells it."""
    east, west = "POLYGON ((179.999 1, 180 1, 180 2, 179.999 2, 179.999 1))", "POINT (-179.999 1)"
    geod = Geod(ellps="WGS84")
    assert geosparql.distance(east, west) == pytest.approx(geod.inv(180, 1, -179.999, 1)[2])
    assert geosparql.distance(west, east) == pytest.approx(geod.inv(180, 1, -179.999, 1)[2])
    cut = (
        "MULTIPOLYGON (((179.999 1, 180 1, 180 1.001, 179.999 1)), "
        "((-180 1, -179.999 1, -180 1.001, -180 1)))"
    )
    intersects, _ = geosparql.FUNCTIONS["sfIntersects"]
    assert intersects(west, cut)
    assert intersects(cut, west)
    grown = geosparql.buffer(cut, 10.0)
    assert "MULTIPOLYGON" in grown
    assert "180" in grown
    assert geosparql.distance(grown, "POINT (-179.998 1)") == pytest.approx(
        geod.inv(-179.999, 1, -179.998, 1)[2] - 10.0, abs=0.1
    )
    union, _ = geosparql.FUNCTIONS["union"]
    both = str(union(east, "POLYGON ((-180 1, -179.999 1, -180 2, -180 1))"))
    longitudes = shapely.get_coordinates(shapely.from_wkt(geosparql.split_literal(both)[1]))[:, 0]
    assert np.abs(longitudes).max() <= 180.0
