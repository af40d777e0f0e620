"""Nothing that is read or asked opens a connection: told by a server that counts them."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading

import pytest

from geofield.errors import FormatError
from geofield.formats.rdf import write
from geofield.formats.rdf.guard import check_query
from geofield.formats.rdf.query import queries


class Listener:
    """A port of this machine that notes every connection and answers nothing."""

    def __init__(self) -> None:
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.address = f"http://127.0.0.1:{self.socket.getsockname()[1]}/data"
        self.connections = 0
        threading.Thread(target=self._count, daemon=True).start()

    def _count(self) -> None:
        while True:
            try:
                connection, _ = self.socket.accept()
            except OSError:
                return
            self.connections += 1
            connection.close()


@pytest.fixture
def listener():
    one = Listener()
    yield one
    one.socket.close()


@pytest.fixture(scope="module")
def file(plan, tmp_path_factory):
    return write.write_turtle(plan, tmp_path_factory.mktemp("rdf"), options={})[0]


def geofield(*arguments):
    """The installed command as a process; no proxy may hide where it connects to."""
    environment = {k: v for k, v in os.environ.items() if "proxy" not in k.lower()}
    command = [sys.executable, "-m", "geofield", *map(str, arguments)]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=120, check=False, env=environment
    )


OUTWARD = {
    "service": "SELECT * WHERE {{ SERVICE <{0}> {{ ?s ?p ?o }} }}",
    "silent service": "SELECT * WHERE {{\n service silent <{0}> {{ ?s ?p ?o }} }}",
    "service without spaces": "SELECT*{{?a a ?b.SERVICE<{0}>{{?s ?p ?o}}}}",
    "service of a variable": "SELECT * {{ VALUES ?x {{ <{0}> }} SERVICE ?x {{ ?s ?p ?o }} }}",
    "service by a prefix": "PREFIX e: <{0}> SELECT * {{ SERVICE e: {{ ?s ?p ?o }} }}",
    "service after a text": 'SELECT * {{ BIND("# \\" S" AS ?t) SERVICE <{0}> {{ ?s ?p ?o }} }}',
    "service in a subquery": "SELECT * {{ {{ SELECT ?s {{ SERVICE <{0}> {{ ?s ?p ?o }} }} }} }}",
    "service behind a comparison": "SELECT * {{ ?s ?p ?o FILTER(?o<1)"
    "SERVICE#>\n<{0}>{{?a ?b ?c}} }}",
    "service glued to a number": "SELECT * {{ ?s ?p 1SERVICE<{0}>{{?a ?b ?c}} }}",
    "service glued to a truth value": "SELECT * {{ ?s ?p trueSERVICE<{0}>{{?a ?b ?c}} }}",
    "service glued to a name": "PREFIX : <{0}> SELECT * {{ SERVICE:x{{?a ?b ?c}} }}",
    "service after an empty name": "PREFIX e: <{0}> SELECT * {{ ?s ?p e:.SERVICE e:{{?a ?b ?c}} }}",
    "service after a quote in a name": "SELECT * {{ ?s <{0}'> ?o SERVICE <{0}> {{?a ?b ?c}} #'\n}}",
    "from": "SELECT * FROM <{0}> WHERE {{ ?s ?p ?o }}",
    "from named": "SELECT * FROM NAMED <{0}> WHERE {{ GRAPH ?g {{ ?s ?p ?o }} }}",
    "load": "LOAD <{0}>",
}


@pytest.mark.parametrize("name", OUTWARD)
def test_a_query_that_reaches_out_is_refused_and_connects_to_nothing(
    file, tmp_path, listener, name
):
    query = tmp_path / "own.rq"
    query.write_text(OUTWARD[name].format(listener.address))
    result = geofield("query", file, query)
    assert result.returncode == 1, result.stderr
    assert "Traceback" not in result.stderr
    assert "asks for data elsewhere" in result.stderr
    assert result.stdout == ""
    assert listener.connections == 0


DOCUMENTS = {
    "context.jsonld": '{{"@context": "{0}", "@id": "http://e/"}}',
    "second_context.jsonld": '{{"@context": [{{}}, "{0}"], "a": 1}}',
    "import.jsonld": '{{"@context": {{"@import": "{0}"}}, "a": 1}}',
    "escaped_context.jsonld": '{{"\\u0040context": "{0}", "a": 1}}',
    "inner_context.jsonld": '{{"@context": {{"k": {{"@id": "http://e/k", "@context": "{0}"}}}}, '
    '"k": {{"a": 1}}}}',
    "entity.rdf": '<!DOCTYPE r [<!ENTITY a SYSTEM "{0}">]><rdf:RDF '
    'xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"><a>&a;</a></rdf:RDF>',
    "doctype.rdf": '<!DOCTYPE r SYSTEM "{0}"><rdf:RDF '
    'xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"/>',
    "imports.ttl": "@prefix owl: <http://www.w3.org/2002/07/owl#> . <http://e/o> a owl:Ontology ; "
    "owl:imports <{0}> .",
}


@pytest.mark.parametrize("command", ["validate", "query", "export"])
@pytest.mark.parametrize("name", DOCUMENTS)
def test_a_document_that_names_others_connects_to_nothing(tmp_path, listener, name, command):
    path = tmp_path / name
    path.write_text(DOCUMENTS[name].format(listener.address))
    further = {
        "validate": [path],
        "query": [path, "length-per-track"],
        "export": [path, "--format", "geojson", "--out", tmp_path / "out"],
    }
    result = geofield(command, *further[command])
    assert "Traceback" not in result.stderr
    assert listener.connections == 0
    if command == "validate":
        assert "error:" in result.stderr
    else:
        # An ontology's import is no order to fetch it: the file itself can be asked.
        wanted = 0 if (name, command) == ("imports.ttl", "query") else 1
        assert result.returncode == wanted, result.stderr


@pytest.mark.parametrize(
    "text",
    [
        "SELECT ?service ?from ?load WHERE { ?service ?from ?load }",
        "SELECT * { ?s rdfs:label \"the SERVICE at <http://a/>\", 'from' } # LOAD",
        "PREFIX service: <http://a/service#>\nSELECT * { ?s service:load <http://a/FROM> }",
        "SELECT * { ?s e:from ?service . GRAPH <http://a/service> { ?a ?b ?c } }",
    ],
)
def test_the_words_are_free_in_names_texts_and_comments(text):
    check_query(text)


def test_the_queries_of_the_package_pass_and_the_line_is_told():
    for query in queries().values():
        check_query(query.sparql)
    with pytest.raises(FormatError, match=r"line 3: SERVICE"):
        check_query('SELECT * {\n # FROM\n SERVICE <http://a/> { ?s ?p "x" } }')
