"""Files of one field merge: nothing is said twice of one thing, and nothing is counted twice."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import pyoxigraph as ox
import pytest
import rdflib
from rdf_plans import small_plan

from geofield.formats.rdf import write
from geofield.formats.rdf.names import Names
from geofield.formats.rdf.namespaces import expand
from geofield.formats.rdf.query import ask, open_store, queries
from geofield.formats.rdf.read import read
from geofield.formats.rdf.validate import check
from geofield.model.place import position_words

#: Of the field, and of things that have many: everything else is said once.
MANY = (
    "rdf:type", "geo:hasGeometry", "geo:hasDefaultGeometry", "gf:causedBy", "rdfs:member",
    "prov:wasDerivedFrom", "prov:wasGeneratedBy",
)  # fmt: skip


def turned(plan):
    """The same field in another picture: an outline a metre wider, other obstacles."""
    field = plan.tables["field"].copy()
    field.geometry = field.geometry.buffer(1.0, join_style="mitre")
    field.loc[0, "imagery"] = "another picture"
    obstacles = plan.tables["obstacles"].copy()
    obstacles.geometry = obstacles.geometry.translate(2.0, 1.0)
    tables = {**plan.tables, "field": field, "obstacles": obstacles}
    return type(plan)(tables, plan.crs, plan.name, plan.provenance, plan.grid)


def rejecting(plan):
    """The same plan after a person's word on one obstacle."""
    obstacles = plan.tables["obstacles"].copy()
    obstacles.loc[0, "status"] = "rejected"
    tables = {**plan.tables, "obstacles": obstacles}
    return type(plan)(tables, plan.crs, plan.name, plan.provenance, plan.grid)


OTHERS = {
    "another spacing": lambda: small_plan(spacing_m=9.0),
    "another step between points": lambda: small_plan(step_m=7.0),
    "another picture": lambda: turned(small_plan()),
    "a review": lambda: rejecting(small_plan()),
}


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("profile", write.PROFILES)
def test_merging_two_plans_says_nothing_twice(tmp_path, name, profile):
    options = {"points": True, "rdf_profile": profile}
    (mine,) = write.write_turtle(small_plan(), tmp_path, stem="mine", options=options)
    (theirs,) = write.write_turtle(OTHERS[name](), tmp_path, stem="theirs", options=options)
    said: dict[tuple[str, str], set[str]] = {}
    for path in (mine, theirs):
        for quad in ox.parse(path=path):
            said.setdefault((quad.subject.value, quad.predicate.value), set()).add(str(quad.object))
    many = {expand(name) for name in MANY}
    twice = {key for key, values in said.items() if len(values) > 1 and key[1] not in many}
    assert not twice
    # One field, by one name.
    assert len({s for s, p in said if p == expand("dcterms:identifier")}) == 1


@pytest.mark.parametrize("name", OTHERS)
def test_tracks_and_obstacles_are_counted_once_after_merging(tmp_path, name):
    plans = {"mine": small_plan(), "theirs": OTHERS[name]()}
    paths = [
        write.write_turtle(plan, tmp_path, stem=stem, options={})[0] for stem, plan in plans.items()
    ]
    store = open_store(paths)
    answer = ask(store, queries()["length-per-track"])
    assert len(answer.rows) >= len(plans["theirs"].tables["tracks"])
    for row in answer.rows:
        assert row[3] == pytest.approx(row[4]), "a track's segments are longer than the track"
    for plan in plans.values():
        names = Names.of(plan)
        text = (
            f"SELECT (SUM(?m) AS ?sum) (COUNT(?m) AS ?n) {{ ?t gf:inPlan <{names.plan}> . "
            "?s gf:onTrack ?t ; a gf:Segment ; geo:hasMetricLength ?m }"
        )
        ((metres, count),) = ask(store, text).rows
        segments = plan.tables["segments"]
        assert (count, metres) == (len(segments), pytest.approx(segments["length_m"].sum()))
        text = "SELECT ?no { ?o a gf:Obstacle ; gf:inSurvey <%s> ; gf:obstacleNo ?no } ORDER BY ?no"
        numbers = [row[0] for row in ask(store, text % names.survey).rows]
        table = plan.tables["obstacles"]
        assert numbers == table["obstacle_no"][~table["status"].isin(["rejected"])].tolist()
    for path in paths:
        assert list(check(path)) == []


def test_a_merged_file_is_sound_and_each_plan_reads_back(tmp_path):
    from test_rdf_read import assert_same_tables

    mine, theirs = small_plan(), turned(small_plan(spacing_m=9.0))
    merged = tmp_path / "merged.nt"
    merged.write_bytes(
        b"".join(
            write.write_ntriples(plan, tmp_path, stem=stem, options={})[0].read_bytes()
            for stem, plan in {"mine": mine, "theirs": theirs}.items()
        )
    )
    assert list(check(merged)) == []
    for plan in (mine, theirs):
        assert_same_tables(read(merged, plan=Names.of(plan).plan.rsplit("/", 1)[-1]), plan)


def test_the_field_keeps_its_name_and_the_same_work_has_the_same_names():
    mine, again, wider = small_plan(), small_plan(), small_plan(spacing_m=9.0)
    assert Names.of(mine) == Names.of(again)
    one, other = Names.of(mine), Names.of(wider)
    assert one.field == other.field
    # The same outline and obstacles: one survey, two plans on it.
    assert one.survey == other.survey
    assert one.plan != other.plan
    assert Names.of(turned(mine)).field == one.field
    assert Names.of(turned(mine)).survey != one.survey


def test_two_programs_first_fields_are_two():
    here, there = small_plan(), small_plan(crs="EPSG:32635")
    for plan in (here, there):
        plan.tables["field"].loc[0, "field_id"] = "1"
    assert Names.of(here).field != Names.of(there).field
    assert Names.of(here).field.endswith("/field/35.075N33.531E/1")


@pytest.mark.parametrize("digits", [0, 3, 4, 7])
def test_a_field_named_by_its_place_has_that_name_alone(digits):
    """Whatever its outline is: another one's middle may be told by other digits."""
    plan = small_plan()
    field = plan.tables["field"]
    field.loc[0, "field_id"] = identifier = position_words(35.0754, -33.5312, digits)
    name = Names.of(plan).field
    assert name.endswith(f"/field/{identifier}")
    field.loc[[0], "geometry"] = field.geometry.translate(200.0, 200.0)
    assert Names.of(plan).field == name


def test_another_process_writes_the_same_bytes(tmp_path):
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from pathlib import Path\nfrom rdf_plans import small_plan\n"
        "from geofield.formats.rdf import write\nfolder = Path(sys.argv[2]); folder.mkdir()\n"
        "for each in (write.write_rdfxml, write.write_turtle, write.write_jsonld):\n"
        "    each(small_plan(), folder, options={'points': True})\n"
    )
    for seed in ("1", "2"):
        command = [sys.executable, "-c", code, str(__file__).rsplit("/", 1)[0], tmp_path / seed]
        subprocess.run(command, check=True, env={"PYTHONHASHSEED": seed})
    files = sorted((tmp_path / "1").iterdir())
    assert len(files) == 5
    for path in files:
        assert path.read_bytes() == (tmp_path / "2" / path.name).read_bytes(), path.name


@pytest.mark.parametrize("profile", write.PROFILES)
def test_what_is_not_driven_around_is_no_obstacle(tmp_path, profile):
    plan = small_plan()
    plan.tables["obstacles"].loc[1, "status"] = "possible"
    (path,) = write.write_turtle(plan, tmp_path, options={"rdf_profile": profile})
    graph: Any = rdflib.Graph().parse(path)

    def numbers(text):
        return sorted(int(row[0]) for row in graph.query(text))

    number = "gf:obstacleNo"
    assert numbers(f"SELECT ?n {{ ?o a gf:Obstacle ; {number} ?n }}") == [1, 7]
    assert numbers(f"SELECT ?n {{ ?o a gf:Candidate ; {number} ?n }}") == [2, 3]
    assert numbers(f"SELECT ?n {{ ?o gf:status gf:Possible ; {number} ?n }}") == [2]
    if profile == "study":
        assert numbers(f"SELECT ?n {{ ?o a po:tree ; {number} ?n }}") == [1]
        assert numbers(f"SELECT ?n {{ ?root rdfs:member ?o . ?o {number} ?n }}") == [1, 7]
    assert read(path).table("obstacles")["status"].tolist() == [
        "detected", "possible", "rejected", "added",
    ]  # fmt: skip
    assert list(check(path)) == []


def test_the_outlines_doubt_is_told(tmp_path):
    plan = small_plan()
    plan.tables["field"].loc[0, "certainty"] = 0.62
    plan.tables["field"].loc[0, "doubts"] = "goes on outside the picture"
    for path in write.write_rdfxml(plan, tmp_path, options={})[:1]:
        graph: Any = rdflib.Graph().parse(path)
        rows = list(graph.query("SELECT ?c ?d { ?s a gf:Survey ; gf:certainty ?c ; gf:doubts ?d }"))
        assert [(float(c), str(d)) for c, d in rows] == [(0.62, "goes on outside the picture")]
    got = read(tmp_path / "field.rdf").table("field").iloc[0]
    assert (got["certainty"], got["doubts"]) == (0.62, "goes on outside the picture")


def test_points_come_when_asked_for_and_say_each_place_once(tmp_path):
    plan = small_plan()
    without = write.write_rdfxml(plan, tmp_path, options={})[2]
    size = without.stat().st_size
    assert "TrackPoint" not in without.read_text()
    with_points = write.write_rdfxml(plan, tmp_path, options={"points": True})[2]
    assert with_points.stat().st_size > 1.5 * size
    graph: Any = rdflib.Graph().parse(with_points)
    (point, *_) = graph.subjects(rdflib.RDF.type, rdflib.URIRef(expand("gf:TrackPoint")))
    told = list(graph.predicate_objects(point))
    assert len(told) == 4
    geometry = graph.value(point, rdflib.URIRef(expand("geo:hasDefaultGeometry")))
    wkt = str(graph.value(geometry, rdflib.URIRef(expand("geo:asWKT"))))
    position = wkt[wkt.index("(") + 1 : -1].split()
    assert [len(each.partition(".")[2]) for each in position] == [7, 7]
    assert expand("rdfs:label") not in {str(predicate) for predicate, _ in told}
