"""The ontology, the shapes and the context: sound by themselves, and all that the schema needs."""

from __future__ import annotations

import json

import owlrl
import pyoxigraph as ox
import pytest
import rdflib
from rdflib import OWL, RDF, RDFS

from geofield import schema
from geofield.formats.rdf.graph import label
from geofield.formats.rdf.layers import CODE_LISTS, YES_NO, classes, layer_maps, value_iri
from geofield.formats.rdf.names import Names
from geofield.formats.rdf.namespaces import (
    CONTEXT,
    CONTEXT_TERMS,
    GF,
    ONTOLOGY,
    SH,
    SHAPES,
    expand,
    resource,
)

DATATYPES = {"int": "xsd:integer", "float": "xsd:double", "str": "xsd:string", "date": "xsd:date"}
COLUMNS = [
    pytest.param(layer, column, name, id=f"{layer.layer.name}.{column.name}")
    for layer in layer_maps()
    for column, name in layer.properties()
    if name != "rdfs:label"
]


def range_of(column, name):
    """The datatype of a column's property, or the class of its code list."""
    if name in CODE_LISTS:
        return CODE_LISTS[name]
    return "xsd:boolean" if column.values == YES_NO else DATATYPES[column.type]


@pytest.fixture(scope="module")
def shapes():
    return rdflib.Graph().parse(data=resource(SHAPES), format="turtle")


@pytest.mark.parametrize(("layer", "column", "name"), COLUMNS)
def test_each_column_of_the_schema_is_in_the_ontology(ontology, layer, column, name):
    term = rdflib.URIRef(expand(name))
    assert label(name), "the property needs a label"
    assert ontology.value(term, RDFS.comment), "the property needs a comment"
    kind = OWL.ObjectProperty if name in CODE_LISTS else OWL.DatatypeProperty
    assert (term, RDF.type, kind) in ontology
    if not name.startswith("gf:"):
        return
    domain = ontology.value(term, RDFS.domain)
    union = ontology.value(domain, OWL.unionOf)
    domains = {str(each) for each in (ontology.items(union) if union else [domain])}
    assert set(classes(layer)) <= domains, "the property needs the layer's classes as its domain"
    # A year or a month is all that is known of some pictures.
    wanted = "rdfs:Literal" if column.type == "date" else range_of(column, name)
    assert str(ontology.value(term, RDFS.range)) == expand(wanted)


@pytest.mark.parametrize(("layer", "column", "name"), COLUMNS)
def test_each_column_of_the_schema_is_held_by_a_shape(shapes, layer, column, name):
    sh = rdflib.Namespace(SH)
    mine = {
        prop
        for cls in classes(layer)
        for shape in shapes.subjects(sh.targetClass, rdflib.URIRef(cls))
        for prop in shapes.objects(shape, sh.property)
        if shapes.value(prop, sh.path) == rdflib.URIRef(expand(name))
    }
    assert mine, "no shape of the layer's class has a path for the property"
    assert any(shapes.value(prop, sh.maxCount) == rdflib.Literal(1) for prop in mine)
    lists = [shapes.items(values) for prop in mine for values in shapes.objects(prop, sh["in"])]
    allowed = {str(value) for values in lists for value in values}
    if name in CODE_LISTS:
        assert allowed == {expand(value_iri(value)) for value in column.values}
        return
    if column.values and column.values != YES_NO:
        assert allowed == set(column.values)
    if column.type != "date":
        kinds = {str(shapes.value(prop, sh.datatype)) for prop in mine} - {"None"}
        assert kinds == {expand(range_of(column, name))}


@pytest.mark.parametrize(("layer", "column", "name"), COLUMNS)
def test_each_column_of_the_schema_has_a_term_in_the_context(layer, column, name):
    entry = CONTEXT_TERMS[name.partition(":")[2]]
    wanted = "@id" if name in CODE_LISTS else range_of(column, name)
    assert entry == {"@id": name} | ({} if wanted == "xsd:string" else {"@type": wanted})


def test_each_value_of_a_code_list_is_in_the_ontology(ontology):
    lists = {"gf:ReviewStatus": schema.STATUSES, "gf:ObstacleKind": schema.KINDS}
    for name, values in lists.items():
        told = {str(s) for s in ontology.subjects(RDF.type, rdflib.URIRef(expand(name)))}
        assert told == {expand(value_iri(value)) for value in values}


def test_the_context_holds_no_term_that_the_ontology_does_not_explain():
    terms = [entry["@id"] for entry in CONTEXT_TERMS.values() if isinstance(entry, dict)]
    assert [name for name in terms if not label(name)] == []


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
    kinds = (OWL.ObjectProperty, OWL.DatatypeProperty)
    own = {s for kind in kinds for s in ontology.subjects(RDF.type, kind) if str(s).startswith(GF)}
    assert len(own) > 50
    for term in own:
        assert sum((term, RDF.type, kind) in ontology for kind in kinds) == 1, term
        assert ontology.value(term, RDFS.domain) is not None, term
        # The identifier of a CRS is a name, of no class.
        assert ontology.value(term, RDFS.range) is not None or term == rdflib.URIRef(
            GF + "metricCrs"
        )


def test_the_classes_are_aligned(ontology):
    def parents(name):
        return {str(p) for p in ontology.objects(rdflib.URIRef(expand(name)), RDFS.subClassOf)}

    assert expand("s4agri:Parcel") in parents("gf:Field")
    assert expand("sosa:Observation") in parents("gf:Detection")
    for layer in layer_maps():
        for cls in classes(layer):
            assert expand("geo:Feature") in parents(cls)


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
    names = Names.of(small)
    track = rdflib.URIRef(f"{names.plan}/track/1")
    assert (track, RDF.type, rdflib.URIRef(expand("geo:Feature"))) in graph
    field = rdflib.URIRef(names.field)
    assert (track, rdflib.URIRef(expand("dcterms:isPartOf")), field) in graph


def test_the_context_alone_turns_a_plans_json_into_the_same_graph(plan, tmp_path):
    from geofield.formats.rdf.write import write_jsonld

    (path,) = write_jsonld(plan, tmp_path, options={})
    document = json.loads(path.read_text())
    assert document["@context"] == json.loads(resource(CONTEXT))["@context"]
    again = ox.parse(json.dumps(document).encode(), ox.RdfFormat.JSON_LD)
    assert set(again) == set(ox.parse(path=path))
