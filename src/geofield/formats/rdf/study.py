"""Profile `study`: obstacles and trajectory points in the source study's own vocabulary.

The study's sample (METHOD.md, section 5) cannot be taken literally; the choices made:

- A root description (``http://www.DLC.org/Obstacle#``) holds the typed nodes. RDF/XML does
  not allow a node inside a node, so each stands in an `rdfs:member` of the root.
- The samples give nodes no names. Here they have the same IRIs as in the GeoSPARQL profile,
  so that both may be merged and name the same obstacle.
- The study writes the trajectory's properties in ``.../trajectory#`` but its root as
  ``.../Trajectory#``. Both are kept as they are: IRIs are compared letter by letter.
- Untyped numbers get the datatypes the study's table names: `xsd:int` for numbers,
  `xsd:double` for positions and pixels. `gml:pos` stays a text, "lat, long".
- The class *tree* is for trees; an obstacle of another kind has geofield's class alone.
- What the study's vocabulary has no word for (status, safety margin, outlines, tracks) is
  said in geofield's, so that the plan reads back whole. Obstacles are complete in both: a
  reader of either vocabulary understands them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from geofield import schema
from geofield.formats.rdf.describe import Description, keyed
from geofield.formats.rdf.features import feature_group, row_iris
from geofield.formats.rdf.layers import layer_map, layer_maps
from geofield.formats.rdf.namespaces import (
    DC,
    DCMI_IMAGE,
    DOUBLE,
    GEO,
    GF,
    GML,
    INT,
    SOSA,
    STRING,
    STUDY_OBSTACLE,
    STUDY_POINT,
    STUDY_TRAJECTORY,
    STUDY_TREE,
    SVG_CIRCLE,
    WGS,
    expand,
)
from geofield.formats.rdf.nodes import (
    IRI,
    Group,
    Nodes,
    Property,
    constant,
    float_texts,
    joined,
)

if TYPE_CHECKING:
    import geopandas as gpd

#: The study's property and datatype for columns of its two tables.
STUDY_OBSTACLE_TERMS: dict[str, tuple[str, str]] = {
    "obstacle_no": (STUDY_OBSTACLE + "no", INT),
    "lat": (WGS + "lat", DOUBLE),
    "lon": (WGS + "long", DOUBLE),
    "x_px": (SVG_CIRCLE + "cx", DOUBLE),
    "y_px": (SVG_CIRCLE + "cy", DOUBLE),
    "radius_px": (SVG_CIRCLE + "r", DOUBLE),
}
STUDY_POINT_TERMS: dict[str, tuple[str, str]] = {
    "point_no": (STUDY_POINT + "no", INT),
    "track_no": (STUDY_POINT + "track", INT),
    "lat": (GML + "lat", DOUBLE),
    "lon": (GML + "long", DOUBLE),
    "x_px": (SVG_CIRCLE + "cx", DOUBLE),
    "y_px": (SVG_CIRCLE + "cy", DOUBLE),
}


class StudyDescription(Description):
    """A dataset described in the study's vocabulary."""

    __slots__ = ()

    def product(self, product: str) -> Iterator[Group]:
        """Obstacles and points as the study has them; all else stands with the field."""
        if product == "obstacles":
            yield from self._study_obstacles()
        elif product == "tracks":
            yield from self._study_points()
        else:
            yield from self.origin()
            for layer in layer_maps():
                if layer.layer.name not in (schema.OBSTACLES.name, schema.TRACK_POINTS.name):
                    yield from self.layer(layer)

    def _study_obstacles(self) -> Iterator[Group]:
        if not self.dataset.has(schema.OBSTACLES.name):
            return
        layer = layer_map(schema.OBSTACLES.name)
        frame = keyed(layer, self.dataset.table(schema.OBSTACLES.name))
        own = (expand(layer.cls), SOSA + "FeatureOfInterest", GEO + "Feature")
        trees = (frame["kind"] == "tree").to_numpy()
        for rows, types in (
            (trees, (STUDY_TREE + "tree", *own)),
            (~trees, own),
        ):
            part = frame[rows]
            if len(part):
                yield from self._obstacle_groups(part, types)

    def _obstacle_groups(self, frame: gpd.GeoDataFrame, types: tuple[str, ...]) -> Iterator[Group]:
        layer = layer_map(schema.OBSTACLES.name)
        inside = Property(GF + "inField", IRI, (constant(self.names.field, len(frame)),))
        whole = feature_group(layer, frame, self.names, extra=[inside], accuracy_m=self.accuracy_m)
        study = {predicate for predicate, _ in STUDY_OBSTACLE_TERMS.values()}
        own = [prop for prop in whole[0].properties if prop.predicate not in study]
        image = Property(DC + "type", IRI, (constant(DCMI_IMAGE, len(frame)),))
        numbers = _study_properties(frame, STUDY_OBSTACLE_TERMS)
        yield (Nodes(whole[0].iris, types, (image, *numbers, *own), STUDY_OBSTACLE),)
        # Geometries are not members of the root.
        yield whole[1:]

    def _study_points(self) -> Iterator[Group]:
        layer = layer_map(schema.TRACK_POINTS.name)
        for chunk in self.dataset.point_chunks():
            lat, lon = _texts(chunk, "lat"), _texts(chunk, "lon")
            properties = [
                *_study_properties(chunk, STUDY_POINT_TERMS),
                Property(GML + "pos", STRING, (joined(lat, ", ", lon),)),
                Property(GF + "segmentNo", INT, (_texts(chunk, "segment_no"),)),
                Property(GF + "easting", DOUBLE, (float_texts(chunk.geometry.x.to_numpy()),)),
                Property(GF + "northing", DOUBLE, (float_texts(chunk.geometry.y.to_numpy()),)),
            ]
            iris = row_iris(layer, chunk, self.names)
            yield (Nodes(iris, (GML + "point",), tuple(properties), STUDY_TRAJECTORY),)


def _study_properties(frame: gpd.GeoDataFrame, terms: dict[str, tuple[str, str]]) -> list[Property]:
    result = []
    for column, (predicate, datatype) in terms.items():
        texts = _texts(frame, column)
        if texts.null_count < len(texts):
            result.append(Property(predicate, datatype, (texts,)))
    return result


def _texts(frame: gpd.GeoDataFrame, column: str) -> Any:
    series = frame[column]
    if series.dtype == np.float64:
        return float_texts(series.to_numpy())
    return pc.cast(pa.array(series.astype("Int64"), pa.int64(), from_pandas=True), pa.string())
