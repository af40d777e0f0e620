"""Describe: a dataset as groups of nodes, in the order of the files."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import shapely

from geofield import schema
from geofield.crs import authority_name
from geofield.errors import FormatError
from geofield.formats.rdf.features import Names, feature_group, row_iris
from geofield.formats.rdf.iris import NOT_IN_IRI, check_base, field_iri, path_part, plan_iri
from geofield.formats.rdf.layers import LayerMap, layer_map, layer_maps
from geofield.formats.rdf.namespaces import (
    CC,
    DATE,
    DC,
    DCAT,
    DCTERMS,
    GEO,
    GF,
    LABEL,
    PROV,
    SOSA,
    crs_iri,
)
from geofield.formats.rdf.nodes import (
    IRI,
    Group,
    Nodes,
    Property,
    constant,
    float_texts,
    joined,
    node,
    one,
    strings,
)
from geofield.model.dataset import Dataset

if TYPE_CHECKING:
    import geopandas as gpd

#: Licences by the words a source gives them, lower case, to the document they mean.
LICENCES = {
    "cc0": "https://creativecommons.org/publicdomain/zero/1.0/",
    "cc0 1.0": "https://creativecommons.org/publicdomain/zero/1.0/",
    "cc0-1.0": "https://creativecommons.org/publicdomain/zero/1.0/",
    "cc by 4.0": "https://creativecommons.org/licenses/by/4.0/",
    "cc-by-4.0": "https://creativecommons.org/licenses/by/4.0/",
    "cc by-sa 4.0": "https://creativecommons.org/licenses/by-sa/4.0/",
    "cc-by-sa-4.0": "https://creativecommons.org/licenses/by-sa/4.0/",
    "odbl 1.0": "https://opendatacommons.org/licenses/odbl/1-0/",
    "odbl-1.0": "https://opendatacommons.org/licenses/odbl/1-0/",
    "dl-de-zero-2.0": "https://www.govdata.de/dl-de/zero-2-0",
    "dl-de-by-2.0": "https://www.govdata.de/dl-de/by-2-0",
}
#: Metres by which `geo:sfWithin` may miss, for corners that are computed, not measured.
WITHIN_TOLERANCE_M = 0.001


@dataclass(frozen=True, slots=True)
class Description:
    """A dataset about to be described.

    Attributes
    ----------
    dataset : Dataset
    base : str
        Ends in ``/``.
    names : Names
    plan : str
        Name of the track plan, empty for the field's own.
    """

    dataset: Dataset
    base: str
    names: Names
    plan: str = ""

    @classmethod
    def of(cls, dataset: Dataset, *, base: str | None = None, plan: str = "") -> Description:
        """The description of a dataset under a base IRI.

        Raises
        ------
        FormatError
            When the base cannot name features.
        """
        checked = check_base(base)
        field_table = dataset.table("field")
        identifier = dataset.name
        if len(field_table) and not pd.isna(field_table["field_id"].iloc[0]):
            identifier = str(field_table["field_id"].iloc[0])
        field = field_iri(checked, identifier)
        return cls(dataset, checked, Names(field, plan_iri(field, plan)), plan)

    @property
    def accuracy_m(self) -> float | None:
        """Of everything taken from the picture: the ground that one pixel covers."""
        grid = self.dataset.grid
        return None if grid is None else round(grid.ground_resolution_m, 4)

    @property
    def imagery(self) -> str:
        """The IRI of the picture; empty where nothing is known of one."""
        provenance, grid = self.dataset.provenance, self.dataset.grid
        known = grid is not None or provenance.source.name or provenance.source.licence
        if not known:
            return ""
        name = provenance.source.name
        return f"{self.base}imagery/{path_part(name)}" if name else f"{self.names.field}/imagery"

    # -- products ------------------------------------------------------------------------

    def everything(self) -> Iterator[Group]:
        """All there is, in order."""
        for product in ("field", "obstacles", "tracks"):
            yield from self.product(product)

    def product(self, product: str) -> Iterator[Group]:
        """What belongs into one of the files `field`, `obstacles`, `tracks`."""
        if product == "field":
            yield from self.origin()
        for layer in layer_maps():
            if layer.product == product:
                yield from self.layer(layer)

    def layer(self, layer: LayerMap) -> Iterator[Group]:
        """A layer's features, and what only they have."""
        name = layer.layer.name
        if name == schema.TRACK_POINTS.name:
            for chunk in self.dataset.point_chunks():
                yield feature_group(layer, chunk, self.names)
            return
        if not self.dataset.has(name):
            return
        frame = keyed(layer, self.dataset.table(name))
        if name == self._first_in_plan():
            yield self._plan_node()
        extra = self._extra(name, frame)
        group = feature_group(layer, frame, self.names, extra=extra, accuracy_m=self.accuracy_m)
        yield group
        if name == schema.OBSTACLES.name:
            yield from self._detections(layer, frame)

    def _first_in_plan(self) -> str:
        """The first layer that belongs to the plan and has rows; points stand elsewhere."""
        names = [each.layer.name for each in layer_maps() if each.in_plan and each.metric_geometry]
        return next((name for name in names if self.dataset.has(name)), "")

    def _extra(self, name: str, frame: gpd.GeoDataFrame) -> list[Property]:
        count = len(frame)
        result: list[Property] = []
        if name in (schema.OBSTACLES.name, schema.TRACKS.name):
            result.append(Property(GF + "inField", IRI, (constant(self.names.field, count),)))
            result += self._within(frame)
        if name == schema.TRACKS.name:
            result.append(
                Property(PROV + "wasDerivedFrom", IRI, (constant(self.names.field, count),))
            )
        layer = layer_map(name)
        if layer.in_plan and layer.says_plan:
            result.append(Property(GF + "inPlan", IRI, (constant(self._plan_iri(), count),)))
        if name == schema.ROUTE.name:
            steps = row_iris(layer, frame, self.names).to_pylist()
            following = strings([*steps[1:], None])
            result.append(Property(GF + "nextStep", IRI, (following,)))
        source = self.imagery if name in ("field", "obstacles") else ""
        if source:
            result.append(Property(PROV + "wasDerivedFrom", IRI, (constant(source, count),)))
        return result

    def _within(self, frame: gpd.GeoDataFrame) -> list[Property]:
        fields = self.dataset.table("field")
        if not len(fields):
            return []
        outline = shapely.buffer(fields.geometry.iloc[0], WITHIN_TOLERANCE_M)
        shapely.prepare(outline)
        within = shapely.within(frame.geometry.to_numpy(), outline)
        if not within.any():
            return []
        import pyarrow as pa

        texts = pa.array([self.names.field if inside else None for inside in within], pa.string())
        return [Property(GEO + "sfWithin", IRI, (texts,))]

    # -- nodes that are not rows -----------------------------------------------------------

    def _plan_iri(self) -> str:
        return self.names.plan if self.plan else f"{self.names.field}/plan"

    def _plan_node(self) -> Group:
        software = self.dataset.provenance.software
        return node(
            self._plan_iri(),
            (GF + "TrackPlan", PROV + "Entity"),
            one(LABEL, f"Tracks of {self.dataset.name}"),
            one(GF + "inField", self.names.field, datatype=IRI),
            one(GF + "planner", software),
            one(PROV + "wasDerivedFrom", self.names.field, datatype=IRI),
            one(PROV + "wasGeneratedBy", self._activity, datatype=IRI),
        )

    @property
    def _activity(self) -> str:
        return f"{self.names.plan}/run"

    def _detections(self, layer: LayerMap, frame: gpd.GeoDataFrame) -> Iterator[Group]:
        """One observation for each obstacle that was not added by a person."""
        found = frame[frame["status"] != "added"]
        if not len(found):
            return
        iris = row_iris(layer, found, self.names)
        observed = joined(iris, "/detection")
        confidence = float_texts(found["confidence"].to_numpy(dtype="float64", na_value=np.nan))
        properties = [
            Property(SOSA + "hasFeatureOfInterest", IRI, (iris,)),
            Property(
                SOSA + "observedProperty", IRI, (constant(GF + "obstaclePresence", len(found)),)
            ),
        ]
        if confidence.null_count < len(confidence):
            properties.append(
                Property(
                    SOSA + "hasSimpleResult",
                    "http://www.w3.org/2001/XMLSchema#double",
                    (confidence,),
                )
            )
        if self.imagery:
            properties.append(
                Property(PROV + "wasDerivedFrom", IRI, (constant(self.imagery, len(found)),))
            )
        yield (Nodes(observed, (GF + "Detection", SOSA + "Observation"), tuple(properties)),)

    def origin(self) -> Iterator[Group]:
        """The dataset, the run, the software and the picture."""
        dataset, provenance = self.dataset, self.dataset.provenance
        source, imagery = provenance.source, self.imagery
        crs = crs_iri(dataset.crs)
        software = self._software()
        yield node(
            f"{self.names.field}/dataset",
            (DCAT + "Dataset", PROV + "Entity"),
            one(DCTERMS + "title", dataset.name),
            one(DCTERMS + "subject", self.names.field, datatype=IRI),
            one(DCTERMS + "license", licence_iri(source.licence), datatype=IRI),
            one(DC + "rights", source.licence),
            one(CC + "attributionName", source.attribution),
            one(GF + "metricCrs", crs, datatype=IRI),
            one(GF + "metricCrsWkt", None if crs else dataset.crs.to_wkt()),
            one(PROV + "wasGeneratedBy", self._activity, datatype=IRI),
            one(PROV + "wasDerivedFrom", imagery, datatype=IRI),
        )
        yield node(
            self._activity,
            (PROV + "Activity",),
            one(PROV + "used", imagery, datatype=IRI),
            one(PROV + "wasAssociatedWith", software, datatype=IRI),
            one(GF + "settings", _json(provenance.settings)),
            one(GF + "evidence", _json(provenance.evidence)),
        )
        if software:
            yield node(software, (PROV + "SoftwareAgent",), one(LABEL, provenance.software))
        if imagery:
            yield self._imagery_node()

    def _software(self) -> str:
        name = self.dataset.provenance.software
        return f"{self.base}software/{'/'.join(map(path_part, name.split()))}" if name else ""

    def _imagery_node(self) -> Group:
        dataset, source, grid = self.dataset, self.dataset.provenance.source, self.dataset.grid
        properties = [
            one(LABEL, source.name),
            one(DCTERMS + "created", source.date, datatype=DATE if is_date(source.date) else None),
            one(DCTERMS + "license", licence_iri(source.licence), datatype=IRI),
            one(DC + "rights", source.licence),
            one(CC + "attributionName", source.attribution),
            one(GF + "mayDerive", source.may_derive),
            one(GF + "mayCache", source.may_cache),
            one(GF + "zoom", source.zoom),
            one(GF + "details", _json(source.details) if source.details else None),
            one(GF + "fileName", dataset.scene_path.name if dataset.scene_path else None),
        ]
        if grid is not None:
            authority = authority_name(grid.crs)
            properties += [
                one(GF + "widthInPixels", grid.width_px),
                one(GF + "heightInPixels", grid.height_px),
                one(GF + "geoTransform", " ".join(repr(float(v)) for v in grid.transform[:6])),
                one(GF + "gridCrs", authority if ":" in authority else grid.crs.to_wkt()),
            ]
        return node(self.imagery, (PROV + "Entity",), *properties)


def keyed(layer: LayerMap, frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """A layer's table with a number in every row, unique as its IRIs must be.

    Raises
    ------
    FormatError
        When two rows have the same key.
    """
    keys = list(layer.layer.key)
    last = keys[-1]
    if layer.layer.column(last).type == "int" and frame[last].isna().any():
        frame = frame.copy()
        start = int(frame[last].max()) + 1 if frame[last].notna().any() else 1
        missing = frame[last].isna()
        frame.loc[missing, last] = np.arange(start, start + int(missing.sum()))
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
    if text.startswith(("http://", "https://")) and not NOT_IN_IRI.search(text):
        return text
    return LICENCES.get(text.lower())


def is_date(text: str | None) -> bool:
    """Whether a text is a whole ISO 8601 day."""
    try:
        return text is not None and len(text) == 10 and np.datetime64(text, "D") is not None
    except ValueError:
        return False


def _json(value: Any) -> str:
    plain = dict(value) if hasattr(value, "items") else value
    return json.dumps(plain, ensure_ascii=False, sort_keys=True, separators=(",", ":"))


__all__ = ["Description", "keyed", "layer_map", "licence_iri"]
