"""What all algorithms share: parameters from the description, the engine's run, loaded results."""

from __future__ import annotations

import os
import shlex
import tempfile
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsProcessingAlgorithm,
    QgsProcessingException,
    QgsProcessingFeatureSourceDefinition,
    QgsProcessingOutputFile,
    QgsProcessingOutputVectorLayer,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterPoint,
    QgsProcessingParameterRasterDestination,
    QgsProcessingParameterRasterLayer,
    QgsProcessingParameterString,
    QgsProcessingParameterVectorLayer,
    QgsProject,
    QgsProviderRegistry,
    QgsVectorLayer,
)
from qgis.PyQt.QtGui import QIcon

from . import compat, description, engine, parameters, results, sources
from .words import tr

ICONS = Path(__file__).with_name("icons")
#: Layers of a plan that other algorithms of a model may go on with.
PLAN_LAYERS = ("field", "obstacles", "tracks", "segments", "gaps")


class GeofieldAlgorithm(QgsProcessingAlgorithm):
    """One command of geofield as an algorithm.

    Attributes
    ----------
    command : str
        The command that does the work.
    own : set of str
        Parameters of the command that the algorithm gives itself; all others are asked for as
        the command describes them.
    product : str
        The plan in the folder OUTPUT; nothing where OUTPUT is the plan itself.
    """

    identifier = ""
    title = ""
    section = ("", "")
    command = ""
    own: frozenset[str] = frozenset({"as_json"})
    makes_plan = False
    product = ""
    fine: tuple[int, ...] = (0,)

    # -- what QGIS asks ----------------------------------------------------------------------

    def createInstance(self) -> GeofieldAlgorithm:  # noqa: D102
        return type(self)()

    def name(self) -> str:  # noqa: D102
        return self.identifier

    def displayName(self) -> str:  # noqa: D102
        return tr(self.title)

    def groupId(self) -> str:  # noqa: D102
        return self.section[0]

    def group(self) -> str:  # noqa: D102
        return tr(self.section[1])

    def icon(self) -> QIcon:  # noqa: D102
        return QIcon(str(ICONS / "geofield.svg"))

    def shortDescription(self) -> str:  # noqa: D102
        return tr(description.command_help(self.command)[0])

    def shortHelpString(self) -> str:  # noqa: D102
        lines = [tr(each) for each in description.command_help(self.command)]
        if "defaults" in self.own:
            lines.append(tr("What this form shows holds, whatever a plan was made with."))
        lines += [
            f"<b>{each.description()}</b>: {each.help()}"
            for each in self.parameterDefinitions()
            if each.help()
        ]
        return "<p>" + "</p><p>".join(lines) + "</p>"

    def canExecute(self) -> tuple[bool, str]:  # noqa: D102
        try:
            engine.require_engine()
        except engine.EngineError as error:
            return False, str(error)
        return True, ""

    def initAlgorithm(self, configuration: Any = None) -> None:  # noqa: D102
        self.add_inputs()
        for row in self.rows():
            for each in parameters.definitions(row):
                if self.parameterDefinition(each.name()) is None:
                    self.addParameter(each)
        if self.makes_plan:
            load = QgsProcessingParameterBoolean("LOAD", tr("Show the layers in the map"), True)
            load.setFlags(load.flags() | compat.ADVANCED)
            self.addParameter(load)
            self.addOutput(QgsProcessingOutputFile("PLAN_FILE", tr("Plan (GeoPackage)")))
            for layer in PLAN_LAYERS:
                self.addOutput(QgsProcessingOutputVectorLayer(layer.upper(), layer))

    def rows(self) -> list[dict[str, Any]]:
        """The command's parameters that are asked for as it describes them."""
        found = [
            row
            for row in description.parameters(self.command)
            if "setting" in row or row["name"] not in self.own
        ]
        found += parameters.without_option(self.command, found)
        # The usual ones first, in the order of the work.
        return sorted(
            found, key=lambda row: row.get("setting", row["name"]) not in parameters.USUAL
        )

    def processAlgorithm(self, values: Any, context: Any, feedback: Any) -> dict[str, Any]:  # noqa: D102
        try:
            with tempfile.TemporaryDirectory(prefix="geofield_qgis_") as folder:
                values = self._placed(values, context)
                if self.makes_plan:
                    self.refuse_editing(self.written_plan(values, context), context)
                words, environment = self.words(values, context, feedback, folder)
                rows = self.rows()
                environment = {**parameters.unsaid(rows), **environment}
                variables = parameters.without_option(
                    self.command, description.parameters(self.command)
                )
                for row in rows:
                    if row in variables:
                        environment |= parameters.variable(row, self, values, context)
                    else:
                        words += parameters.words(row, self, values, context)
                passed_over = Path("geofield.toml").absolute()
                if os.devnull in words and passed_over.is_file():
                    told = tr("{0} does not count here unless it is named as settings file.")
                    feedback.pushInfo(told.format(passed_over))
                feedback.pushCommandInfo(shlex.join(["geofield", self.command, *words]))
                result = engine.run(
                    [self.command, *words],
                    is_cancelled=feedback.isCanceled,
                    on_progress=_progress_of(feedback),
                    on_line=feedback.pushInfo,
                    environment=environment,
                    fine=self.fine,
                )
                return self.outputs(result, values, context, feedback)
        except engine.EngineError as error:
            raise QgsProcessingException(str(error)) from None

    def _placed(self, values: dict[str, Any], context: Any) -> dict[str, Any]:
        """The values with a place for each product: QGIS names another temporary one each time."""
        found = dict(values)
        for each in self.destinationParameterDefinitions():
            name, is_layer = each.name(), isinstance(each, QgsProcessingParameterRasterDestination)
            if found.get(name) is not None:
                read = self.parameterAsOutputLayer if is_layer else self.parameterAsString
                found[name] = read(values, name, context)
        return found

    # -- what each algorithm says for itself -------------------------------------------------

    def add_inputs(self) -> None:
        """Add the parameters that are layers, places and products."""
        raise NotImplementedError

    def words(
        self, values: Any, context: Any, feedback: Any, folder: str
    ) -> tuple[list[str], dict[str, str]]:
        """Those parameters as words of the command line, and variables."""
        raise NotImplementedError

    def outputs(
        self, result: engine.Result, values: Any, context: Any, feedback: Any
    ) -> dict[str, Any]:
        """What the command made: the plan, unless it says otherwise."""
        plan = self.written_plan(values, context)
        output = self.parameterAsString(values, "OUTPUT", context)
        return {"OUTPUT": output, **self.plan_outputs(plan, values, context)}

    # -- parts that several use --------------------------------------------------------------

    def add_picture(self) -> None:
        """Ask for the picture, as a layer or as anything the command can read."""
        self.addParameter(
            QgsProcessingParameterRasterLayer("IMAGERY", tr("Picture"), optional=True)
        )
        self._add_advanced(
            QgsProcessingParameterString(
                "SOURCE",
                tr("Another picture: a file, a folder, a tile address or a source's name"),
                optional=True,
            )
        )

    def add_point(self, label: str, *, optional: bool = False) -> None:
        """Ask for a point, clicked in any CRS."""
        self.addParameter(QgsProcessingParameterPoint("POINT", label, None, optional))

    def add_boundary(self) -> None:
        """Ask for parcels of the person's own."""
        self._add_advanced(
            QgsProcessingParameterFeatureSource(
                "BOUNDARY",
                tr("Own parcels: the one with the point is the field"),
                [compat.POLYGONS],
                optional=True,
            )
        )

    def add_obstacles_to_avoid(self) -> None:
        """Ask for obstacles that are known already."""
        self.addParameter(
            QgsProcessingParameterFeatureSource(
                "OBSTACLES_TO_AVOID",
                tr("Obstacles to avoid: polygons, points with radius_m, lines"),
                [compat.VECTORS],
                optional=True,
            )
        )

    def add_plan(self) -> None:
        """Ask for a plan, by any of its layers or by its file."""
        self.addParameter(
            QgsProcessingParameterVectorLayer("PLAN", tr("Plan: a layer of its GeoPackage"))
        )

    def picture_words(self, values: Any, context: Any) -> tuple[list[str], dict[str, str]]:
        """The picture as a word of the command line, and its variables."""
        source = self.parameterAsString(values, "SOURCE", context).strip()
        if source:
            return [source], {}
        layer = self.parameterAsRasterLayer(values, "IMAGERY", context)
        if layer is None:
            raise engine.EngineError(tr("Choose a picture."))
        word, environment = sources.imagery(layer)
        return [word], environment

    def point_words(self, values: Any, context: Any) -> list[str]:
        """The point as latitude and longitude."""
        point = self.parameterAsPoint(values, "POINT", context, parameters.LONLAT)
        return ["--lat", f"{point.y():.9f}", "--lon", f"{point.x():.9f}"]

    def source_words(
        self, name: str, option: str, values: Any, context: Any, feedback: Any, folder: str
    ) -> list[str]:
        """A vector source, written to a file of its own, as words; none when not given."""
        source = self.parameterAsSource(values, name, context)
        if source is None:
            return []
        sources.refuse_unsaved(self.source_layer(name, values, context))
        path = sources.written(source, folder, name.lower(), context, feedback)
        return [option, path] if option else [path]

    def source_layer(self, name: str, values: Any, context: Any) -> QgsVectorLayer | None:
        """The layer that a vector source takes its features from, all or the selected ones."""
        value = values.get(name)
        if isinstance(value, QgsProcessingFeatureSourceDefinition):
            values = {**values, name: value.source}
        return self.parameterAsVectorLayer(values, name, context)

    def plan_path(self, values: Any, context: Any) -> str:
        """The GeoPackage of the plan; edits that are not saved are refused."""
        path = path_of(self.parameterAsVectorLayer(values, "PLAN", context))
        if not path:
            raise engine.EngineError(tr("Choose a layer of a plan."))
        self.refuse_unsaved_plan(path, context)
        return path

    def refuse_unsaved_plan(self, path: str, context: Any) -> None:
        """Refuse a plan while any of its layers has edits that lie in no file yet."""
        for layer in _layers_of(path, context):
            sources.refuse_unsaved(layer)

    def refuse_editing(self, path: str, context: Any) -> None:
        """Refuse to write a plan while any of its layers is edited: QGIS holds its file then."""
        for layer in _layers_of(path, context):
            sources.refuse_unsaved(layer)
            if isinstance(layer, QgsVectorLayer) and layer.isEditable():
                told = tr("The layer {0} is being edited: end that first, its file is replaced.")
                raise engine.EngineError(told.format(layer.name()))

    def written_plan(self, values: Any, context: Any) -> str:
        """The GeoPackage that the command writes."""
        return str(Path(self.parameterAsString(values, "OUTPUT", context)) / self.product)

    def add_geopackage(self) -> None:
        """A GeoPackage for a plan, as OUTPUT."""
        self.addParameter(
            QgsProcessingParameterFileDestination("OUTPUT", tr("Plan"), "GeoPackage (*.gpkg)")
        )

    def plan_outputs(self, plan: str | Path, values: Any, context: Any) -> dict[str, Any]:
        """The layers of a plan, and their loading."""
        plan = Path(plan)
        _, found = results.entries(plan)
        there = {entry.source.rpartition("layername=")[2] for entry in found}
        if self.parameterAsBoolean(values, "LOAD", context):
            results.load_on_completion(plan, context)
        made: dict[str, Any] = {"PLAN_FILE": str(plan)}
        for layer in PLAN_LAYERS:
            if layer in there:
                made[layer.upper()] = f"{plan}|layername={layer}"
        return made

    def _add_advanced(self, definition: Any) -> None:
        definition.setFlags(definition.flags() | compat.ADVANCED)
        self.addParameter(definition)


def path_of(layer: Any) -> str:
    """The file that a layer lies in, as :func:`results.settled` names it; empty for none."""
    if layer is None or layer.dataProvider() is None:
        return ""
    decoded = QgsProviderRegistry.instance().decodeUri(layer.providerType(), layer.source())
    path = str(decoded.get("path") or "")
    return str(results.settled(path)) if path else ""


def _layers_of(path: str, context: Any) -> list[Any]:
    path = str(results.settled(path))
    layers = (context.project() or QgsProject.instance()).mapLayers().values()
    return [each for each in layers if path_of(each) == path]


def _progress_of(feedback: Any) -> Any:
    def tell(done: int, total: int, what: str) -> None:
        if total:
            feedback.setProgress(100.0 * done / total)
        feedback.setProgressText(what)

    return tell
