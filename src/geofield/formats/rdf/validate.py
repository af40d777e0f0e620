"""Validate: an RDF file against syntax, shapes and checks, told in plain words with lines."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

from geofield.errors import FormatError
from geofield.formats.rdf.checks import check_graph
from geofield.formats.rdf.graph import Graph
from geofield.formats.rdf.layers import layer_maps
from geofield.formats.rdf.namespaces import GF
from geofield.formats.rdf.parse import Problem, parse
from geofield.formats.rdf.shapes import shape_problems
from geofield.formats.validation import Finding

_BASE = re.compile(r'(?:@base\s+<|BASE\s+<|xml:base\s*=\s*"|"@base"\s*:\s*")([^">]*)[">]')
#: In the head of every RDF/XML file that geofield writes.
_GEOFIELD = f'xmlns:gf="{GF}"'.encode()
_PREFIX = re.compile(r"@?prefix\s+([\w-]*):\s*<([^>]*)>", re.IGNORECASE)


def check(path: Path) -> Iterator[Finding]:
    """Everything that is wrong with a file, in the order of its lines.

    A file that is hostile or not valid in its syntax has one finding: nothing more can be said
    of it.
    """
    try:
        quads = list(parse(path))
    except FormatError as error:
        line = re.search(r"line (\d+)", error.message)
        message = error.message.split(": ", 1)[-1]
        syntax = Problem(path.name, "syntax", message, error.hint or "")
        yield _told(syntax, int(line[1]) if line else None)
        return
    graph = Graph.of(quads)
    known = [iri for layer in layer_maps() for iri in layer.known_as]
    if not quads and _GEOFIELD in path.read_bytes()[:20_000]:
        return  # one of a plan's three files: it has no obstacles, or no tracks
    if not graph.of_type(*known):
        yield _told(Problem(path.name, "empty", "It holds no field, obstacle or track."))
        return
    problems = {*shape_problems(quads), *check_graph(graph)}
    lines = _lines({problem.subject for problem in problems}, path)
    for problem in sorted(problems, key=lambda each: (lines[each.subject] or math.inf, each)):
        yield _told(problem, lines[problem.subject])


def _told(problem: Problem, line: int | None = None) -> Finding:
    """The line and the subject, the message as a sentence, and what to do."""
    where = f"line {line}, {problem.subject}" if line else problem.subject
    words = f"{problem.message[:1].upper()}{problem.message[1:]} {problem.hint}".strip()
    return Finding("error", where, words)


def _lines(subjects: set[str], path: Path) -> dict[str, int | None]:
    """The line at which each subject is described first."""
    text = path.read_text(encoding="utf-8", errors="replace") if subjects else ""
    base = _BASE.search(text[:20_000])
    prefixes = _PREFIX.findall(text[:20_000])
    lines: dict[str, int | None] = {}
    for subject in subjects:
        iri = subject.removeprefix("<").removesuffix(">")
        names = [iri, *(f"{p}:{iri[len(n) :]}" for p, n in prefixes if iri.startswith(n))]
        if base and base[1] and iri.startswith(base[1]):
            names.insert(0, iri[len(base[1]) :])
        lines[subject] = next(filter(None, (_line_of(name, text) for name in names)), None)
    return lines


def _line_of(name: str, text: str) -> int | None:
    """Where a name, absolute or relative, is described; else where it stands first."""
    name = re.escape(name)
    subject = rf'^\s*<{name}>|^\s*{name}\s|about="{name}"|^\s*\{{\s*"@id": *"{name}"'
    for pattern in (subject, rf'[<"\s]{name}[>"\s]'):
        match = re.search(pattern, text, re.MULTILINE)
        if match:
            start = match.start() + len(match[0]) - len(match[0].lstrip())
            return text.count("\n", 0, start) + 1
    return None
