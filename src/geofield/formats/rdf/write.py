"""Writers: a dataset to RDF/XML, Turtle, JSON-LD and N-Triples as a stream, and to rdflib.

All take one field or more, each under its own names, and the options ``rdf_profile``
(``geosparql`` or ``study``), ``base_iri``, ``plan_name`` (name of the track plan) and ``points``:
whether track points are written, which the study's profile does unless told not to and the other
when asked.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyoxigraph as ox

from geofield.errors import FormatError
from geofield.formats.rdf.describe import PRODUCTS, Description
from geofield.formats.rdf.names import Names
from geofield.formats.rdf.parse import SYNTAXES
from geofield.formats.rdf.repeated import write_repeated
from geofield.formats.rdf.study import StudyDescription
from geofield.formats.rdf.triples import triples
from geofield.model.dataset import Dataset

if TYPE_CHECKING:
    import rdflib

Fields = Dataset | Sequence[Dataset]
#: By its name what describes a dataset; the first one is taken unasked.
PROFILES = {"geosparql": Description, "study": StudyDescription}


def _writer(suffix: str, **given: str) -> Callable[..., list[Path]]:
    """What writes one file of all products, or of RDF/XML a file for each; with options given."""
    syntax = SYNTAXES[suffix]

    def write(
        fields: Fields, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
    ) -> list[Path]:
        told: dict[Path, Sequence[str]] = {folder / f"{stem}{suffix}": PRODUCTS}
        if syntax == ox.RdfFormat.RDF_XML:
            # A stem other than `field` stands before the names: `north_obstacles.rdf`.
            before = "" if stem == "field" else f"{stem}_"
            told = {folder / f"{before}{product}{suffix}": (product,) for product in PRODUCTS}
        options = {**options, **given}
        each_field = [fields] if isinstance(fields, Dataset) else fields
        described = [describe(each, options) for each in each_field]
        for path, products in told.items():
            groups = (
                group for each in described for name in products for group in each.product(name)
            )
            with path.open("wb") as file:
                write_repeated(groups, file, syntax, described[0].prefixes)
        return list(told)

    return write


write_rdfxml = _writer(".rdf")
#: RDF/XML in the study's vocabulary.
write_study = _writer(".rdf", rdf_profile="study")
write_turtle = _writer(".ttl")
#: The context stands inside the file.
write_jsonld = _writer(".jsonld")
write_ntriples = _writer(".nt")


def to_graph(dataset: Dataset, options: Mapping[str, Any]) -> rdflib.Graph:
    """The dataset as an rdflib graph, prefixes bound."""
    import rdflib

    described = describe(dataset, options)
    text = ox.serialize(triples(described.everything()), format=ox.RdfFormat.N_TRIPLES)
    graph = rdflib.Graph().parse(data=text, format="nt")
    for prefix, namespace in described.prefixes.items():
        graph.bind(prefix, namespace, replace=True)
    return graph


def describe(dataset: Dataset, options: Mapping[str, Any]) -> Description:
    """The description that a profile gives of a dataset; refuses unknown ones and bases."""
    profile = str(options.get("rdf_profile") or next(iter(PROFILES)))
    if profile not in PROFILES:
        raise FormatError(
            f"There is no RDF profile {profile!r}.", hint=f"Profiles: {', '.join(PROFILES)}."
        )
    kind = PROFILES[profile]
    names = Names.of(
        dataset, base=options.get("base_iri"), plan=str(options.get("plan_name") or "")
    )
    return kind(dataset, names, bool(options.get("points", kind.points_unasked)))
