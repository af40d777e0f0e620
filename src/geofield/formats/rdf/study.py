"""Profile `study`: obstacles and trajectory points in the source study's own vocabulary.

The study's sample (METHOD.md, section 5) cannot be taken literally; the choices made:

- RDF/XML allows no node inside a node: each stands in an `rdfs:member` of a root description
  (``http://www.DLC.org/Obstacle#``).
- The samples give nodes no names. Here they have those of the GeoSPARQL profile: both merge.
- ``.../trajectory#`` of properties and ``.../Trajectory#`` of the root stay as the study has
  them: IRIs are compared letter by letter.
- Untyped numbers get the datatypes the study's table names: `xsd:int` for numbers,
  `xsd:double` for positions and pixels. `gml:pos` stays a text, "lat, long".
- The class *tree* and the root's members are what is driven around; an obstacle of another kind,
  or one that is merely possible or rejected, has geofield's class alone.
- What the study's vocabulary has no word for (status, safety margin, outlines, tracks) is
  said in geofield's, so that the plan reads back whole. Obstacles are complete in both: a
  reader of either vocabulary understands them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from geofield import schema
from geofield.formats.rdf.describe import Description
from geofield.formats.rdf.features import POINT_DECIMALS, column_terms, row_iris
from geofield.formats.rdf.layers import LayerMap, layer_map
from geofield.formats.rdf.names import Names
from geofield.formats.rdf.namespaces import PREFIXES, STUDY_PREFIXES, expand, node
from geofield.formats.rdf.triples import Column, Group, Nodes, Texts, terms

_TRAJECTORY = "http://www.DLC.org/Trajectory#"
_IMAGE = "http://purl.org/dc/dcmitype/Image"


class StudyDescription(Description):
    """A dataset described in the study's vocabulary."""

    __slots__ = ()
    prefixes: ClassVar = {**PREFIXES, **STUDY_PREFIXES}
    points_unasked = True

    def product(self, product: str) -> Iterator[Group]:
        """Obstacles and points as the study has them; all else stands with the field."""
        if product == "field":
            yield from super().product("field")
            yield from super().product("tracks")
        elif product == "obstacles":
            yield from super().product("obstacles")
        elif self.points:
            for chunk in self.dataset.point_chunks():
                points = study_points(chunk, self.names)
                yield _members(_TRAJECTORY, points[0].subjects)
                yield points

    def layer(self, layer: LayerMap) -> Iterator[Group]:
        """Obstacles in both vocabularies; points stand in a file of their own."""
        name = layer.layer.name
        if name == schema.OBSTACLES.name and self.dataset.has(name):
            frame = self.table(layer)
            iris, types = row_iris(layer, frame, self.names), self.types(layer, frame)
            avoided = [iri for iri, own in zip(iris, types, strict=True) if node(layer.cls) in own]
            yield _members("obstacle:", Texts(avoided))
        if name != schema.TRACK_POINTS.name:
            yield from super().layer(layer)

    def types(self, layer: LayerMap, frame: Any) -> list[tuple[Any, ...]]:
        """Trees that are driven around are the study's, too."""
        types = super().types(layer, frame)
        if layer.layer.name != schema.OBSTACLES.name:
            return types
        tree, obstacle = node(layer.study_cls), node(layer.cls)
        return [
            (tree, *own) if own[0] == obstacle and kind == "tree" else own
            for own, kind in zip(types, frame["kind"], strict=True)
        ]

    def columns(self, layer: LayerMap, frame: Any) -> list[Column]:
        """The study's words for an obstacle first; what they tell is not told twice."""
        columns = super().columns(layer, frame)
        if layer.layer.name != schema.OBSTACLES.name:
            return columns
        study = _study_columns(layer, frame)
        taken = {predicate for predicate, _ in study}
        image: Column = (node("dc:type"), node(_IMAGE))
        return [image, *study, *(each for each in columns if each[0] not in taken)]

    def detections(self, frame: Any) -> Iterator[Group]:
        """The study has none."""
        return iter(())


def study_points(frame: Any, names: Names) -> Group:
    """Track points in the study's vocabulary."""
    layer = layer_map(schema.TRACK_POINTS.name)
    rounded = frame.assign(
        **{name: frame[name].astype(float).round(POINT_DECIMALS) for name in ("lat", "lon")}
    )
    places = zip(rounded["lat"].tolist(), rounded["lon"].tolist(), strict=True)
    columns: list[Column] = [
        (node("rdf:type"), node(layer.study_cls)),
        *_study_columns(layer, rounded),
        (node("gml:pos"), Texts([f"{lat!r}, {lon!r}" for lat, lon in places], "xsd:string")),
        (node("gf:segmentNo"), Texts(map(str, frame["segment_no"].tolist()), "xsd:int")),
    ]
    return (Nodes(row_iris(layer, frame, names), columns),)


def _members(root: str, members: Texts) -> Group:
    """The study's root description holds its nodes."""
    return (Nodes(Texts([expand(root)]), [(node("rdfs:member"), [tuple(terms(members, 0))])]),)


def _study_columns(layer: LayerMap, frame: Any) -> list[Column]:
    result: list[Column] = []
    for name, predicate in layer.study.items():
        column = layer.layer.column(name)
        values: Any = column_terms(layer.layer.name, column, predicate, frame[name])
        kind = "xsd:int" if column.type == "int" else "xsd:double"
        result.append((node(predicate), Texts(values, kind)))
    return result
