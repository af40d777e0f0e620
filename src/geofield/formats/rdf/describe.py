"""Describe: a dataset as groups of nodes, in the order of the files."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd
import pyoxigraph as ox
import shapely

from geofield import schema
from geofield.crs import authority_name
from geofield.errors import FormatError
from geofield.formats.rdf.features import (
    column_terms,
    feature_group,
    link_properties,
    point_group,
    row_iris,
)
from geofield.formats.rdf.graph import ontology
from geofield.formats.rdf.layers import CANDIDATE, LayerMap, layer_map, layer_maps
from geofield.formats.rdf.names import Names, is_iri
from geofield.formats.rdf.namespaces import PREFIXES, crs_iri, node
from geofield.formats.rdf.triples import Column, Group, Nodes, Texts, date_term, single
from geofield.model.dataset import Dataset
from geofield.model.obstacles import active, numbered

if TYPE_CHECKING:
    import geopandas as gpd

#: Metres by which `geo:sfWithin` may miss, for corners that are computed, not measured.
WITHIN_TOLERANCE_M = 0.001
#: The files of RDF/XML; also the order of the others.
PRODUCTS = ("field", "obstacles", "tracks")


@dataclass(frozen=True, slots=True)
class Description:
    """A dataset about to be described."""

    #: Of its files.
    prefixes: ClassVar[dict[str, str]] = PREFIXES
    #: Whether track points are told where nobody says.
    points_unasked: ClassVar[bool] = False

    dataset: Dataset
    names: Names
    #: Whether the track points are told: most of the bytes, and segments imply them.
    points: bool = False

    @property
    def accuracy_m(self) -> float | None:
        """Of everything taken from the picture: the ground that one pixel covers."""
        grid = self.dataset.grid
        return None if grid is None else round(grid.ground_resolution_m, 4)

    def everything(self) -> Iterator[Group]:
        """All there is, in order."""
        for product in PRODUCTS:
            yield from self.product(product)

    def product(self, product: str) -> Iterator[Group]:
        """What belongs into one of the files `field`, `obstacles`, `tracks`."""
        if product == "field":
            yield from self.origin()
            yield from self._field()
        elif product == "tracks":
            yield from self._plan()
        # Points last: thousands of nodes of one shape at the end are read by the pattern of one.
        for layer in sorted(layer_maps(), key=lambda each: each.layer == schema.TRACK_POINTS):
            if layer.product == product:
                yield from self.layer(layer)

    def layer(self, layer: LayerMap) -> Iterator[Group]:
        """A layer's features, and what only they have."""
        name = layer.layer.name
        if name == schema.TRACK_POINTS.name:
            for chunk in self.dataset.point_chunks() if self.points else ():
                yield point_group(chunk, self.names)
        elif self.dataset.has(name):
            frame = self.table(layer)
            columns = [*self.columns(layer, frame), *self.belonging(layer, frame)]
            types = self.types(layer, frame)
            yield feature_group(layer, frame, self.names, types, columns, self.accuracy_m)
            if name == schema.OBSTACLES.name:
                yield from self.detections(frame)

    def types(self, layer: LayerMap, frame: gpd.GeoDataFrame) -> list[Any]:
        """The classes of each row; obstacles that are not driven around are candidates."""
        own = tuple(map(node, (layer.cls, *layer.also, "geo:Feature")))
        if layer.layer.name != schema.OBSTACLES.name:
            return [own] * len(frame)
        avoided = set(active(frame)["obstacle_no"].tolist())
        other = (node(CANDIDATE), *own[1:])
        return [own if number in avoided else other for number in frame["obstacle_no"].tolist()]

    def columns(self, layer: LayerMap, frame: gpd.GeoDataFrame) -> list[Column]:
        """The columns of a layer, and its links to other rows, as properties."""
        told = [
            (node(name), column_terms(layer.layer.name, column, name, frame[column.name]))
            for column, name in layer.properties()
            if column.name in frame.columns
        ]
        return [*told, *link_properties(layer, frame, self.names)]

    def table(self, layer: LayerMap) -> gpd.GeoDataFrame:
        """A layer's table, a number in every row; a field's without what its own node tells."""
        table = self.dataset.table(layer.layer.name)
        if layer.layer.name != schema.FIELD.name:
            return keyed(layer, table)
        apart = ["heading_deg"] if self.dataset.has(schema.TRACKS.name) else []
        return table.drop(columns=[*apart, "field_id", "name"])

    def belonging(self, layer: LayerMap, frame: gpd.GeoDataFrame) -> list[Column]:
        """What the rows of a layer say beyond their columns: what they belong to."""
        name = layer.layer.name
        result: list[Column] = [
            (node(predicate), _thing(getattr(self.names, owner)))
            for predicate, owner in layer.belongs
        ]
        if name in (schema.OBSTACLES.name, schema.TRACKS.name):
            result.append(self._within(frame))
        if name == schema.ROUTE.name:
            steps = row_iris(layer, frame, self.names)
            result.append((node("gf:nextStep"), Texts([*steps[1:], None])))
        return result

    def _within(self, frame: gpd.GeoDataFrame) -> Column:
        fields = self.dataset.table(schema.FIELD.name)
        within = np.zeros(len(frame), bool)
        if len(fields):
            outline = shapely.buffer(fields.geometry.iloc[0], WITHIN_TOLERANCE_M)
            shapely.prepare(outline)
            within = shapely.within(frame.geometry.to_numpy(), outline)
        field = ox.NamedNode(self.names.field)
        return (node("geo:sfWithin"), [field if inside else None for inside in within])

    # -- nodes that are not rows -----------------------------------------------------------

    def _field(self) -> Iterator[Group]:
        """The field itself: what stays the same whoever surveys it."""
        table = self.dataset.table(schema.FIELD.name)
        if not len(table):
            return
        row, place = table.iloc[0], f"{self.names.survey}/geometry"
        identifier, name = (None if pd.isna(row[c]) else str(row[c]) for c in ("field_id", "name"))
        crs = crs_iri(self.dataset.crs)
        metric = [f"{place}/EPSG-{crs.rpartition('/')[2]}"] if crs else []
        yield single(
            self.names.field,
            "gf:Field s4agri:Parcel geo:Feature",
            dcterms_identifier=identifier,
            rdfs_label=name,
            prov_wasDerivedFrom=_thing(self.names.imagery),
            geo_hasDefaultGeometry=_thing(place),
            geo_hasGeometry=tuple(map(ox.NamedNode, (place, *metric))),
        )

    def _plan(self) -> Iterator[Group]:
        """The plan of tracks, where the dataset has any layer of one."""
        dataset, names = self.dataset, self.names
        if not any(dataset.has(each.layer.name) for each in layer_maps() if each.in_plan):
            return
        rows = dataset.table(schema.FIELD.name)
        has_heading = len(rows) and dataset.has(schema.TRACKS.name)
        heading = rows["heading_deg"].iloc[0] if has_heading else np.nan
        surveyed = len(rows) or dataset.has(schema.OBSTACLES.name)
        yield single(
            names.plan,
            "gf:TrackPlan prov:Entity",
            rdfs_label=f"Tracks of {dataset.name}",
            gf_inField=_thing(names.field),
            gf_basedOn=_thing(names.survey) if surveyed else None,
            gf_headingInDegrees=None if pd.isna(heading) else float(heading),
            gf_planner=dataset.provenance.software,
            prov_wasDerivedFrom=_thing(names.survey if surveyed else names.field),
            prov_wasGeneratedBy=_thing(names.run),
        )

    def detections(self, frame: gpd.GeoDataFrame) -> Iterator[Group]:
        """One observation for each obstacle that was not added by a person."""
        found = frame[frame["status"] != "added"]
        iris = row_iris(layer_map(schema.OBSTACLES.name), found, self.names)
        confidence = schema.OBSTACLES.column("confidence")
        columns: list[Column] = [
            (node("rdf:type"), [(node("gf:Detection"), node("sosa:Observation"))] * len(found)),
            (node("sosa:hasFeatureOfInterest"), iris),
            (node("sosa:observedProperty"), node("gf:obstaclePresence")),
            (
                node("sosa:hasSimpleResult"),
                column_terms("obstacles", confidence, "gf:confidence", found["confidence"]),
            ),
            (node("prov:wasDerivedFrom"), _thing(self.names.imagery)),
        ]
        yield (Nodes(Texts(f"{iri}/detection" for iri in iris), columns),)

    def origin(self) -> Iterator[Group]:
        """The dataset, the run, the software and the picture."""
        dataset, provenance, names = self.dataset, self.dataset.provenance, self.names
        source = provenance.source
        crs, imagery, software = crs_iri(dataset.crs), _thing(names.imagery), names.software
        licence = _thing(licence_iri(source.licence))
        yield single(
            names.dataset,
            "dcat:Dataset prov:Entity",
            dcterms_title=dataset.name,
            dcterms_subject=_thing(names.field),
            dcterms_license=licence,
            dc_rights=source.licence,
            cc_attributionName=source.attribution,
            gf_metricCrs=_thing(crs),
            gf_metricCrsWkt=None if crs else dataset.crs.to_wkt(),
            prov_wasGeneratedBy=_thing(names.run),
            prov_wasDerivedFrom=imagery,
        )
        yield single(
            names.run,
            "prov:Activity",
            prov_used=imagery,
            prov_wasAssociatedWith=_thing(software),
            gf_settings=_json(provenance.settings),
            gf_evidence=_json(provenance.evidence),
        )
        if software:
            yield single(software, "prov:SoftwareAgent", rdfs_label=provenance.software)
        if not names.imagery:
            return
        grid, facts = dataset.grid, {}
        if grid is not None:
            authority = authority_name(grid.crs)
            facts = {
                "gf_widthInPixels": int(grid.width_px),
                "gf_heightInPixels": int(grid.height_px),
                "gf_geoTransform": " ".join(repr(float(v)) for v in grid.transform[:6]),
                "gf_gridCrs": authority if ":" in authority else grid.crs.to_wkt(),
            }
        yield single(
            names.imagery,
            "prov:Entity",
            rdfs_label=source.name,
            dcterms_created=date_term(source.date) if source.date else None,
            dcterms_license=licence,
            dc_rights=source.licence,
            cc_attributionName=source.attribution,
            gf_mayDerive=source.may_derive,
            gf_mayCache=source.may_cache,
            gf_zoom=source.zoom,
            gf_details=_json(source.details) if source.details else None,
            gf_fileName=dataset.scene_path.name if dataset.scene_path else None,
            **facts,
        )


def _thing(iri: str | None) -> ox.NamedNode | None:
    return ox.NamedNode(iri) if iri else None


def keyed(layer: LayerMap, frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """A layer's table with a number in every row; refuses two rows of one key."""
    keys = list(layer.layer.key)
    last = keys[-1]
    if layer.layer.column(last).type == "int":
        frame = numbered(frame, last)
    twice = frame.duplicated(keys)
    if twice.any():
        row = frame[twice].iloc[0]
        named = ", ".join(f"{key} {row[key]}" for key in keys)
        raise FormatError(
            f"Layer {layer.layer.name!r} has two rows with {named}.",
            hint="Numbers name the features: give each row its own.",
        )
    return frame


def licence_iri(licence: str) -> str | None:
    """The document that a licence's name means; None where it is not known."""
    text = licence.strip()
    if text.startswith(("http://", "https://")) and is_iri(text):
        return text
    # The ontology tells their names, lower case, with hyphens for spaces.
    name = text.lower().replace(" ", "-")
    return next((iri for iri, known in ontology().pairs("skos:notation") if known == name), None)


def _json(value: Any) -> str:
    plain = dict(value) if hasattr(value, "items") else value
    return json.dumps(plain, ensure_ascii=False, sort_keys=True, separators=(",", ":"))
