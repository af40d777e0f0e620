"""Writers: a dataset to RDF/XML, Turtle, JSON-LD and N-Triples, as a stream."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyoxigraph as ox

from geofield.errors import FormatError
from geofield.formats.rdf.describe import PRODUCTS, Description
from geofield.formats.rdf.jsonld import write_jsonld as write_json
from geofield.formats.rdf.names import Names
from geofield.formats.rdf.namespaces import PREFIXES, STRING, STUDY_PREFIXES
from geofield.formats.rdf.study import StudyDescription
from geofield.formats.rdf.triples import Group, triples
from geofield.model.dataset import Dataset

if TYPE_CHECKING:
    import rdflib

PROFILES = ("geosparql", "study")


def write_rdfxml(
    dataset: Dataset, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
) -> list[Path]:
    """RDF/XML in three files: ``field.rdf``, ``obstacles.rdf``, ``tracks.rdf``.

    Parameters
    ----------
    dataset : Dataset
    folder : Path
        There already.
    stem : str
        Other than ``field``, it stands before the names: ``north_obstacles.rdf``.
    options : mapping
        ``rdf_profile`` (``geosparql`` or ``study``), ``base_iri``, ``plan_name`` (name of the
        track plan) and ``points``: whether track points are written, which the study's profile
        does unless told not to and the other when asked.

    Returns
    -------
    list of Path
        The files written.
    """
    description = describe(dataset, options)
    paths = []
    for product in PRODUCTS:
        path = folder / product_name(stem, product)
        _write(path, ox.RdfFormat.RDF_XML, description.product(product), options)
        paths.append(path)
    return paths


def write_study(
    dataset: Dataset, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
) -> list[Path]:
    """RDF/XML in the study's vocabulary: :func:`write_rdfxml` with that profile."""
    return write_rdfxml(dataset, folder, stem=stem, options={**options, "rdf_profile": "study"})


def write_turtle(
    dataset: Dataset, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
) -> list[Path]:
    """Turtle in one file; options as in :func:`write_rdfxml`."""
    return _write_one(dataset, folder / f"{stem}.ttl", ox.RdfFormat.TURTLE, options)


def write_jsonld(
    dataset: Dataset, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
) -> list[Path]:
    """JSON-LD in one file, its context inside; options as in :func:`write_rdfxml`."""
    return _write_one(dataset, folder / f"{stem}.jsonld", ox.RdfFormat.JSON_LD, options)


def write_ntriples(
    dataset: Dataset, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
) -> list[Path]:
    """N-Triples in one file; options as in :func:`write_rdfxml`."""
    return _write_one(dataset, folder / f"{stem}.nt", ox.RdfFormat.N_TRIPLES, options)


def product_name(stem: str, product: str) -> str:
    """The RDF/XML file of a product."""
    return f"{product}.rdf" if stem == "field" else f"{stem}_{product}.rdf"


def to_graph(dataset: Dataset, options: Mapping[str, Any]) -> rdflib.Graph:
    """The dataset as an rdflib graph, prefixes bound; options as in :func:`write_rdfxml`."""
    import rdflib

    graph = rdflib.Graph()
    for prefix, namespace in _prefixes(options).items():
        graph.bind(prefix, namespace, replace=True)
    for each in triples(describe(dataset, options).everything()):
        graph.add(tuple(map(_in_rdflib, each)))
    return graph


def _in_rdflib(term: Any) -> Any:
    import rdflib

    if isinstance(term, ox.NamedNode):
        return rdflib.URIRef(term.value)
    # A plain text is untyped in rdflib.
    kind = None if term.datatype.value == STRING else rdflib.URIRef(term.datatype.value)
    return rdflib.Literal(term.value, datatype=kind)


def describe(dataset: Dataset, options: Mapping[str, Any]) -> Description:
    """The description that a profile gives of a dataset.

    Raises
    ------
    FormatError
        When there is no such profile, or the base cannot name features.
    """
    kind, points = (StudyDescription, True) if _is_study(options) else (Description, False)
    base, plan = options.get("base_iri"), str(options.get("plan_name") or "")
    names = Names.of(dataset, base=base, plan=plan)
    return kind(dataset, names, _yes(options.get("points", points)))


def _write_one(
    dataset: Dataset, path: Path, syntax: ox.RdfFormat, options: Mapping[str, Any]
) -> list[Path]:
    _write(path, syntax, describe(dataset, options).everything(), options)
    return [path]


def _is_study(options: Mapping[str, Any]) -> bool:
    profile = str(options.get("rdf_profile") or PROFILES[0])
    if profile not in PROFILES:
        raise FormatError(
            f"There is no RDF profile {profile!r}.", hint=f"Profiles: {', '.join(PROFILES)}."
        )
    return profile == "study"


def _yes(value: Any) -> bool:
    # --option points=no arrives as a text.
    return str(value).lower() not in ("no", "false", "0", "none", "")


def _prefixes(options: Mapping[str, Any]) -> dict[str, str]:
    return {**PREFIXES, **STUDY_PREFIXES} if _is_study(options) else PREFIXES


def _write(
    path: Path, syntax: ox.RdfFormat, groups: Iterable[Group], options: Mapping[str, Any]
) -> None:
    prefixes = _prefixes(options)
    if syntax == ox.RdfFormat.JSON_LD:
        with path.open("wb") as file:
            write_json(groups, file, prefixes)
    else:
        ox.serialize(triples(groups), path, syntax, prefixes=prefixes)
