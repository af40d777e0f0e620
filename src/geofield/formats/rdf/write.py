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
from geofield.formats.rdf.namespaces import PREFIXES, STRING, STUDY_PREFIXES
from geofield.formats.rdf.repeated import write_repeated
from geofield.formats.rdf.study import StudyDescription
from geofield.formats.rdf.triples import triples
from geofield.model.dataset import Dataset

if TYPE_CHECKING:
    import rdflib

Fields = Dataset | Sequence[Dataset]
#: By profile what describes a dataset, whether its points are told unless asked, and the prefixes.
_PROFILES: dict[str, tuple[type[Description], bool, dict[str, str]]] = {
    "geosparql": (Description, False, PREFIXES),
    "study": (StudyDescription, True, {**PREFIXES, **STUDY_PREFIXES}),
}
PROFILES = tuple(_PROFILES)


def write_rdfxml(
    fields: Fields, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
) -> list[Path]:
    """RDF/XML in three files: ``field.rdf``, ``obstacles.rdf``, ``tracks.rdf``.

    A stem other than ``field`` stands before the names: ``north_obstacles.rdf``.
    """
    before = "" if stem == "field" else f"{stem}_"
    told = {folder / f"{before}{product}.rdf": (product,) for product in PRODUCTS}
    return _written(fields, told, ox.RdfFormat.RDF_XML, options)


def write_study(
    fields: Fields, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
) -> list[Path]:
    """RDF/XML in the study's vocabulary: :func:`write_rdfxml` with that profile."""
    return write_rdfxml(fields, folder, stem=stem, options={**options, "rdf_profile": "study"})


def _one_file(suffix: str, syntax: ox.RdfFormat) -> Callable[..., list[Path]]:
    def write(
        fields: Fields, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
    ) -> list[Path]:
        return _written(fields, {folder / f"{stem}{suffix}": PRODUCTS}, syntax, options)

    return write


write_turtle = _one_file(".ttl", ox.RdfFormat.TURTLE)
#: The context stands inside the file.
write_jsonld = _one_file(".jsonld", ox.RdfFormat.JSON_LD)
write_ntriples = _one_file(".nt", ox.RdfFormat.N_TRIPLES)


def to_graph(dataset: Dataset, options: Mapping[str, Any]) -> rdflib.Graph:
    """The dataset as an rdflib graph, prefixes bound."""
    import rdflib

    def term(each: Any) -> Any:
        if isinstance(each, ox.NamedNode):
            return rdflib.URIRef(each.value)
        # A plain text is untyped in rdflib.
        kind = each.datatype.value
        return rdflib.Literal(each.value, datatype=None if kind == STRING else rdflib.URIRef(kind))

    graph = rdflib.Graph()
    for prefix, namespace in _profile(options)[2].items():
        graph.bind(prefix, namespace, replace=True)
    for each in triples(describe(dataset, options).everything()):
        graph.add((term(each.subject), term(each.predicate), term(each.object)))
    return graph


def describe(dataset: Dataset, options: Mapping[str, Any]) -> Description:
    """The description that a profile gives of a dataset; refuses unknown ones and bases."""
    kind, points, _ = _profile(options)
    names = Names.of(
        dataset, base=options.get("base_iri"), plan=str(options.get("plan_name") or "")
    )
    # --option points=no arrives as a text.
    wanted = str(options.get("points", points)).lower() not in ("no", "false", "0", "none", "")
    return kind(dataset, names, wanted)


def _written(
    fields: Fields,
    told: Mapping[Path, Sequence[str]],
    syntax: ox.RdfFormat,
    options: Mapping[str, Any],
) -> list[Path]:
    """Files, each with some products of all fields."""
    each_field = [fields] if isinstance(fields, Dataset) else fields
    described = [describe(each, options) for each in each_field]
    for path, products in told.items():
        groups = (group for each in described for name in products for group in each.product(name))
        with path.open("wb") as file:
            write_repeated(groups, file, syntax, _profile(options)[2])
    return list(told)


def _profile(options: Mapping[str, Any]) -> tuple[type[Description], bool, dict[str, str]]:
    profile = str(options.get("rdf_profile") or PROFILES[0])
    if profile not in PROFILES:
        raise FormatError(
            f"There is no RDF profile {profile!r}.", hint=f"Profiles: {', '.join(PROFILES)}."
        )
    return _PROFILES[profile]
