"""Names: stable IRIs of a field and its parts under a base that the user sets.

::

    {base}field/{field_id}                     the field, whoever surveys it
    {field}/survey/{digest}                    its outline as one picture shows it
    {survey}/obstacle/3                        an obstacle in that survey
    {field}/plan/{digest or name}/track/7      a part of one plan of tracks
    {feature}/geometry                         its geometry in CRS84
    {feature}/geometry/EPSG-32636              its geometry in the metric CRS

What differs between two pictures, two spacings or two people's reviews has a digest of what it
holds in its name: files of one field merge without anything being said twice of one thing, and
the same work has the same names wherever it is done again.
"""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import pandas as pd
import pyoxigraph as ox
import shapely

from geofield import schema
from geofield.crs import LONLAT, transformer
from geofield.errors import FormatError
from geofield.formats.rdf.namespaces import DEFAULT_BASE
from geofield.model.dataset import Dataset
from geofield.model.place import position_words

if TYPE_CHECKING:
    import geopandas as gpd

#: What an IRI of this project's bases may hold: RFC 3986 characters, nothing to escape.
_BASE = re.compile(r"https?://[A-Za-z0-9._~:@\[\]-]+(?:/[A-Za-z0-9._~!$()*+,;=:@%-]*)*")
#: Characters that no RDF syntax allows inside an IRI.
NOT_IN_IRI = re.compile(r"[\x00-\x20<>\"{}|^`\\]")
#: Field ids that geofield makes: a place, as round as it is, and so the field's own everywhere.
_PLACE = re.compile(r"\d+(\.\d+)?[NS]\d+(\.\d+)?[EW]")
#: Layers that a plan of tracks is made of; points follow from segments and settings.
_PLANNED = ("tracks", "segments", "gaps", "headland", "headland_tracks", "route", "turns")


@dataclass(frozen=True, slots=True)
class Names:
    """The IRIs under which a dataset is described; `imagery` and `software` may be empty."""

    field: str
    survey: str
    plan: str
    run: str
    dataset: str
    imagery: str
    software: str

    @classmethod
    def of(cls, dataset: Dataset, *, base: str | None = None, plan: str = "") -> Names:
        """The names of a dataset under a base, the plan under its name or its digest."""
        base = check_base(base)
        provenance, grid = dataset.provenance, dataset.grid
        source = provenance.source
        picture: list[Any] = [asdict(source), None]
        if grid is not None:
            transform = list(map(float, grid.transform[:6]))
            picture[1] = [grid.width_px, grid.height_px, transform, grid.crs.to_wkt()]
        field = f"{base}field/{_field_part(dataset)}"
        table = dataset.table(schema.FIELD.name)
        if dataset.has(schema.TRACKS.name):
            # The heading is that of the tracks then, and told of the plan.
            table = table.drop(columns="heading_deg")
        survey = digest(picture, dataset.crs.to_wkt(), table, dataset.table(schema.OBSTACLES.name))
        planned = [dataset.table(name) for name in _PLANNED if dataset.has(name)]
        tracks = digest(survey, provenance.settings.get("tracks", {}), *planned)
        run = digest(provenance.software, provenance.settings, provenance.evidence, picture)
        known = grid is not None or source.name or source.licence
        owner = f"{base}imagery/{path_part(source.name)}" if source.name else f"{field}/imagery"
        words = provenance.software.split()
        return cls(
            field,
            f"{field}/survey/{survey}",
            f"{field}/plan/{path_part(plan) if plan else tracks}",
            f"{field}/run/{run}",
            f"{field}/dataset/{digest(survey, tracks, run, plan, dataset.name)}",
            f"{owner}/{digest(picture)}" if known else "",
            f"{base}software/{'/'.join(map(path_part, words))}" if words else "",
        )


def check_base(base: str | None) -> str:
    """A base as given by the user, ending in ``/``; an absolute IRI that names can follow."""
    if not base:
        return DEFAULT_BASE
    if not (_BASE.fullmatch(base) and is_iri(base)):
        raise FormatError(
            f"The base IRI {base!r} cannot name features.",
            hint="Use an absolute address without spaces, query or '#', for instance "
            "https://data.my-farm.example/.",
        )
    return base if base.endswith("/") else base + "/"


def is_iri(text: str) -> bool:
    """Whether a text can name a thing as it is."""
    try:
        ox.NamedNode(text)
    except ValueError:
        return False
    return True


def path_part(text: str) -> str:
    """Any text as one path segment of an IRI; what is not plain is percent-encoded."""
    encoded = quote(text, safe="")
    # "." and ".." would be resolved away by every reader.
    return encoded.replace(".", "%2E") if set(encoded) <= {"."} else encoded


def digest(*parts: Any) -> str:
    """Twelve characters that differ wherever tables or JSON values do."""
    whole = hashlib.sha256()
    for part in parts:
        if isinstance(part, pd.DataFrame):
            whole.update(_table_bytes(part))
        else:
            plain = dict(part) if hasattr(part, "items") else part
            whole.update(json.dumps(plain, sort_keys=True, default=str).encode())
        whole.update(b"\0")
    return whole.hexdigest()[:12]


def _table_bytes(table: gpd.GeoDataFrame) -> bytes:
    columns = {
        str(name): [None if pd.isna(value) else value for value in table[name].tolist()]
        for name in table.columns
        if name != table.geometry.name
    }
    text = json.dumps(columns, default=str).encode()
    return text + b"".join(shapely.to_wkb(table.geometry.to_numpy(), byte_order=1))


def _field_part(dataset: Dataset) -> str:
    """The field's own part of its name.

    Ids of other programs ("1") are theirs alone: they stand behind the field's place, to about
    100 m, so that two programs' first fields are two.
    """
    table = dataset.table(schema.FIELD.name)
    if not len(table) or pd.isna(table["field_id"].iloc[0]):
        return path_part(dataset.name or "field")
    identifier = str(table["field_id"].iloc[0])
    if _PLACE.fullmatch(identifier):
        return identifier
    point = shapely.point_on_surface(table.geometry.iloc[0])
    lon, lat = transformer(dataset.crs, LONLAT).transform(point.x, point.y)
    return f"{position_words(lat, lon, 3)}/{path_part(identifier or 'field')}"
