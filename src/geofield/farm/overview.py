"""The overview of a farm for QGIS: all fields in one GeoPackage, with a styled project.

Outlines are coloured by doubt, places without a plan are red points, tracks and obstacles appear
when one looks closer.
"""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd

from geofield import __version__, schema
from geofield.crs import LONLAT
from geofield.farm.as_left import DETAILS, DIGESTS, OWN, TRACKS
from geofield.farm.as_written import digests_of
from geofield.farm.edited_tracks import EDITED, track_digests
from geofield.farm.edits import remember_own
from geofield.farm.folder import OVERVIEW, PROJECT
from geofield.farm.layers import FIELD_ID
from geofield.farm.value import Farm
from geofield.formats.gpkg import write as write_gpkg
from geofield.formats.gpkg_guests import bring_guests, keep_project
from geofield.formats.many import Joined
from geofield.model import ImagerySource, Provenance
from geofield.staging import staged_folder

#: Fields up to which the overview holds obstacles and tracks; beyond, outlines and places.
MOST_FIELDS = 20_000

#: Those that a person works on; the others follow from them.
_DETAILS = tuple(
    each
    for each in schema.LAYERS
    if not each.working and each not in (schema.FIELD, schema.TRACK_POINTS)
)


def write_overview(farm: Farm, folder: Path, *, name: str = "Farm") -> list[Path]:
    """Write ``farm.gpkg`` and ``farm.qgz``; `name` is the title of the project.

    What a person keeps beside the farm in those that are there comes along.
    """
    with staged_folder(folder, overwrite=True) as staging:
        dataset = dataset_of(farm, name)
        written = write_gpkg(dataset, staging, stem=Path(OVERVIEW).stem, options={})
        remember_own(staging / OVERVIEW, dataset.tables)
        if (folder / OVERVIEW).is_file():
            bring_guests(folder / OVERVIEW, staging / OVERVIEW)
        keep_project(folder / PROJECT, staging / PROJECT)
    return [folder / path.name for path in written]


def dataset_of(farm: Farm, name: str) -> Joined:
    """All fields as one dataset, with the places as a layer beside those of the schema."""
    fields = farm.layer(schema.FIELD.name)
    crs = LONLAT if fields.crs is None else fields.crs
    # Whatever makes a field doubtful colours it, and stands in its row.
    doubts = farm.status.set_index(FIELD_ID)["doubts"].replace("", None)
    fields["doubts"] = fields[FIELD_ID].map(doubts).to_numpy(dtype=object)
    tables: dict[str, gpd.GeoDataFrame] = {schema.FIELD.name: fields}
    for layer in _DETAILS if len(farm) <= MOST_FIELDS else ():
        table = farm.layer(layer.name)
        if len(table) or not layer.optional:
            tables[layer.name] = table.to_crs(crs)
    places = farm.status.to_crs(crs)
    # Rows that say nothing of where they are can be shown nowhere: they are in failed.csv.
    places = places[~places.geometry.is_empty]
    reviewed = places["reviewed"].map({True: "yes", False: "no"})
    told = places.assign(reviewed=reviewed).replace("", None)
    tables[schema.PLACES.name] = schema.conform(schema.PLACES, told)
    details = schema.OBSTACLES.name in tables
    obstacles = tables[schema.OBSTACLES.name] if details else schema.empty(schema.OBSTACLES, crs)
    evidence = {
        DIGESTS: digests_of(fields, obstacles.assign(**({} if details else {FIELD_ID: []}))),
        DETAILS: details,
        OWN: {"columns": {}, "digests": {}},
    }
    if details:
        evidence[TRACKS] = track_digests({of: tables[of.name] for of in EDITED})
    origin = Provenance(f"geofield {__version__}", _source(fields), {}, evidence)
    return Joined(tables, crs, name, origin, further=(schema.PLACES,), of_farm=True)


def _source(fields: gpd.GeoDataFrame) -> ImagerySource:
    """What all fields say of their imagery, as one."""

    def told(column: str) -> str:
        return ", ".join(sorted({str(each) for each in fields[column].dropna() if str(each)}))

    days = sorted({str(day)[:10] for day in fields["imagery_date"].dropna()})
    return ImagerySource(told("imagery"), days[-1] if days else None, "", told("licence"))
