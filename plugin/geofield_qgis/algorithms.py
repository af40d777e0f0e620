"""The algorithms that plan: which command each runs, what it takes and what it makes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsFields,
    QgsGeometry,
    QgsProcessingOutputNumber,
    QgsProcessingParameterExtent,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterFolderDestination,
    QgsProcessingParameterRasterDestination,
    QgsVectorFileWriter,
    QgsWkbTypes,
)

from . import compat, sources
from .algorithm import GeofieldAlgorithm
from .engine import EngineError
from .file_algorithms import (
    EvaluateAlgorithm,
    ExportAlgorithm,
    ImportAlgorithm,
    ValidateAlgorithm,
)
from .words import tr

FIELD = ("field", "Plan a field")
STAGES = ("stages", "Stage by stage")
#: Plans that are loaded at most when many fields were planned at once.
MOST_LOADED = 20


class PlanAlgorithm(GeofieldAlgorithm):
    """The main job: picture and point in, all products out."""

    identifier, title, section, command = "plan", "Plan a field", FIELD, "run"
    own = GeofieldAlgorithm.own | {"imagery", "lat", "lon", "out", "boundary", "boundary_layer"}
    makes_plan, product = True, "field.gpkg"

    def add_inputs(self) -> None:
        """Picture, point and folder."""
        self.add_picture()
        self.add_point(tr("A point in the field"))
        self.add_boundary()
        self.addParameter(
            QgsProcessingParameterFolderDestination("OUTPUT", tr("Folder for the products"))
        )

    def words(self, values: Any, context: Any, feedback: Any, folder: str) -> Any:
        """See GeofieldAlgorithm."""
        words, environment = self.picture_words(values, context)
        words += self.point_words(values, context)
        words += ["--out", self.parameterAsString(values, "OUTPUT", context), "--json"]
        words += self.source_words("BOUNDARY", "--boundary", values, context, feedback, folder)
        return words, environment


class ManyFieldsAlgorithm(GeofieldAlgorithm):
    """Any number of fields into one farm."""

    identifier, title, section, command = "batch", "Plan many fields", FIELD, "batch"
    own = GeofieldAlgorithm.own | {
        "places", "imagery", "out", "obstacle_file", "layer", "places_crs", "lat_column",
        "lon_column", "overview", "scheduler",
    }  # fmt: skip
    makes_plan, product = True, "farm.gpkg"

    def add_inputs(self) -> None:
        """Points or parcels, picture and folder."""
        self.addParameter(
            QgsProcessingParameterFeatureSource(
                "PLACES", tr("Points in the fields, or parcels"), [compat.VECTORS]
            )
        )
        self.add_picture()
        self.add_obstacles_to_avoid()
        self.addParameter(
            QgsProcessingParameterFolderDestination("OUTPUT", tr("Folder of the farm"))
        )
        self.addOutput(QgsProcessingOutputNumber("FIELDS", tr("Fields planned")))

    def words(self, values: Any, context: Any, feedback: Any, folder: str) -> Any:
        """See GeofieldAlgorithm."""
        words = self.source_words("PLACES", "", values, context, feedback, folder)
        environment: dict[str, str] = {}
        if values.get("IMAGERY") or values.get("SOURCE"):
            picture, environment = self.picture_words(values, context)
            words += picture
        words += self.source_words(
            "OBSTACLES_TO_AVOID", "--obstacles", values, context, feedback, folder
        )
        return [*words, "--out", self.parameterAsString(values, "OUTPUT", context), "--json"], (
            environment
        )

    def outputs(self, result: Any, values: Any, context: Any, feedback: Any) -> dict[str, Any]:
        """See GeofieldAlgorithm."""
        counts = result.data or {}
        return {
            "FIELDS": sum(counts.get(name, 0) for name in ("done", "doubtful")),
            **super().outputs(result, values, context, feedback),
        }


class OutlineAlgorithm(GeofieldAlgorithm):
    """The outline of the field around a point."""

    identifier, title, section, command = "outline", "Find the outline", STAGES, "field"
    own = GeofieldAlgorithm.own | {
        "imagery", "lat", "lon", "output", "boundary", "boundary_layer", "list_regions",
    }  # fmt: skip
    makes_plan = True

    def add_inputs(self) -> None:
        """Picture, point and GeoPackage."""
        self.add_picture()
        self.add_point(tr("A point in the field"))
        self.add_boundary()
        self.add_geopackage()

    def words(self, values: Any, context: Any, feedback: Any, folder: str) -> Any:
        """See GeofieldAlgorithm."""
        words, environment = self.picture_words(values, context)
        words += self.point_words(values, context)
        words += ["-o", self.parameterAsString(values, "OUTPUT", context)]
        words += self.source_words("BOUNDARY", "--boundary", values, context, feedback, folder)
        return words, environment


class ObstaclesAlgorithm(GeofieldAlgorithm):
    """The obstacles in a field whose outline is known."""

    identifier, title, section, command = "obstacles", "Find the obstacles", STAGES, "obstacles"
    own = GeofieldAlgorithm.own | {"imagery", "plan_file", "output", "defaults"}
    makes_plan = True

    def add_inputs(self) -> None:
        """Picture, plan and GeoPackage."""
        self.add_picture()
        self.add_plan()
        self.add_geopackage()

    def words(self, values: Any, context: Any, feedback: Any, folder: str) -> Any:
        """See GeofieldAlgorithm."""
        words, environment = self.picture_words(values, context)
        output = self.parameterAsString(values, "OUTPUT", context)
        # What the dialog shows holds.
        return [*words, self.plan_path(values, context), "-o", output, "--defaults"], environment


class TracksAlgorithm(GeofieldAlgorithm):
    """Tracks on any polygons, or on a plan with all that a person changed in it."""

    identifier, title, section, command = "tracks", "Plan the tracks", STAGES, "tracks"
    own = GeofieldAlgorithm.own | {"file", "output", "obstacle_file", "crs", "each", "defaults"}
    makes_plan = True

    def add_inputs(self) -> None:
        """Polygons, obstacles and folder."""
        self.addParameter(
            QgsProcessingParameterFeatureSource("INPUT", tr("Fields"), [compat.POLYGONS])
        )
        self.add_obstacles_to_avoid()
        self.addParameter(
            QgsProcessingParameterFolderDestination("OUTPUT", tr("Folder for the plans"))
        )
        self.addOutput(QgsProcessingOutputNumber("FIELDS", tr("Fields planned")))
        self.addOutput(QgsProcessingOutputNumber("LENGTH_M", tr("Length of all segments, metres")))

    def words(self, values: Any, context: Any, feedback: Any, folder: str) -> Any:
        """See GeofieldAlgorithm."""
        layer = self.source_layer("INPUT", values, context)
        sources.refuse_unsaved(layer)
        plan = sources.plan_file(layer)
        if plan is not None:
            if sources.is_whole(self.parameterAsSource(values, "INPUT", context), layer):
                self.refuse_unsaved_plan(plan, context)
            else:
                part = tr("Only some fields of {0} are taken: the obstacles in it do not count.")
                feedback.pushWarning(part.format(plan))
                plan = None
        obstacles = self.source_words(
            "OBSTACLES_TO_AVOID", "--obstacles", values, context, feedback, folder
        )
        # The field layer of a plan stands for the plan: its obstacles count, too.
        words = (
            [plan]
            if plan is not None
            else self.source_words("INPUT", "", values, context, feedback, folder)
        )
        output = self.parameterAsString(values, "OUTPUT", context)
        Path(output).mkdir(parents=True, exist_ok=True)
        # What the dialog shows holds, not what a plan was made with.
        return [*words, "-o", output, "--each", *obstacles, "--defaults", "--json"], {}

    def written_plan(self, values: Any, context: Any) -> str:
        """The plan itself keeps its name; parcels are called by theirs, which the command knows."""
        plan = sources.plan_file(self.source_layer("INPUT", values, context))
        return str(Path(super().written_plan(values, context)) / Path(plan or "").name)

    def outputs(self, result: Any, values: Any, context: Any, feedback: Any) -> dict[str, Any]:
        """See GeofieldAlgorithm."""
        rows = (result.data or {}).get("fields", [])
        made: dict[str, Any] = {
            "OUTPUT": self.parameterAsString(values, "OUTPUT", context),
            "FIELDS": len(rows),
            "LENGTH_M": sum(row["length_m"] for row in rows),
        }
        for row in rows[MOST_LOADED:]:
            feedback.pushInfo(row["file"])
        for row in reversed(rows[:MOST_LOADED]):
            made |= self.plan_outputs(row["file"], values, context)
        return made


class RouteAlgorithm(TracksAlgorithm):
    """Tracks with the order of work and the turns between them."""

    identifier, title = "route", "Plan tracks and route"

    def rows(self) -> list[dict[str, Any]]:
        """The order of work is asked for with another default."""
        return [
            {**row, "default": None, "choices": [c for c in row["choices"] if c != "none"]}
            if row.get("setting") == "tracks.route"
            else row
            for row in super().rows()
        ]

    def words(self, values: Any, context: Any, feedback: Any, folder: str) -> Any:
        """As for tracks; without another word the shortest route."""
        words, environment = super().words(values, context, feedback, folder)
        if values.get("ROUTE") in (None, ""):
            words += ["--route", "shortest"]
        return words, environment


class ImageryAlgorithm(GeofieldAlgorithm):
    """The picture of a place from any source."""

    identifier, title, section, command = "imagery", "Get imagery", STAGES, "tiles"
    own = GeofieldAlgorithm.own | {"source", "lat", "lon", "area", "output"}

    def add_inputs(self) -> None:
        """Source, place and GeoTIFF."""
        self.add_picture()
        self.add_point(tr("Centre"), optional=True)
        self.addParameter(QgsProcessingParameterExtent("EXTENT", tr("Or an extent"), optional=True))
        self.addParameter(QgsProcessingParameterRasterDestination("OUTPUT", tr("Picture")))

    def words(self, values: Any, context: Any, feedback: Any, folder: str) -> Any:
        """See GeofieldAlgorithm."""
        words, environment = self.picture_words(values, context)
        if values.get("EXTENT") not in (None, ""):
            lonlat = QgsCoordinateReferenceSystem("EPSG:4326")
            extent = self.parameterAsExtent(values, "EXTENT", context, lonlat)
            words += ["--area", _extent_file(extent, lonlat, folder, context)]
        elif values.get("POINT") not in (None, ""):
            words += self.point_words(values, context)
        else:
            raise EngineError(tr("Give a centre or an extent."))
        output = self.parameterAsString(values, "OUTPUT", context)
        return [*words, "-o", output, "--json"], environment

    def outputs(self, result: Any, values: Any, context: Any, feedback: Any) -> dict[str, Any]:
        """See GeofieldAlgorithm."""
        return {"OUTPUT": self.parameterAsString(values, "OUTPUT", context)}


ALGORITHMS = (
    PlanAlgorithm,
    OutlineAlgorithm,
    ObstaclesAlgorithm,
    TracksAlgorithm,
    RouteAlgorithm,
    ManyFieldsAlgorithm,
    ImageryAlgorithm,
    ExportAlgorithm,
    ImportAlgorithm,
    ValidateAlgorithm,
    EvaluateAlgorithm,
)


def _extent_file(extent: Any, crs: QgsCoordinateReferenceSystem, folder: str, context: Any) -> str:
    """An extent as a file with one polygon."""
    path = str(Path(folder) / "extent.gpkg")
    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName, options.layerName = "GPKG", "extent"
    writer = QgsVectorFileWriter.create(
        path, QgsFields(), QgsWkbTypes.Type.Polygon, crs, context.transformContext(), options
    )
    feature = QgsFeature()
    feature.setGeometry(QgsGeometry.fromRect(extent))
    writer.addFeature(feature)
    del writer  # closes the file
    return path
