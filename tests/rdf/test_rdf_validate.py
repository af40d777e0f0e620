# ruff: noqa: E501 - tables of broken files read best as tables
"""Sound files have no problems; broken ones are found, and the broken thing is named."""

from __future__ import annotations

import dataclasses
import re
import time

import pyshacl
import pytest
import rdflib
from rdf_plans import plan_across_180, plan_at, small_plan

from geofield.formats.rdf import write
from geofield.formats.rdf.names import Names
from geofield.formats.rdf.namespaces import SH, SHAPES, compact, resource
from geofield.formats.rdf.parse import parse
from geofield.formats.rdf.shapes import shape_problems
from geofield.formats.rdf.validate import check

WRITERS = {
    "xml": write.write_rdfxml,
    "turtle": write.write_turtle,
    "json-ld": write.write_jsonld,
    "nt": write.write_ntriples,
}


@pytest.mark.parametrize("profile", write.PROFILES)
@pytest.mark.parametrize("syntax", WRITERS)
def test_every_product_is_sound(plan, tmp_path, profile, syntax):
    for path in WRITERS[syntax](plan, tmp_path, options={"rdf_profile": profile}):
        assert list(check(path)) == []


@pytest.mark.parametrize("syntax", WRITERS)
def test_every_product_across_180_is_sound(tmp_path, syntax):
    for path in WRITERS[syntax](plan_across_180(), tmp_path, options={}):
        assert list(check(path)) == []


def test_a_product_near_a_pole_is_sound(tmp_path):
    for path in write.write_turtle(plan_at(20.0, 84.5, "EPSG:5041"), tmp_path, options={}):
        assert list(check(path)) == []


def test_files_of_a_plan_without_obstacles_or_tracks_are_sound(plan, tmp_path):
    for absent in ({"obstacles"}, {"tracks", "segments", "gaps"}):
        tables = {name: table for name, table in plan.tables.items() if name not in absent}
        bare = dataclasses.replace(plan, tables=tables, points=None)
        paths = write.write_rdfxml(bare, tmp_path, options={})
        assert [each for path in paths for each in check(path)] == []
    (tmp_path / "other.rdf").write_text(
        '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"/>', encoding="utf-8"
    )
    assert "no field" in str(list(check(tmp_path / "other.rdf")))


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A small sound plan in both profiles, as Turtle."""
    plan = small_plan(spacing_m=12, step_m=40)
    texts = {}
    for profile in write.PROFILES:
        folder = tmp_path_factory.mktemp(profile)
        options = {"rdf_profile": profile, "points": True}
        (path,) = write.write_turtle(plan, folder, options=options)
        text, names = path.read_text(), Names.of(plan)
        # Short names, so that the tables below can be read.
        for long, short in ((names.survey, S), (names.plan, P), (names.run, R), (names.dataset, D)):
            text = text.replace(long, BASE + short)
        texts[profile] = text.replace(names.field, BASE + F)
    return texts


BASE = "https://example.org/geofield/"
F, S, P, R, D = "field/cy-1", "survey/1", "plan/1", "run/1", "dataset/1"
# name: profile, subject that must be named, class, pattern in its block, replacement, words
BROKEN = {
    "field without id": (F, "gf:Field", r'dcterms:identifier "cy-1"', 'rdfs:comment "x"', "no ident"),
    "area negative": (S, "gf:Survey", r'areaInHectares "[^"]*"', 'areaInHectares "-1"', "out of b"),
    "area untyped": (S, "gf:Survey", r'areaInHectares "[^"]*"\^\^xsd:double', "areaInHectares 3", "3"),
    "two headings": (P, "gf:TrackPlan", r'(gf:headingInDegrees) ("83.0"\S+)', r'\1 \2, "84"^^xsd:double',
                     "more than one heading"),
    "swapped axes of the outline": (S + "/geometry", "sf:Polygon", r"POLYGON .*?\"\^\^",
                                    'POLYGON ((35 133, 36 133, 36 134, 35 133))"^^', "not longitudes"),
    "unknown crs": (S + "/geometry", "sf:Polygon", r"OGC/1\.3/CRS84", "OGC/1.3/CRS85", "CRS"),
    "no wkt": (S + "/geometry", "sf:Polygon", r"geo:asWKT .*\n", 'rdfs:comment "x" ;\n', "no as wkt"),
    "broken wkt": (S + "/geometry", "sf:Polygon", r"\)\)\"", ')"', "not WKT"),
    "outline as a line": (S + "/geometry", "sf:Polygon", r"POLYGON \(\(([^)]*)\).*?\"\^\^",
                          r'LINESTRING (\1)"^^', "reads"),
    "metric default geometry": (F, "gf:Field", r"(hasDefaultGeometry <\S+/geometry)>",
                                r"\1/EPSG-32636>", "default geometry"),
    "no default geometry": (F, "gf:Field", r"geo:hasDefaultGeometry \S+ ;", "", "has default geom"),
    "obstacle without number": (S + "/obstacle/1", "gf:Obstacle", r"gf:obstacleNo 1 ;", "", "number"),
    "obstacle number twice": (S + "/obstacle/2", "gf:Obstacle", r"gf:obstacleNo 2", "gf:obstacleNo 1",
                              "same obstacle number 1"),
    "obstacle number a text": (S + "/obstacle/1", "gf:Obstacle", r"gf:obstacleNo 1", 'gf:obstacleNo "1"',
                               "whole number"),
    "unknown status": (S + "/obstacle/1", "gf:Obstacle", r"gf:Detected", "gf:Seen", "not allowed"),
    "no kind": (S + "/obstacle/1", "gf:Obstacle", r"gf:kind gf:Tree ;", "", "no kind"),
    "radius NaN": (S + "/obstacle/1", "gf:Obstacle", r'(radiusInMetres) "[^"]*"', r'\1 "NaN"', "NaN"),
    "radius infinite": (S + "/obstacle/1", "gf:Obstacle", r'(radiusInMetres) "[^"]*"', r'\1 "INF"',
                        "out of bounds"),
    "radius a word": (S + "/obstacle/1", "gf:Obstacle", r'(radiusInMetres) "[^"]*"', r'\1 "big"',
                      "no xsd:double"),
    "confidence above one": (S + "/obstacle/1", "gf:Obstacle", r'(confidence) "[^"]*"', r'\1 "1.5"',
                             "out of bounds"),
    "latitude 95": (S + "/obstacle/1", "gf:Obstacle", r'(wgs84:lat) "[^"]*"', r'\1 "95.0"',
                    "out of bounds"),
    "swapped position": (S + "/obstacle/1", "gf:Obstacle",
                         r'(wgs84:lat) ("[^"]*")(.*?wgs84:long) ("[^"]*")', r"\1 \4\3 \2", "swapped"),
    "track number a decimal": (P + "/track/1", "gf:Track", r"gf:trackNo 1", "gf:trackNo 1.5", "1.5"),
    "track number twice": (P + "/track/2", "gf:Track", r"gf:trackNo 2", "gf:trackNo 1", "same track"),
    "track length negative": (P + "/track/1", "gf:Track", r'(hasMetricLength) "', r'\1 "-', "out of"),
    "segment on no track": (P + "/track/1/segment/1", "gf:Segment", r"gf:onTrack \S+ ;", "", "on track"),
    "segment on a track that is not there": (P + "/track/1/segment/1", "gf:Segment",
                                             r"(gf:onTrack <\S+)1>", r"\g<1>99>", "no gf:Track"),
    "gap without cause": (P + "/track/2/gap/1", "gf:Gap", r'gf:cause "[^"]*" ;', "", "no cause"),
    "gap caused by a text": (P + "/track/2/gap/1", "gf:Gap", r"gf:causedBy \S+", 'gf:causedBy "3"',
                             "no IRI"),
    "point without number": (P + "/point/1", "gf:TrackPoint", r"gf:pointNo 1 ;", "", "point number"),
    "point number twice": (P + "/point/2", "gf:TrackPoint", r"gf:pointNo 2", "gf:pointNo 1", "same"),
    "point moved away": (P + "/point/1/geometry", "sf:Point", r"POINT \(\S+", "POINT (33.9", "far outside"),
    "headland width negative": (P + "/headland/1", "gf:Headland", r'(widthInMetres) "', r'\1 "-', "out"),
    "headland pass missing": (P + "/headland-track/1/segment/1", "gf:HeadlandTrack",
                              r"gf:passNo 1 ;", "", "no pass"),
    "route step of unknown kind": (P + "/route/1", "gf:RouteStep", r'stepKind "work"', 'stepKind "fly"',
                                   "not allowed"),
    "sequence twice": (P + "/route/2", "gf:RouteStep", r"gf:sequence 2", "gf:sequence 1", "same sequence"),
    "route step before a lost one": (P + "/route/1", "gf:RouteStep", r"(gf:nextStep <\S+)2>", r"\g<1>999>",
                                     "no gf:RouteStep"),
    "turn that fits perhaps": (P + "/turn/1", "gf:Turn", r'gf:fits true', 'gf:fits "perhaps"^^xsd:boolean',
                               "no xsd:boolean"),
    "turn to a lost track": (P + "/turn/1", "gf:Turn", r"(gf:toTrack <\S+)2>", r"\g<1>77>", "no gf:Track"),
    "plan of no field": (P, "gf:TrackPlan", r"gf:inField \S+ ;", "", "no in field"),
    "detection of nothing": (S + "/obstacle/1/detection", "gf:Detection",
                             r"sosa:hasFeatureOfInterest \S+ ;", "", "hasFeatureOfInterest"),
    "detection result above one": (S + "/obstacle/1/detection", "gf:Detection",
                                   r'(sosa:hasSimpleResult) "[^"]*"', r'\1 "7.0"', "out of bounds"),
    "dataset without title": (D, "dcat:Dataset", r'dcterms:title "North" ;', "", "title"),
    "dataset in a crs of its own": (D, "dcat:Dataset", r"(gf:metricCrs) \S+",
                                    r"\1 <http://my.example/crs>", "reads"),
    "settings given twice": (R, "prov:Activity", r"(gf:settings) ", r'\1 "{}", ', "more than"),
}  # fmt: skip
STUDY_BROKEN = {
    "tree without the study's number": (S + "/obstacle/1", "po:tree", r"obstacle:no \S+ ;", "", "no"),
    "tree number a decimal": (S + "/obstacle/1", "po:tree", r'obstacle:no "1"\S+', "obstacle:no 1.0",
                              "typed"),
    "point beyond the pole": (P + "/point/1", "gml:point", r'(gml:lat) "[^"]*"', r'\1 "91.0"', "out"),
    "point without track": (P + "/point/1", "gml:point", r"trajectory:track \S+ ;", "", "track"),
    "study point number twice": (P + "/point/2", "gml:point", r'trajectory:no "2"', 'trajectory:no "1"',
                                 "same point number"),
}  # fmt: skip


def broken_file(text, subject, cls, pattern, replacement):
    """The text with one change in the block of a subject; where it starts."""
    start = text.index(f"\n<{BASE}{subject}> a {cls}") + 1
    end = text.index(" .\n", start)
    block, count = re.subn(pattern, replacement, text[start:end], count=1, flags=re.DOTALL)
    assert count == 1, "the change did not apply"
    return text[:start] + block + text[end:], text.count("\n", 0, start) + 1


@pytest.mark.parametrize(
    ("profile", "name"),
    [("geosparql", name) for name in BROKEN] + [("study", name) for name in STUDY_BROKEN],
)
def test_a_broken_file_is_found_and_the_thing_named(sound, tmp_path, profile, name):
    subject, cls, pattern, replacement, words = {**BROKEN, **STUDY_BROKEN}[name]
    text, line = broken_file(sound[profile], subject, cls, pattern, replacement)
    path = tmp_path / "broken.ttl"
    path.write_text(text)
    findings = list(check(path))
    full = f"<{BASE}{subject}>"
    # A broken geometry is told of itself or of the feature that has it.
    subjects = (full, full.replace("/geometry>", ">"))
    named = [f for f in findings if f.where.endswith(subjects) and words.lower() in str(f).lower()]
    assert named, findings
    assert any(f.where.startswith(f"line {line}, ") for f in findings) or (
        not named[0].where.endswith(full)
    )


def findings_of_pyshacl(path):
    """Focus node, path and constraint of everything that pySHACL finds."""
    sh = rdflib.Namespace(SH)
    shapes = rdflib.Graph().parse(data=resource(SHAPES), format="turtle")
    data = rdflib.Graph().parse(path)
    _, report, _ = pyshacl.validate(data, shacl_graph=shapes, inference="none")
    found = set()
    for result in report.subjects(rdflib.RDF.type, sh.ValidationResult):
        kind = str(report.value(result, sh.sourceConstraintComponent)).rpartition("#")[2]
        where = report.value(result, sh.resultPath)
        named = compact(str(where)) if isinstance(where, rdflib.URIRef) else "default geometry"
        kind = kind.removesuffix("ConstraintComponent")
        rule = f"{kind[0].lower()}{kind[1:]}" + ("" if where is None else f" {named}")
        found.add((str(report.value(result, sh.focusNode)), rule))
    return found


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("profile", write.PROFILES)
def test_the_shapes_find_what_pyshacl_finds(sound, tmp_path, profile, monkeypatch):
    # rdflib must not tidy the texts.
    monkeypatch.setattr(rdflib, "NORMALIZE_LITERALS", False)
    path = tmp_path / "broken.ttl"
    cases = BROKEN if profile == "geosparql" else STUDY_BROKEN
    for name, (subject, cls, pattern, replacement, _) in cases.items():
        text = broken_file(sound[profile], subject, cls, pattern, replacement)[0]
        # The first ones of each kind are enough: pySHACL takes a millisecond for each.
        blocks = text.split(" .\n<")
        many = re.compile(r"\S+/(point|track|route|turn)/(?!1\b)")
        path.write_text(" .\n<".join([b for b in blocks[:-1] if not many.match(b)] + blocks[-1:]))
        mine = {(p.subject.strip("<>"), p.rule) for p in shape_problems(parse(path))}
        theirs = findings_of_pyshacl(path)
        # No bound can be compared with NaN: both are broken, of which pySHACL tells one.
        assert (mine >= theirs) if name == "radius NaN" else (mine == theirs), name


def test_a_subclass_of_a_planners_own_is_held_to_the_shapes(tmp_path):
    path = tmp_path / "own.ttl"
    path.write_text(
        "@prefix gf: <https://w3id.org/geofield#> . @prefix my: <https://p.example/> .\n"
        "@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .\n"
        "my:Lane rdfs:subClassOf gf:Track .\nmy:one a my:Lane .\nmy:f a gf:Field ."
    )
    assert any(each.where.endswith("<https://p.example/one>") for each in check(path))


def test_each_shape_is_broken_at_least_once():
    touched = {cls for _, cls, *_ in [*BROKEN.values(), *STUDY_BROKEN.values()]}
    touched |= {"geo:Geometry" if "sf:Polygon" in touched else ""}
    targets = re.findall(r"sh:targetClass (.*?) ;", resource(SHAPES))
    named = {compact(name.strip(" <>")) for text in targets for name in text.split(",")}
    # Candidates keep the shape of obstacles.
    study = {"http://purl.obolibrary.org/obo/PO_0000003/hasNarrowSynonym#tree": "po:tree",
             "http://www.opengis.net/gml/point": "gml:point"}  # fmt: skip
    assert {study.get(name, name) for name in named} - {"gf:Candidate"} <= touched
    assert len(BROKEN) + len(STUDY_BROKEN) >= 25


def test_a_blank_node_is_named(sound, tmp_path):
    path = tmp_path / "blank.ttl"
    path.write_text(sound["geosparql"] + "\n_:it a gf:Track ; gf:trackNo 99 .\n")
    told = [each.message for each in check(path)]
    assert any("no IRI" in each for each in told)
    assert any(each.startswith("Has no default geometry (geo:hasDefault") for each in told)


XML = '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:e="http://e/">'
BOMB = "".join(
    f'<!ENTITY {name} "{f"&{inner};" * 10}">'
    for inner, name in zip("abcdefghi", "bcdefghij", strict=True)
)
HOSTILE = {
    "entities that grow": ("x.rdf", f'<!DOCTYPE r [<!ENTITY a "aaaaaaaa">{BOMB}]>{XML}<e:p>&j;</e:p>',
                           "other entities"),
    "long entities": ("x.rdf", f'<!DOCTYPE r [<!ENTITY a "{"a" * 999}">]>{XML}{"&a;" * 9999}', "long"),
    "many entities": (
        "x.rdf",
        "<!DOCTYPE r [" + "".join(f'<!ENTITY a{i} "b">' for i in range(200)) + f"]>{XML}</rdf:RDF>",
        "too many"),
    "a local file": ("x.rdf", f'<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]>{XML}&a;',
                     "external"),
    "a parameter entity": ("x.rdf", f'<!DOCTYPE r [<!ENTITY % a SYSTEM "http://127.0.0.1:9/">%a;]>{XML}',
                           "external or parameter"),
    "an external doctype": ("x.rdf", f'<!DOCTYPE r SYSTEM "http://127.0.0.1:9/a.dtd">{XML}', "external"),
    "huge nesting": ("x.rdf", XML + "<e:a><e:b>" * 200_000, "nested deeper"),
    "nested arrays": ("x.jsonld", "[" * 300_000, "stack"),
    "a context on the network": ("x.jsonld", '{"@context": "http://127.0.0.1:9/c", "@id": "http://e/"}',
                                 "does not fetch"),
    "contexts in a list": ("x.jsonld", '{"@context": [{}, "http://127.0.0.1:9/c"], "a": 1}', "context"),
    "an iri with a space": ("x.ttl", "<http://e/a b> a <http://e/c> .", "line 1"),
    "an iri with a space in xml": ("x.rdf", f'{XML}\n<e:a rdf:about="http://e/a b"/></rdf:RDF>', "line 2"),
    "an iri with a space in json": ("x.jsonld", '{\n"@id": "http://e/a b", "http://e/p": 1}', "line 2"),
    "not xml": ("x.rdf", "GIF89a", "well-formed"),
    "cut off": ("x.nt", "<http://e/a> <http://e/p> \"x", "line 1"),
    "binary": ("x.ttl", "\0\1\2", "line 1"),
    "nothing of ours": ("x.ttl", "<http://e/a> <http://e/p> 1 .", "no field"),
    "empty": ("x.ttl", "", "no field"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_and_broken_syntax_is_refused_quickly(tmp_path, name):
    file, text, words = HOSTILE[name]
    path = tmp_path / file
    path.write_text(text)
    start = time.perf_counter()
    findings = list(check(path))
    assert time.perf_counter() - start < 2.0
    assert len(findings) == 1
    assert words in str(findings[0])


def test_plain_entities_as_ontology_editors_write_them_are_fine(tmp_path):
    path = tmp_path / "x.rdf"
    path.write_text(
        '<!DOCTYPE rdf:RDF [<!ENTITY gf "https://w3id.org/geofield#">]>'
        '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"'
        ' xmlns:gf="https://w3id.org/geofield#">'
        '<rdf:Description rdf:about="http://e/t"><rdf:type rdf:resource="&gf;Track"/>'
        "</rdf:Description></rdf:RDF>"
    )
    assert any("no track number" in each.message for each in check(path))


#: Nesting that text, comments and attributes hide.
HIDDEN = {
    "ends of tags in the text": "<e:a>/>" * 150 + "</e:a>" * 150,
    "ends of tags in comments": "<e:a><!--</e:a>-->" * 150 + "</e:a>" * 150,
    "ends of tags in attributes": '<e:a x="/>">' * 150 + "</e:a>" * 150,
}


@pytest.mark.parametrize("name", HIDDEN)
def test_nesting_is_found_however_it_is_hidden(tmp_path, name):
    path = tmp_path / "x.rdf"
    path.write_text(f"{XML}{HIDDEN[name]}</rdf:RDF>")
    assert ["nested deeper" in each.message for each in check(path)] == [True]


@pytest.mark.parametrize("text", [XML, f"{XML}</rdf:RDF>x", f"{XML}</rdf:RDF>{XML}</rdf:RDF>"])
def test_a_file_cut_off_or_with_more_behind_it_is_refused(tmp_path, text):
    path = tmp_path / "x.rdf"
    path.write_text(text)
    assert ["well-formed" in each.message for each in check(path)] == [True]
