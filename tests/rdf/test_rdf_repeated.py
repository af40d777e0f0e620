"""Many nodes of one shape, read by their pattern: the same triples as a parser tells."""

from __future__ import annotations

import pyoxigraph as ox
import pytest
from rdf_plans import long_plan, small_plan

from geofield.formats.rdf import write
from geofield.formats.rdf.graph import Graph
from geofield.formats.rdf.namespaces import GF, PREFIXES, STUDY_PREFIXES
from geofield.formats.rdf.read import load, read
from geofield.formats.rdf.repeated import repeated
from geofield.formats.rdf.triples import triples


def told(graph: Graph) -> set[tuple[str, str, str]]:
    return {(s, p, o) for p in graph.columns for s, o in graph.pairs(p)}


def parsed(path) -> set[tuple[str, str, str]]:
    return {(q.subject.value, q.predicate.value, q.object.value) for q in ox.parse(path=path)}


@pytest.fixture(scope="module")
def tracks(tmp_path_factory):
    """The file of tracks and points, by profile."""
    paths = {}
    for profile in write.PROFILES:
        folder = tmp_path_factory.mktemp(profile)
        options = {"rdf_profile": profile, "points": True}
        # In several chunks, so that the study's points are no one run.
        paths[profile] = write.write_rdfxml(long_plan(21_000), folder, options=options)[-1]
    return paths


@pytest.mark.parametrize("profile", write.PROFILES)
def test_the_pattern_tells_what_the_parser_tells(tracks, profile):
    graph = repeated(tracks[profile])
    assert graph is not None
    assert told(graph) == parsed(tracks[profile])


@pytest.mark.parametrize("profile", write.PROFILES)
def test_points_come_back_in_their_order(tracks, profile):
    numbers = read(tracks[profile]).table("track_points")["point_no"].tolist()
    assert len(numbers) > 20_000
    assert numbers == sorted(numbers)


POINT = '\t<gf:TrackPoint rdf:about="https://example.org/'
#: What an editor or another program may make of one place in such a file.
OTHERS = {
    "a comment": ("\t</gf:TrackPoint>\n", "\t</gf:TrackPoint><!-- -->\n"),
    "a base": ("<rdf:RDF ", '<rdf:RDF xml:base="https://example.org/" '),
    "a document type": ("<rdf:RDF ", "<!DOCTYPE rdf:RDF>\n<rdf:RDF "),
    "no UTF-8": ("</gf:planner>", "\udcff</gf:planner>"),
    "not well-formed": ("</gf:planner>", "</gf:plan>"),
    "nested": ("</gf:planner>\n", f'{POINT}x">\n\t</gf:TrackPoint>\n</gf:planner>\n'),
    "two at one": ("/point/8/geometry", "/point/7/geometry"),
}


@pytest.mark.parametrize("name", OTHERS)
def test_any_other_form_is_left_to_the_parser(tracks, tmp_path, name):
    text, path = tracks["geosparql"].read_text(), tmp_path / "tracks.rdf"
    old, new = OTHERS[name]
    assert old in text
    path.write_bytes(text.replace(old, new).encode(errors="surrogateescape"))
    assert repeated(path) is None


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("POINT (33.53", "POINT  (33.53"),
        ("/track/7/", "/track/7%20/"),
        ("/point/7/geometry", "/point/7&amp;/geometry"),
        (">7</gf:pointNo>", ">7</gf:pointNo>\n\t\t<gf:note>a &lt;b&gt; &amp;amp;</gf:note>"),
        (">9</gf:pointNo>", ">&#57;</gf:pointNo>"),
        (">9</gf:pointNo>", ">9&amp;lt;</gf:pointNo>"),
    ],
)
def test_rows_of_another_form_are_read_in_their_place(tracks, tmp_path, old, new):
    text, path = tracks["geosparql"].read_text(), tmp_path / "tracks.rdf"
    assert old in text
    path.write_text(text.replace(old, new, 1))
    graph = load(path)
    assert told(graph) == parsed(path)
    points = [q.subject.value for q in ox.parse(path=path) if q.object.value == GF + "TrackPoint"]
    assert graph.of_type("gf:TrackPoint") == points


def test_points_are_written_as_pyoxigraph_writes_them(tmp_path):
    name = "a \"b\" 'c' <d> &amp; %s \u00e9"
    dataset = small_plan(spacing_m=2.0, step_m=1.0, name=name)
    for profile in write.PROFILES:
        options = {"rdf_profile": profile, "points": True, "plan_name": name}
        *_, path = write.write_rdfxml(dataset, tmp_path, options=options)
        groups = write.describe(dataset, options).product("tracks")
        whole = tmp_path / "whole.rdf"
        prefixes = {**PREFIXES, **STUDY_PREFIXES} if profile == "study" else PREFIXES
        ox.serialize(triples(groups), whole, ox.RdfFormat.RDF_XML, prefixes=prefixes)
        assert whole.stat().st_size > 500_000
        assert path.read_bytes() == whole.read_bytes()
