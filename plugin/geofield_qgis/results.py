"""Products in the project: styled, in their group, in the order of the plan's own QGIS project."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsApplication,
    QgsLayerTreeGroup,
    QgsMapLayer,
    QgsProcessingContext,
    QgsProcessingLayerPostProcessorInterface,
    QgsProject,
    QgsRasterLayer,
    QgsReadWriteContext,
    QgsRuleBasedRenderer,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QBuffer, QIODevice, QMetaObject, Qt
from qgis.PyQt.QtXml import QDomDocument

from .words import tr

#: Kept alive until QGIS has shown the layers: it holds no reference of its own.
_WAITING: list[Placing] = []
#: Property of a group: the plan whose layers it holds.
_PLAN = "geofield/plan"


class Entry:
    """A layer of a plan as its own project shows it."""

    def __init__(self, name: str, source: str, is_raster: bool, shown: bool) -> None:
        self.name, self.source, self.is_raster, self.shown = name, source, is_raster, shown

    def open(self) -> QgsMapLayer:
        """The layer, with the style that lies in its file."""
        if self.is_raster:
            return QgsRasterLayer(self.source, self.name)
        return QgsVectorLayer(self.source, self.name, "ogr")


def settled(path: str | Path) -> Path:
    """A file's path with the links of its folders followed: the same text for the same file."""
    path = Path(path)
    return path.parent.resolve() / path.name


def entries(plan: str | Path) -> tuple[str, list[Entry]]:
    """The name of a plan and its layers from top to bottom, as its QGIS project lists them."""
    plan = Path(plan)
    project = plan.with_suffix(".qgz")
    packed = project.read_bytes() if project.is_file() else _within(plan)
    if not packed:
        return plan.stem, []
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        text = archive.read(next(n for n in archive.namelist() if n.endswith(".qgs")))
    document = QDomDocument()
    document.setContent(text.decode("utf-8"))
    nodes = document.elementsByTagName("layer-tree-layer")
    found = []
    for number in range(nodes.count()):
        node = nodes.at(number).toElement()
        path, bar, rest = node.attribute("source").partition("|")
        file = settled(plan.parent / path)
        if file.is_file():
            found.append(
                Entry(
                    node.attribute("name"),
                    f"{file}{bar}{rest}",
                    node.attribute("providerKey") == "gdal",
                    node.attribute("checked") == "Qt::Checked",
                )
            )
    title = document.elementsByTagName("title").at(0).toElement().text()
    return title or plan.stem, found


def _within(plan: Path) -> bytes:
    """The project that lies in the GeoPackage itself; nothing where there is none."""
    storage = QgsApplication.projectStorageRegistry().projectStorageFromType("geopackage")
    if not plan.is_file() or storage is None:
        return b""
    packed, place = QBuffer(), f"geopackage:{plan}"
    packed.open(QIODevice.OpenModeFlag.ReadWrite)
    for name in storage.listProjects(place)[:1]:
        storage.readProject(f"{place}?projectName={name}", packed, QgsReadWriteContext())
    return bytes(packed.data())


class Placing(QgsProcessingLayerPostProcessorInterface):
    """Puts a layer that Processing loaded into the group of its plan, at its place."""

    def __init__(self, plan: Path, title: str, place: int, shown: bool) -> None:
        super().__init__()
        self.plan, self.title, self.place, self.shown = plan, title, place, shown

    def postProcessLayer(
        self, layer: QgsMapLayer, context: QgsProcessingContext, feedback: Any
    ) -> None:
        """Move the layer, which QGIS has put at the top of its tree."""
        if isinstance(layer, QgsVectorLayer):
            # Processing loads layers bare; the style lies in the file.
            layer.loadDefaultStyle()
        group = group_of(context.project() or QgsProject.instance(), self.plan, self.title)
        place_layer(layer, group, self.place, self.shown)


def group_of(project: QgsProject, plan: Path, title: str) -> QgsLayerTreeGroup:
    """The group of a plan, made where there is none; another plan of the same field has its own."""
    root, path = project.layerTreeRoot(), str(settled(plan))
    groups = root.findGroups(True)
    for group in groups:
        if group.customProperty(_PLAN) == path:
            return group
    for group in groups:  # a project that was moved with its plans knows them by their layers
        layers = [node.layer() for node in group.findLayers() if node.parent() == group]
        files = [Path(layer.source().split("|", 1)[0]) for layer in layers if layer is not None]
        if group.customProperty(_PLAN) and any(str(settled(file)) == path for file in files):
            group.setCustomProperty(_PLAN, path)
            return group
    taken = root.findGroup(title) is not None
    group = root.insertGroup(0, f"{title} ({plan.parent.name}/{plan.stem})" if taken else title)
    group.setCustomProperty(_PLAN, path)
    return group


def place_layer(layer: QgsMapLayer, group: QgsLayerTreeGroup, place: int, shown: bool) -> None:
    """Put a layer into a group; a lower place is nearer to the top."""
    _speak(layer)
    layer.setCustomProperty("geofield/place", place)
    root = group
    while root.parent() is not None:
        root = root.parent()
    old = root.findLayer(layer.id())
    index = sum(
        1
        for node in group.findLayers()
        if node.layer() is not None
        and int(node.layer().customProperty("geofield/place", 99)) <= place
        and node.layerId() != layer.id()
    )
    node = group.insertLayer(index, layer)
    node.setItemVisibilityChecked(shown)
    node.setExpanded(False)
    if old is not None:
        (old.parent() or root).removeChildNode(old)


def _speak(layer: QgsMapLayer) -> None:
    """Show a layer's name and legend in the language of QGIS; its file stays as it is."""
    layer.setName(tr(layer.name()))
    if isinstance(layer, QgsVectorLayer) and isinstance(layer.renderer(), QgsRuleBasedRenderer):
        renderer = layer.renderer().clone()
        for rule in renderer.rootRule().children():
            rule.setLabel(tr(rule.label()))
        layer.setRenderer(renderer)


def load_on_completion(plan: str | Path, context: QgsProcessingContext) -> None:
    """Have Processing load the layers of a plan when the algorithm has ended.

    Those that are there already are read again.
    """
    title, found = entries(plan)
    project = context.project()
    if project is None:
        return
    known = _by_source(project)
    for place, entry in reversed(list(enumerate(found))):
        if entry.source in known:
            # Algorithms run beside the thread of the layers.
            queued = Qt.ConnectionType.QueuedConnection
            QMetaObject.invokeMethod(known[entry.source], "reload", queued)
            continue
        details = QgsProcessingContext.LayerDetails(entry.name, project, entry.name)
        placing = Placing(Path(plan), title, place, entry.shown)
        _WAITING.append(placing)
        del _WAITING[:-200]
        details.setPostProcessor(placing)
        context.addLayerToLoadOnCompletion(entry.source, details)


def show(plan: str | Path, project: QgsProject | None = None) -> dict[str, QgsMapLayer]:
    """Load the layers of a plan at once; those that are there already are read again.

    Returns
    -------
    dict
        The layers by their names in the file (`field`, `obstacles`, ...).
    """
    project = project or QgsProject.instance()
    title, found = entries(plan)
    shown: dict[str, QgsMapLayer] = {}
    known = _by_source(project)
    for place, entry in enumerate(found):
        layer = known.get(entry.source)
        if layer is None:
            layer = entry.open()
            project.addMapLayer(layer, False)
            place_layer(layer, group_of(project, Path(plan), title), place, entry.shown)
        else:
            layer.reload()
        _, _, name = entry.source.rpartition("layername=")
        shown["scene" if entry.is_raster else name] = layer
    return shown


def load(plan: str | Path, table: str) -> QgsVectorLayer:
    """Load one layer of a plan, at its place."""
    title, found = entries(plan)
    source = f"{settled(plan)}|layername={table}"
    listed = {each.source: place for place, each in enumerate(found)}
    place = listed.get(source, 0)
    name = found[place].name if source in listed else table
    layer = QgsVectorLayer(source, name, "ogr")
    project = QgsProject.instance()
    project.addMapLayer(layer, False)
    place_layer(layer, group_of(project, Path(plan), title), place, True)
    return layer


def _by_source(project: QgsProject) -> dict[str, QgsMapLayer]:
    return {layer.source(): layer for layer in project.mapLayers().values()}
