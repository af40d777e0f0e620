"""The ontology, the shapes and the context: made from the tables, sound by themselves."""

from __future__ import annotations

import json

import owlrl
import pyoxigraph as ox
import pytest
import rdflib
from rdflib import OWL, RDF, RDFS

from geofield.formats.rdf.layers import all_terms, layer_maps
from geofield.formats.rdf.namespaces import GF, expand
from geofield.formats.rdf.publish import CONTEXT, ONTOLOGY, SHAPES, published, resource
from geofield.formats.rdf.vocabulary import CLASSES


@pytest.mark.parametrize("name", [ONTOLOGY, SHAPES, CONTEXT])
def test_the_shipped_file_is_what_the_tables_say(name):
    assert resource(name) == published()[name], "run python -m geofield.formats.rdf.publish"


@pytest.fixture(scope="module")
def ontology():
    return rdflib.Graph().parse(data=resource(ONTOLOGY), format="turtle")


def test_every_word_of_geofield_has_label_and_comment(ontology):
    own = {s for s in ontology.subjects() if str(s).startswith(GF)}
    assert len(own) > 60
    for word in own:
        assert ontology.value(word, RDFS.label), word
        assert ontology.value(word, RDFS.comment), word
        assert ontology.value(word, RDFS.isDefinedBy), word


def test_every_word_that_is_written_is_in_the_ontology(plan, tmp_path, ontology):
    from geofield.formats.rdf.write import write_ntriples

    (path,) = write_ntriples(plan, tmp_path, options={})
    defined = {str(s) for s in ontology.subjects()}
    used = set()
    for quad in ox.parse(path=path):
        used |= {t.value for t in (quad.predicate, quad.object) if isinstance(t, ox.NamedNode)}
    assert {iri for iri in used if iri.startswith(GF)} <= defined


def test_properties_have_domain_and_range_and_one_kind(ontology):
    for term in all_terms().values():
        if not term.name.startswith("gf:"):
            continue
        iri = rdflib.URIRef(expand(term.name))
        kinds = set(ontology.objects(iri, RDF.type)) & {OWL.ObjectProperty, OWL.DatatypeProperty}
        assert len(kinds) == 1, term.name
        assert ontology.value(iri, RDFS.domain) is not None, term.name
        assert term.range == "rdfs:Resource" or ontology.value(iri, RDFS.range) is not None


def test_the_classes_are_aligned(ontology):
    def parents(name):
        return {str(p) for p in ontology.objects(rdflib.URIRef(expand(name)), RDFS.subClassOf)}

    assert expand("s4agri:Parcel") in parents("gf:Field")
    assert expand("sosa:Observation") in parents("gf:Detection")
    for layer in layer_maps():
        assert expand("geo:Feature") in parents(layer.cls)
    assert {layer.cls for layer in layer_maps()} <= {each.name for each in CLASSES}


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_plan_under_the_ontology_is_consistent_in_owl_rl(plan, tmp_path, ontology):
    from geofield.formats.rdf.write import write_turtle

    small = type(plan)(
        {name: table.head(2) for name, table in plan.tables.items()}, plan.crs, plan.name
    )
    (path,) = write_turtle(small, tmp_path, options={})
    graph = rdflib.Graph().parse(path)
    graph += ontology
    owlrl.DeductiveClosure(owlrl.OWLRL_Semantics).expand(graph)
    message = rdflib.URIRef("http://www.daml.org/2002/03/agents/agent-ont#error")
    errors = [str(text) for text in graph.objects(predicate=message)]
    # owlrl takes the value 0.0 for "no value" and calls the literal ill-typed.
    assert [text for text in errors if "'0.0'" not in text] == []
    track = rdflib.URIRef("https://example.org/geofield/field/cy-1/track/1")
    assert (track, RDF.type, rdflib.URIRef(expand("geo:Feature"))) in graph
    field = rdflib.URIRef("https://example.org/geofield/field/cy-1")
    assert (track, rdflib.URIRef(expand("dcterms:isPartOf")), field) in graph


def test_the_context_alone_turns_a_plans_json_into_the_same_graph(plan, tmp_path):
    from geofield.formats.rdf.write import write_jsonld

    (path,) = write_jsonld(plan, tmp_path, options={})
    document = json.loads(path.read_text())
    base = document["@context"].pop("@base")
    assert document["@context"] == json.loads(resource(CONTEXT))["@context"]
    document["@context"]["@base"] = base
    again = ox.parse(json.dumps(document).encode(), ox.RdfFormat.JSON_LD)
    assert set(again) == set(ox.parse(path=path))
