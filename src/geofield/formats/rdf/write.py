"""Writers: a dataset to RDF/XML, Turtle, JSON-LD and N-Triples, as a stream."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from geofield.errors import FormatError
from geofield.formats.rdf.describe import Description
from geofield.formats.rdf.jsonld import JsonLd
from geofield.formats.rdf.namespaces import PREFIXES, STUDY_PREFIXES
from geofield.formats.rdf.nodes import Group
from geofield.formats.rdf.ntriples import NTriples
from geofield.formats.rdf.rdfxml import RdfXml
from geofield.formats.rdf.serialise import Serialiser
from geofield.formats.rdf.study import StudyDescription
from geofield.formats.rdf.turtle import Turtle
from geofield.model.dataset import Dataset

PROFILES = ("geosparql", "study")
#: The RDF/XML files of a plan.
PRODUCTS = ("field", "obstacles", "tracks")


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
        ``rdf_profile`` (``geosparql`` or ``study``), ``base_iri`` and ``plan_name`` (name of the
        track plan).

    Returns
    -------
    list of Path
        The files written.
    """
    description = _description(dataset, options)
    serialiser = RdfXml(description.base, _prefixes(options))
    paths = []
    for product in PRODUCTS:
        path = folder / product_name(stem, product)
        _write(path, serialiser, description.product(product))
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
    return _write_one(dataset, folder / f"{stem}.ttl", Turtle, options)


def write_jsonld(
    dataset: Dataset, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
) -> list[Path]:
    """JSON-LD in one file, its context inside; options as in :func:`write_rdfxml`."""
    return _write_one(dataset, folder / f"{stem}.jsonld", JsonLd, options)


def write_ntriples(
    dataset: Dataset, folder: Path, *, stem: str = "field", options: Mapping[str, Any]
) -> list[Path]:
    """N-Triples in one file; options as in :func:`write_rdfxml`."""
    return _write_one(dataset, folder / f"{stem}.nt", NTriples, options)


def product_name(stem: str, product: str) -> str:
    """The RDF/XML file of a product."""
    return f"{product}.rdf" if stem == "field" else f"{stem}_{product}.rdf"


def _write_one(
    dataset: Dataset, path: Path, syntax: type[Serialiser], options: Mapping[str, Any]
) -> list[Path]:
    description = _description(dataset, options)
    _write(path, syntax(description.base, _prefixes(options)), description.everything())
    return [path]


def _description(dataset: Dataset, options: Mapping[str, Any]) -> Description:
    kind = StudyDescription if _profile(options) == "study" else Description
    return kind.of(dataset, base=options.get("base_iri"), plan=str(options.get("plan_name") or ""))


def _profile(options: Mapping[str, Any]) -> str:
    profile = str(options.get("rdf_profile") or PROFILES[0])
    if profile not in PROFILES:
        raise FormatError(
            f"There is no RDF profile {profile!r}.", hint=f"Profiles: {', '.join(PROFILES)}."
        )
    return profile


def _prefixes(options: Mapping[str, Any]) -> dict[str, str]:
    return {**PREFIXES, **STUDY_PREFIXES} if _profile(options) == "study" else PREFIXES


def _write(path: Path, serialiser: Serialiser, groups: Iterable[Group]) -> None:
    with path.open("wb") as file:
        for piece in serialiser.stream(groups):
            file.write(piece)
