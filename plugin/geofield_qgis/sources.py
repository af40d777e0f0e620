"""Layers of the project as what the command reads: files, and addresses with their terms."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, unquote

from qgis.core import (
    QgsDataSourceUri,
    QgsFeatureRequest,
    QgsField,
    QgsFields,
    QgsMapLayer,
    QgsProcessingFeatureSource,
    QgsProviderRegistry,
    QgsRasterLayer,
    QgsVectorFileWriter,
    QgsVectorLayer,
    QgsWkbTypes,
)

from . import compat
from .engine import EngineError
from .words import tr

#: Name under which the address of a layer is told to the command.
LAYER_SOURCE = "qgis_layer"


def imagery(layer: QgsRasterLayer) -> tuple[str, dict[str, str]]:
    """What names the picture on the command line, and the variables that go with it.

    A WMS, WMTS or XYZ layer is told by its address with what the layer says of its rights; what
    its terms allow is not known, so deriving needs the person's own word.
    """
    if layer.providerType() != "wms":
        source = layer.source().split("|", 1)[0]
        decoded = QgsProviderRegistry.instance().decodeUri(layer.providerType(), source)
        # A picture in an archive is told in three parts.
        parts = [str(decoded.get(name) or "") for name in ("vsiPrefix", "path", "vsiSuffix")]
        return "".join(parts) or source, {}
    uri = QgsDataSourceUri()
    uri.setEncodedUri(layer.source())
    given = parse_qs(layer.source())
    kind = "xyz" if uri.param("type") == "xyz" else "wms"
    if uri.param("tileMatrixSet"):
        kind = "wmts"
    source = {
        "url": unquote(uri.param("url")),
        "kind": kind,
        "attribution": layer.attribution() or "; ".join(layer.metadata().rights()),
        "licence": "; ".join(layer.metadata().licenses()),
        "layer": uri.param("layers"),
    }
    for name in ("zmin", "zmax"):
        if given.get(name):
            source["min_zoom" if name == "zmin" else "max_zoom"] = int(given[name][0])
    sources = json.dumps({LAYER_SOURCE: source})
    return LAYER_SOURCE, {"GEOFIELD_FETCH__SOURCES": sources}


def refuse_unsaved(layer: QgsMapLayer | None) -> None:
    """Refuse a layer whose edits lie in no file yet: the command would not see them."""
    if isinstance(layer, QgsVectorLayer) and layer.isEditable() and layer.isModified():
        raise EngineError(
            tr("The layer {0} has edits that are not saved: save them first.").format(layer.name())
        )


def plan_file(layer: QgsMapLayer | None) -> str | None:
    """The plan whose outlines a layer has; None for any other layer."""
    if not isinstance(layer, QgsVectorLayer) or layer.providerType() != "ogr":
        return None
    path = str(QgsProviderRegistry.instance().decodeUri("ogr", layer.source()).get("path") or "")
    if not path.lower().endswith(".gpkg") or table_of(layer) != "field":
        return None
    return path if is_plan(path) and layer.fields().indexOf("field_id") >= 0 else None


def is_plan(path: str) -> bool:
    """Whether a file has an outline and obstacles."""
    details = QgsProviderRegistry.instance().querySublayers(path)
    return {"field", "obstacles"} <= {each.name() for each in details}


def table_of(layer: QgsVectorLayer) -> str:
    """The table of its file that a layer shows, also where its source has no name or a number."""
    registry = QgsProviderRegistry.instance()
    decoded = registry.decodeUri("ogr", layer.source())
    if decoded.get("layerName"):
        return str(decoded["layerName"])
    number = int(decoded.get("layerId") or 0)
    tables = registry.querySublayers(str(decoded.get("path") or ""))
    return next((each.name() for each in tables if each.layerNumber() == number), "")


def is_whole(source: QgsProcessingFeatureSource, layer: QgsVectorLayer) -> bool:
    """Whether a source gives all rows of the layer: none filtered, none left unselected."""
    return not layer.subsetString() and source.featureCount() == layer.featureCount()


def written(
    source: QgsProcessingFeatureSource, folder: str | Path, name: str, context: Any, feedback: Any
) -> str:
    """The features of a source as a file: what is filtered, selected or in memory only."""
    path = Path(folder) / f"{name}.gpkg"
    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName, options.layerName = "GPKG", name
    fields, kept = _columns(source.fields())
    writer = QgsVectorFileWriter.create(
        str(path),
        fields,
        QgsWkbTypes.linearType(QgsWkbTypes.multiType(source.wkbType())),
        source.sourceCrs(),
        context.transformContext(),
        options,
    )
    count = 0
    for feature in _features(source, context):
        if feedback.isCanceled():
            break
        values = feature.attributes()
        geometry = feature.geometry()
        geometry.convertToStraightSegment()  # the engine knows no arcs
        geometry.convertToMultiType()
        feature.setFields(fields, True)
        feature.setAttributes([values[each] for each in kept])
        feature.setGeometry(geometry)
        if not writer.addFeature(feature):
            raise EngineError(writer.errorMessage())
        count += 1
    del writer  # closes the file
    if not count:
        raise EngineError(tr("{0} has no features to work on.").format(source.sourceName()))
    return str(path)


def _columns(fields: QgsFields) -> tuple[QgsFields, list[int]]:
    """The columns that a GeoPackage takes, and the place of each among those of the source.

    The file numbers its rows itself (two sources joined may have the same number), its names of
    number and shape are taken, and no two names may differ in their case only.
    """
    made, kept, taken = QgsFields(), [], {"fid", "geom"}
    for place, theirs in enumerate(fields):
        field, name, number = QgsField(theirs), theirs.name(), 1
        if name.lower() in ("fid", "geom"):
            continue
        while field.name().lower() in taken:
            number += 1
            field.setName(f"{name}_{number}")
        taken.add(field.name().lower())
        made.append(field)
        kept.append(place)
    return made, kept


def _features(source: QgsProcessingFeatureSource, context: Any) -> Any:
    """All features; the engine itself tells or mends what is not valid.

    QGIS stops at an invalid shape with an exception that passes through Python's own loop and can
    end QGIS as a whole; leaving such shapes out, where a person chose that, is safe.
    """
    if context.invalidGeometryCheck() == compat.STOP_AT_INVALID:
        return source.getFeatures(QgsFeatureRequest(), compat.UNCHECKED)
    return source.getFeatures(QgsFeatureRequest())
