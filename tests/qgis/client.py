"""What the tests ask of a real QGIS; run by Debian's Python, prints one JSON value.

    /usr/bin/python3 client.py '{"do": "project", "uri": "..."}'

One QgsApplication per process, and nothing from the project's own environment: the numpy of
the wheels and that of QGIS do not fit together.
"""

import json
import sys

from qgis.core import (
    Qgis,
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsExpression,
    QgsExpressionContext,
    QgsFeature,
    QgsGeometry,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsProject,
    QgsRasterLayer,
    QgsRectangle,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QSize
from qgis.PyQt.QtGui import QColor


def tip_shown(layer):
    """The HTML of the first row's map tip."""
    context = QgsExpressionContext()
    for feature in layer.getFeatures():
        context.setFeature(feature)
        context.setFields(layer.fields())
        return QgsExpression.replaceExpressionText(layer.mapTipTemplate(), context)
    return ""


def layer_facts(layer):
    facts = {
        "name": layer.name(),
        "id": layer.id(),
        "valid": layer.isValid(),
        "crs": layer.crs().authid(),
        "error": "" if layer.error().isEmpty() else layer.error().summary(),
    }
    if isinstance(layer, QgsVectorLayer):
        renderer = layer.renderer()
        facts |= {
            "rows": layer.featureCount(),
            "fields": [field.name() for field in layer.fields()],
            "aliases": layer.attributeAliases() and dict(layer.attributeAliases()),
            "renderer": renderer.type() if renderer else None,
            "rules": [item.label() for item in renderer.legendSymbolItems()] if renderer else [],
            "labels": layer.labelsEnabled() and layer.labeling() is not None,
            "tip": layer.mapTipTemplate(),
            "tip_shown": tip_shown(layer),
            "actions": [action.name() for action in layer.actions().actions()],
            "scales": [layer.hasScaleBasedVisibility(), layer.minimumScale()],
            "widgets": {
                field.name(): layer.editorWidgetSetup(index).type()
                for index, field in enumerate(layer.fields())
            },
            "read_only": layer.readOnly(),
            "editable": [
                field.name()
                for index, field in enumerate(layer.fields())
                if not layer.editFormConfig().readOnly(index)
            ],
            "encoding": layer.dataProvider().encoding(),
        }
        if "status" in facts["fields"]:
            index = layer.fields().indexOf("status")
            facts["status_values"] = layer.editorWidgetSetup(index).config()
            facts["status_default"] = layer.defaultValueDefinition(index).expression()
    elif isinstance(layer, QgsRasterLayer):
        facts |= {"size": [layer.width(), layer.height()], "renderer": layer.renderer().type()}
    return facts


def project(uri):
    found = QgsProject.instance()
    if not found.read(uri):
        return {"error": found.error()}
    root = found.layerTreeRoot()
    return {
        "title": found.title(),
        "crs": found.crs().authid(),
        "bad": [layer.name() for layer in found.mapLayers().values() if not layer.isValid()],
        "order": [layer.id() for layer in root.layerOrder()],
        "shown": [node.layerId() for node in root.findLayers() if node.isVisible()],
        "layers": {layer.id(): layer_facts(layer) for layer in found.mapLayers().values()},
    }


def vector(uri):
    layer = QgsVectorLayer(uri, "layer", "ogr")
    facts = layer_facts(layer)
    if layer.isValid():
        extent = layer.extent()
        facts["extent"] = [
            extent.xMinimum(),
            extent.yMinimum(),
            extent.xMaximum(),
            extent.yMaximum(),
        ]
        facts["wkb"] = int(layer.wkbType())
    return facts


def raster(uri):
    return layer_facts(QgsRasterLayer(uri, "layer", "gdal"))


def render(uri, png, width=900, height=700, scale=None, extent=None):
    found = QgsProject.instance()
    if not found.read(uri):
        return {"error": found.error()}
    layers = [node.layer() for node in found.layerTreeRoot().findLayers() if node.isVisible()]
    settings = QgsMapSettings()
    settings.setLayers(layers)
    settings.setDestinationCrs(found.crs())
    settings.setBackgroundColor(QColor(245, 245, 240))
    settings.setOutputSize(QSize(width, height))
    settings.setOutputDpi(96)
    view = found.viewSettings().defaultViewExtent() if extent is None else QgsRectangle(*extent)
    settings.setExtent(view)
    if scale is not None:
        view = QgsRectangle(settings.visibleExtent())
        view.scale(scale / settings.scale())
        settings.setExtent(view)
    settings.setFlag(QgsMapSettings.DrawLabeling, True)
    settings.setFlag(QgsMapSettings.Antialiasing, True)
    job = QgsMapRendererParallelJob(settings)
    job.start()
    job.waitForFinished()
    job.renderedImage().save(png)
    placed = job.takeLabelingResults().labelsWithinRect(settings.visibleExtent())
    labels = {}
    for each in placed:
        labels.setdefault(each.layerID, []).append(each.labelText)
    return {
        "scale": settings.scale(),
        "errors": [error.message for error in job.errors()],
        "labels": labels,
    }


def edit(path, changes):
    """Changes as a person makes them: values, shapes, new rows; each through an edit session."""
    for change in changes:
        layer = QgsVectorLayer(f"{path}|layername={change['layer']}", "layer", "ogr")
        if not layer.isValid() or not layer.startEditing():
            return {"error": layer.error().summary() or "not editable"}
        if "where" in change:
            for feature in list(layer.getFeatures(change["where"])):
                for name, value in change.get("values", {}).items():
                    index = layer.fields().indexOf(name)
                    layer.changeAttributeValue(feature.id(), index, value)
                if "wkt" in change:
                    layer.changeGeometry(feature.id(), QgsGeometry.fromWkt(change["wkt"]))
                if change.get("delete"):
                    layer.deleteFeature(feature.id())
        else:
            feature = QgsFeature(layer.fields())
            feature.setGeometry(QgsGeometry.fromWkt(change["wkt"]))
            for name, value in change.get("values", {}).items():
                feature.setAttribute(name, value)
            layer.addFeature(feature)
        if not layer.commitChanges():
            return {"error": layer.commitErrors()}
    return {"done": len(changes)}


def hold(uri):
    """Keep a layer open, as a person does, until a line comes in."""
    layer = QgsVectorLayer(uri, "layer", "ogr")
    layer.startEditing()
    assert next(layer.getFeatures()).isValid()
    print("holding", flush=True)
    sys.stdin.readline()
    layer.rollBack()
    return {"held": layer.isValid()}


def validity(uris):
    """Errors of `qgis:checkvalidity` by layer, with the GEOS method."""
    sys.path.append("/usr/share/qgis/python/plugins")
    import processing
    from processing.core.Processing import Processing

    Processing.initialize()
    errors = {}
    for uri in uris:
        result = processing.run(
            "qgis:checkvalidity",
            {
                "INPUT_LAYER": uri,
                "METHOD": 2,
                "VALID_OUTPUT": "memory:",
                "INVALID_OUTPUT": "memory:",
                "ERROR_OUTPUT": "memory:",
            },
        )
        errors[uri] = [result["VALID_COUNT"], result["INVALID_COUNT"], result["ERROR_COUNT"]]
    return errors


def several(requests):
    return [ACTIONS[request.pop("do")](**request) for request in requests]


def save_project(uri, title):
    """Save a project as a person does who gave it another title."""
    project = QgsProject.instance()
    assert project.read(uri)
    project.setTitle(title)
    return project.write()


ACTIONS = {
    "save_project": save_project,
    "project": project,
    "vector": vector,
    "raster": raster,
    "render": render,
    "edit": edit,
    "hold": hold,
    "validity": validity,
    "several": several,
}

if __name__ == "__main__":
    request = json.loads(sys.argv[1])
    QgsApplication.setPrefixPath("/usr", True)
    application = QgsApplication([], False)
    application.initQgis()
    assert Qgis.QGIS_VERSION
    assert QgsCoordinateReferenceSystem("EPSG:32636").isValid()
    print("\n@@@" + json.dumps(ACTIONS[request.pop("do")](**request)))
    sys.stdout.flush()
    # Leaving QGIS tidily crashes now and then in headless processes; the answer is out.
    import os

    os._exit(0)
