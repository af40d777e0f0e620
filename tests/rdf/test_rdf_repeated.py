"""Many nodes of one shape, read by their pattern: the same triples as a parser tells."""

from __future__ import annotations

import re

import pyoxigraph as ox
import pytest
from rdf_plans import long_plan, small_plan

from geofield.formats.rdf import write
from geofield.formats.rdf.graph import Graph
from geofield.formats.rdf.namespaces import GF, PREFIXES, STUDY_PREFIXES, node
from geofield.formats.rdf.parse import SYNTAXES
from geofield.formats.rdf.read import load, read
from geofield.formats.rdf.repeated import repeated, write_repeated
from geofield.formats.rdf.triples import Nodes, Texts, triples


def told(graph: Graph) -> set[tuple[str, str, str]]:
    return {(s, p, o) for p in graph.columns for s, o in graph.pairs(p)}


def parsed(path) -> set[tuple[str, str, str]]:
    return {(q.subject.value, q.predicate.value, q.object.value) for q in ox.parse(path=path)}


WRITERS = {
    ".rdf": write.write_rdfxml,
    ".ttl": write.write_turtle,
    ".jsonld": write.write_jsonld,
    ".nt": write.write_ntriples,
}


def by_pattern(path) -> Graph | None:
    return repeated(path, SYNTAXES[path.suffix])


@pytest.fixture(scope="module")
def tracks(tmp_path_factory):
    """The file of tracks and points, by profile and syntax."""
    paths = {}
    for profile in write.PROFILES:
        folder = tmp_path_factory.mktemp(profile)
        options = {"rdf_profile": profile, "points": True}
        # In several chunks, so that the study's points are no one run.
        plan = long_plan(21_000)
        for suffix, writer in WRITERS.items():
            paths[profile, suffix] = writer(plan, folder, options=options)[-1]
    return paths


@pytest.fixture(scope="module")
def text_of(tmp_path_factory):
    """The text of a short file of tracks and points, by syntax."""
    folder, options = tmp_path_factory.mktemp("short"), {"rdf_profile": "geosparql", "points": True}
    paths = [writer(long_plan(1000), folder, options=options)[-1] for writer in WRITERS.values()]
    assert None not in map(by_pattern, paths)
    return {path.suffix: path.read_text() for path in paths}


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize("profile", write.PROFILES)
def test_the_pattern_tells_what_the_parser_tells(tracks, profile, suffix):
    graph = by_pattern(tracks[profile, suffix])
    assert graph is not None
    assert told(graph) == parsed(tracks[profile, suffix])


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize("profile", write.PROFILES)
def test_points_come_back_in_their_order(tracks, profile, suffix):
    numbers = read(tracks[profile, suffix]).table("track_points")["point_no"].tolist()
    assert len(numbers) > 20_000
    assert numbers == sorted(numbers)


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize("profile", write.PROFILES)
def test_points_of_a_plan_with_a_headland_and_a_route_stand_last(tmp_path, profile, suffix):
    plan = small_plan(spacing_m=6.0, step_m=1.0)
    assert all(map(plan.has, ("headland", "headland_tracks", "route", "turns")))
    options = {"rdf_profile": profile, "points": True}
    path = WRITERS[suffix](plan, tmp_path, options=options)[-1]
    graph = by_pattern(path)
    assert graph is not None
    assert told(graph) == parsed(path)


def test_points_in_a_comment_are_none(text_of, tmp_path):
    text, point = text_of[".rdf"], "\n\t<gf:TrackPoint "
    first, last, end = text.index(point), text.rindex(point), text.rindex("\n</rdf:RDF>")
    # Twice in another notation: as many as a run leaves for the parser.
    other = text[last:end].replace(point, f"{point} ")
    path = tmp_path / "tracks.rdf"
    path.write_text(f"{text[:first]}\n<!--{text[first:last]}\n-->{2 * other}{text[last:]}")
    graph = by_pattern(path)
    assert graph is None or told(graph) == parsed(path)


POINT = '\t<gf:TrackPoint rdf:about="https://example.org/'
CLASS = "<http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <https://w3id.org/geofield#TrackPoint>"
#: What an editor or another program may make of one place in such a file.
OTHERS = {
    ".rdf": {
        "a comment": ("\t</gf:TrackPoint>\n", "\t</gf:TrackPoint><!-- -->\n"),
        "a base": ("<rdf:RDF ", '<rdf:RDF xml:base="https://example.org/" '),
        "a document type": ("<rdf:RDF ", "<!DOCTYPE rdf:RDF>\n<rdf:RDF "),
        "no UTF-8": ("</gf:planner>", "\udcff</gf:planner>"),
        "not well-formed": ("</gf:planner>", "</gf:plan>"),
        "nested": ("</gf:planner>\n", f'{POINT}x">\n\t</gf:TrackPoint>\n</gf:planner>\n'),
        "two at one": ('/point/8/geometry">', '/point/7/geometry">'),
        "a space in a name": ('gf:basedOn rdf:resource="', 'gf:basedOn rdf:resource=" '),
        "a control character": ("</gf:planner>", "\x02</gf:planner>"),
        "a control reference": ("</gf:planner>", "&#2;</gf:planner>"),
    },
    ".ttl": {
        "a long text": ('dcterms:title "', 'dcterms:title """x" .\n<a:b> dcterms:title "y"""'),
        "a text of lines": ('gf:planner "', "gf:planner '''x\n''', \""),
        "a comment": ("\n<", " # <\n<"),
        "an open statement": ("> a gf:Field ,", ">\n<http://e/p> a gf:Field ,"),
        "another prefix": ('0.1.0" .\n', '0.1.0" .\n@prefix gf: <http://e/> .\n'),
        "another prefix in a line": (
            "/point/9> a gf:TrackPoint ;",
            "/point/9> a gf:Y . @prefix gf: <http://e/> .\n<http://e/z> a gf:TrackPoint ;",
        ),
        "another point": ("> a gf:Field ,", "> a gf:TrackPoint , gf:Field ,"),
    },
    ".nt": {"another point": ("\n", f"\n<http://e/x> {CLASS} .\n")},
    ".jsonld": {
        "words elsewhere": ('"@context": {', '"@context": {"@import": "http://e/c",'),
        "a graph of its own": ('"@graph"', '"@id": "http://e/g", "@graph"'),
        "a space in a name": ('"@id": "https://ex', '"@id": "https:// ex'),
        "a node in a node": ('"@graph": [\n{', '"@graph": [\n{"gf:x": [{},\n{'),
    },
}


@pytest.mark.parametrize(
    ("suffix", "name"), [(suffix, name) for suffix, each in OTHERS.items() for name in each]
)
def test_any_other_form_tells_what_the_parser_tells_or_is_left_to_it(
    text_of, tmp_path, suffix, name
):
    old, new = OTHERS[suffix][name]
    text, path = text_of[suffix], tmp_path / f"tracks{suffix}"
    assert old in text
    path.write_bytes(text.replace(old, new, 1).encode(errors="surrogateescape"))
    graph = by_pattern(path)
    # What the parser refuses is never told.
    assert graph is None or told(graph) == parsed(path)


@pytest.mark.parametrize("host", ["example.org:x", "a@b@c"])
@pytest.mark.parametrize("suffix", [".rdf", ".ttl", ".nt"])
def test_names_that_the_parser_refuses_are_refused(text_of, tmp_path, suffix, host):
    path = tmp_path / f"tracks{suffix}"
    text = text_of[suffix]
    path.write_text(text.replace("https://example.org/", f"https://{host}/"))
    assert by_pattern(path) is None


@pytest.mark.parametrize("suffix", [".ttl", ".nt"])
def test_of_two_values_the_first_in_the_file_stays_the_first(text_of, tmp_path, suffix):
    text, path = text_of[suffix], tmp_path / f"tracks{suffix}"
    point = re.search(r"<[^<>]*/point/7>", text)
    assert point is not None
    after = re.search(r"\.\n(?=<[^<>]*/point/9>)", text)
    assert after is not None
    more = f'{point[0]} <{GF}pointNo> "99"^^<http://www.w3.org/2001/XMLSchema#integer> .\n'
    path.write_text(text[: after.end()] + more + text[after.end() :])
    wanted = Graph()
    wanted.add((q.subject.value, q.predicate.value, q.object.value) for q in ox.parse(path=path))
    assert load(path).columns == wanted.columns


@pytest.mark.parametrize(
    ("suffix", "old", "new"),
    [
        (".rdf", "POINT (33.53", "POINT  (33.53"),
        (".rdf", "/track/7/", "/track/7%20/"),
        (".rdf", "/point/7/geometry", "/point/7&amp;/geometry"),
        (
            ".rdf",
            ">7</gf:pointNo>",
            ">7</gf:pointNo>\n\t\t<gf:x>&lt;b&gt; &amp;amp;</gf:x>",
        ),
        (".rdf", ">9</gf:pointNo>", ">&#57;</gf:pointNo>"),
        (".rdf", ">9</gf:pointNo>", ">9&amp;lt;</gf:pointNo>"),
        (".ttl", "gf:pointNo 9 ;", "gf:pointNo 9, 10 ;"),
        (".ttl", "gf:pointNo 9 ;", "gf:pointNo +9 ;"),
        (".ttl", "POINT (33.53", "POINT\\u0020(33.53"),
        (".ttl", "/point/7/geometry> a", "/point/7/geometry> # seven\n a"),
        (".nt", '"9"^^', '"\\u0039"^^'),
        (".nt", "/track/7/", "/track/7%20/"),
        (".nt", "/point/7/geometry> .", "/point/7/geometry> . # seven"),
        (".jsonld", '"pointNo": "9"', '"pointNo": 9'),
        (".jsonld", '/point/7/geometry"}', '/point/7/geometry", "gf:note": "a \\"b\\""}'),
        (".jsonld", '"onSegment": "https:', '"onSegment": "gf:'),
    ],
)
def test_rows_of_another_form_are_read_in_their_place(text_of, tmp_path, suffix, old, new):
    text, path = text_of[suffix], tmp_path / f"tracks{suffix}"
    assert old in text
    path.write_text(text.replace(old, new, 1))
    graph = load(path)
    assert told(graph) == parsed(path)
    points = [q.subject.value for q in ox.parse(path=path) if q.object.value == GF + "TrackPoint"]
    assert graph.of_type("gf:TrackPoint") == points


@pytest.mark.parametrize("suffix", WRITERS)
def test_names_that_another_place_may_change_are_left_to_the_parser(text_of, tmp_path, suffix):
    # "urn:x/7" is whole, "x:7" among such may be a short form.
    path = tmp_path / f"tracks{suffix}"
    text = text_of[suffix]
    path.write_text(text.replace("https://example.org/", "urn:x:"))
    assert by_pattern(path) is None
    assert told(load(path)) == parsed(path)


WRITTEN = [suffix for suffix in WRITERS if suffix != ".jsonld"]


@pytest.mark.parametrize("suffix", WRITTEN)
def test_points_are_written_as_pyoxigraph_writes_them(tmp_path, suffix):
    syntax = SYNTAXES[suffix]
    name = "a \"b\" 'c' <d> &amp; %s \u00e9"
    dataset = small_plan(spacing_m=2.0, step_m=1.0, name=name)
    for profile in write.PROFILES:
        options = {"rdf_profile": profile, "points": True, "plan_name": name}
        *_, path = WRITERS[suffix](dataset, tmp_path, options=options)
        described = write.describe(dataset, options)
        is_xml = syntax == ox.RdfFormat.RDF_XML
        groups = described.product("tracks") if is_xml else described.everything()
        whole = tmp_path / "whole"
        prefixes = {**PREFIXES, **STUDY_PREFIXES} if profile == "study" else PREFIXES
        ox.serialize(triples(groups), whole, syntax, prefixes=prefixes)
        assert whole.stat().st_size > 500_000
        assert path.read_bytes() == whole.read_bytes()


#: Values that stand in a file in another form than the numbers before them.
UNLIKE = {
    "signs": ("-7", "xsd:integer"),
    "no number": ("seven", "xsd:integer"),
    "exponents": ("1.0E5", "xsd:double"),
    "quotes": ('so "called" \\ so', "xsd:string"),
    "marks": ("<b> &amp; 'c'", "xsd:string"),
    "lines": ("one\ntwo\ttabs", "xsd:string"),
    "per cent": ("%s of 100 %", "xsd:string"),
}


@pytest.mark.parametrize("suffix", WRITTEN)
@pytest.mark.parametrize("what", UNLIKE)
def test_values_of_another_form_are_written_as_pyoxigraph_writes_them(tmp_path, suffix, what):
    syntax, count = SYNTAXES[suffix], 400
    other, datatype = UNLIKE[what]
    values = Texts([*map(str, range(count - 1)), other], datatype)
    names = Texts(f"https://example.org/point/{number}" for number in range(count))
    groups = [(Nodes(names, [(node("rdfs:seeAlso"), values)]),)]
    path, whole = tmp_path / "own", tmp_path / "whole"
    with path.open("wb") as file:
        write_repeated(groups, file, syntax, PREFIXES)
    ox.serialize(triples(groups), whole, syntax, prefixes=PREFIXES)
    assert path.read_bytes() == whole.read_bytes()
