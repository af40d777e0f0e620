"""Four syntaxes, two profiles, one graph."""

from __future__ import annotations

import dataclasses
import re

import pyoxigraph as ox
import pytest
import rdflib
from rdf_plans import small_plan
from rdflib.compare import isomorphic

from geofield.errors import FormatError
from geofield.formats.rdf import write
from geofield.formats.rdf.names import Names
from geofield.formats.rdf.namespaces import node

WRITERS = {
    "xml": write.write_rdfxml,
    "turtle": write.write_turtle,
    "json-ld": write.write_jsonld,
    "nt": write.write_ntriples,
}
BASE = "https://data.farm.example/"


def triples(paths):
    """All triples of files, by a parser that is not rdflib."""
    return {quad.triple for path in paths for quad in ox.parse(path=path)}


@pytest.mark.parametrize("profile", write.PROFILES)
def test_the_four_syntaxes_hold_the_same_triples_and_no_blank_node(plan, tmp_path, profile):
    options = {"rdf_profile": profile, "base_iri": BASE}
    graphs = {
        name: triples(writer(plan, tmp_path, options=options)) for name, writer in WRITERS.items()
    }
    assert len(graphs["nt"]) > 1000
    for name, graph in graphs.items():
        assert graph == graphs["nt"], name
        terms = {term for triple in graph for term in (triple.subject, triple.object)}
        assert not any(isinstance(term, ox.BlankNode) for term in terms)


# rdflib's own JSON-LD parser uses a class that rdflib has deprecated.
@pytest.mark.filterwarnings("ignore:ConjunctiveGraph is deprecated:DeprecationWarning")
@pytest.mark.parametrize("syntax", ["xml", "turtle", "json-ld"])
def test_rdflib_reads_the_same_graph(plan, tmp_path, syntax):
    def graph(name):
        result = rdflib.Graph()
        for path in WRITERS[name](plan, tmp_path, options={"base_iri": BASE}):
            result.parse(path, format=name)
        return result

    assert isomorphic(graph(syntax), graph("nt"))


@pytest.mark.parametrize("writer", WRITERS.values())
def test_two_runs_write_the_same_bytes(tmp_path, writer):
    both = []
    for run in ("a", "b"):
        (tmp_path / run).mkdir()
        both.append([p.read_bytes() for p in writer(small_plan(), tmp_path / run, options={})])
    assert both[0] == both[1]


def test_the_base_names_every_feature(plan, tmp_path):
    graph = triples(write.write_ntriples(plan, tmp_path, options={"base_iri": BASE.rstrip("/")}))
    own = {str(t.subject.value) for t in graph}
    assert all(iri.startswith(BASE) for iri in own)
    field = f"{BASE}field/35.075N33.531E/cy-1"
    names = Names.of(plan, base=BASE)
    assert names.field == field
    assert re.fullmatch(f"{field}/plan/[0-9a-f]{{12}}", names.plan)
    assert f"{names.plan}/track/7/geometry" in own
    assert f"{names.survey}/obstacle/3" in own


@pytest.mark.parametrize(
    "base",
    [
        "farm", "https://a b.example/", "https://a.example/#", "file:///etc/", "https://a/?q=1",
        "https://a:b:c/", "https://a.example/50%/",
    ],
)  # fmt: skip
def test_a_base_that_cannot_name_features_is_refused(plan, tmp_path, base):
    with pytest.raises(FormatError, match="cannot name features"):
        write.write_turtle(plan, tmp_path, options={"base_iri": base})


def test_an_unknown_profile_is_refused(plan, tmp_path):
    with pytest.raises(FormatError, match="Profiles: geosparql, study"):
        write.write_turtle(plan, tmp_path, options={"rdf_profile": "other"})


@pytest.mark.parametrize("name", ["a b/c#d?é", "..", 'x"<y>&{z}', "日本\n"])
def test_any_field_id_becomes_a_valid_iri(tmp_path, name):
    plan = small_plan()
    plan.tables["field"].loc[0, "field_id"] = name
    graphs = [triples(w(plan, tmp_path, options={})) for w in WRITERS.values()]
    assert all(graph == graphs[0] for graph in graphs)
    texts = {t.object.value for t in graphs[0] if t.predicate.value.endswith("terms/identifier")}
    assert texts == {name}


@pytest.mark.parametrize(
    ("licence", "document"),
    [
        ("CC0", "https://creativecommons.org/publicdomain/zero/1.0/"),
        ("CC0 1.0", "https://creativecommons.org/publicdomain/zero/1.0/"),
        ("dl-de by 2.0", "https://www.govdata.de/dl-de/by-2-0"),
        ("https://a.example/terms", "https://a.example/terms"),
        ("https://a.example/terms?of[]=use", None),
        ("all rights reserved", None),
    ],
)
def test_a_licence_that_the_ontology_knows_is_told_by_its_document(tmp_path, licence, document):
    plan = small_plan(spacing_m=30.0)
    source = dataclasses.replace(plan.provenance.source, licence=licence)
    origin = dataclasses.replace(plan.provenance, source=source)
    (path,) = write.write_ntriples(
        dataclasses.replace(plan, provenance=origin), tmp_path, options={}
    )
    told = {q.object.value for q in ox.parse(path=path) if q.predicate == node("dcterms:license")}
    assert told == ({document} if document else set())
