"""The algorithms for files: plans in other formats and from them, checks and comparisons."""

from __future__ import annotations

from typing import Any

from qgis.core import (
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterFolderDestination,
    QgsProcessingParameterMultipleLayers,
    QgsProcessingParameterRasterLayer,
)

from . import compat, sources
from .algorithm import GeofieldAlgorithm
from .engine import EngineError
from .words import tr

FILES = ("files", "Files and checks")


class ExportAlgorithm(GeofieldAlgorithm):
    """A plan in the formats of terminals and other programs."""

    identifier, title, section, command = "export", "Export for terminals", FILES, "export"
    own = GeofieldAlgorithm.own | {"plan_files", "folder", "crs"}

    def add_inputs(self) -> None:
        """Plan and folder."""
        self.add_plan()
        self.addParameter(
            QgsProcessingParameterFolderDestination("OUTPUT", tr("Folder for the products"))
        )

    def rows(self) -> list[dict[str, Any]]:
        """The formats come first: nothing is exported without one."""
        return sorted(super().rows(), key=lambda row: row["name"] != "formats")

    def words(self, values: Any, context: Any, feedback: Any, folder: str) -> Any:
        """See GeofieldAlgorithm."""
        output = self.parameterAsString(values, "OUTPUT", context)
        return [self.plan_path(values, context), "--out", output, "--json"], {}

    def outputs(self, result: Any, values: Any, context: Any, feedback: Any) -> dict[str, Any]:
        """See GeofieldAlgorithm."""
        for file in (result.data or {}).get("files", []):
            feedback.pushInfo(file)
        return {"OUTPUT": self.parameterAsString(values, "OUTPUT", context)}


class ImportAlgorithm(GeofieldAlgorithm):
    """Other programs' boundaries, obstacles and lines as a plan."""

    identifier, title, section, command = "import", "Import boundaries", FILES, "import"
    own = GeofieldAlgorithm.own | {"files", "output"}
    makes_plan = True

    def add_inputs(self) -> None:
        """Files and GeoPackage."""
        self.addParameter(QgsProcessingParameterMultipleLayers("FILES", tr("Files"), compat.FILES))
        self.add_geopackage()

    def words(self, values: Any, context: Any, feedback: Any, folder: str) -> Any:
        """See GeofieldAlgorithm."""
        files = self.parameterAsFileList(values, "FILES", context)
        return [*files, "-o", self.parameterAsString(values, "OUTPUT", context)], {}


class ValidateAlgorithm(GeofieldAlgorithm):
    """Products checked against their formats."""

    identifier, title, section, command = "validate", "Check products", FILES, "validate"
    own = GeofieldAlgorithm.own | {"files"}
    fine = (0, 1)

    def add_inputs(self) -> None:
        """Files."""
        self.addParameter(QgsProcessingParameterMultipleLayers("FILES", tr("Files"), compat.FILES))
        self.addOutput(QgsProcessingOutputNumber("ERRORS", tr("Errors")))
        self.addOutput(QgsProcessingOutputNumber("WARNINGS", tr("Warnings")))
        self.addOutput(QgsProcessingOutputString("FINDINGS", tr("Findings")))

    def words(self, values: Any, context: Any, feedback: Any, folder: str) -> Any:
        """See GeofieldAlgorithm."""
        return [*self.parameterAsFileList(values, "FILES", context), "--json"], {}

    def outputs(self, result: Any, values: Any, context: Any, feedback: Any) -> dict[str, Any]:
        """See GeofieldAlgorithm."""
        if result.data is None:
            raise EngineError(" ".join(result.lines) or tr("The engine gave no answer."))
        lines, levels = [], []
        for file, findings in result.data.items():
            for each in findings:
                levels.append(each["level"])
                lines.append(f"{file}: {each['level']}: {each['where']}: {each['message']}")
        for line in lines or [tr("No fault found.")]:
            feedback.pushInfo(line)
        return {
            "ERRORS": levels.count("error"),
            "WARNINGS": levels.count("warning"),
            "FINDINGS": "\n".join(lines),
        }


class EvaluateAlgorithm(GeofieldAlgorithm):
    """Detected obstacles against a truth."""

    identifier, title, section, command = "evaluate", "Compare with a truth", FILES, "evaluate"
    own = GeofieldAlgorithm.own | {
        "detected", "truth", "layer", "truth_layer", "picture", "scene_file",
    }  # fmt: skip
    figures = ("precision", "recall", "f1")

    def add_inputs(self) -> None:
        """Two layers, and a picture to draw."""
        for name, label in (("DETECTED", tr("Detected obstacles")), ("TRUTH", tr("Truth"))):
            self.addParameter(QgsProcessingParameterFeatureSource(name, label, [compat.VECTORS]))
        self.addParameter(
            QgsProcessingParameterRasterLayer("SCENE", tr("Picture to draw on"), optional=True)
        )
        self.addParameter(
            QgsProcessingParameterFileDestination(
                "PICTURE", tr("Drawing of hits and misses"), "PNG (*.png)", None, True, False
            )
        )
        for figure in self.figures:
            self.addOutput(QgsProcessingOutputNumber(figure.upper(), figure))

    def words(self, values: Any, context: Any, feedback: Any, folder: str) -> Any:
        """See GeofieldAlgorithm."""
        words = []
        for name in ("DETECTED", "TRUTH"):
            words += self.source_words(name, "", values, context, feedback, folder)
        words += ["--layer", "detected", "--json"]
        environment: dict[str, str] = {}
        picture = self.parameterAsString(values, "PICTURE", context)
        if picture:
            words += ["--draw", picture, "--overwrite"]  # QGIS has asked
        scene = self.parameterAsRasterLayer(values, "SCENE", context)
        if scene is not None:
            picture, environment = sources.imagery(scene)
            words += ["--scene", picture]
        return words, environment

    def outputs(self, result: Any, values: Any, context: Any, feedback: Any) -> dict[str, Any]:
        """See GeofieldAlgorithm."""
        found = result.data or {}
        for name, value in found.items():
            feedback.pushInfo(f"{name}: {value}")
        made = {figure.upper(): found.get(figure) for figure in self.figures}
        picture = self.parameterAsString(values, "PICTURE", context)
        return {**made, "PICTURE": picture} if picture else made
