"""The plugin in a real QGIS; run by Debian's Python, prints one JSON value.

    /usr/bin/python3 client.py '{"do": "parameters"}'

QGIS_PLUGINPATH names the folder of the plugin, as for every QGIS.
"""

import json
import os
import re
import sys
import threading
import time
import traceback

from qgis.core import (
    QgsApplication,
    QgsFeature,
    QgsField,
    QgsFields,
    QgsGeometry,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProject,
    QgsRasterLayer,
    QgsSettings,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QVariant


class Feedback(QgsProcessingFeedback):
    def __init__(self):
        super().__init__(False)
        self.seen = []
        self.progressChanged.connect(lambda value: self.seen.append(round(value)))


def layer_of(what):
    """A layer as a person would have it in the project."""
    if isinstance(what, str):
        return what
    if "raster" in what:
        return QgsRasterLayer(what["raster"], "picture", what.get("provider", "gdal"))
    if "memory" in what:
        layer = QgsVectorLayer(f"{what['kind']}?crs={what['crs']}", what["memory"], "memory")
        fields = QgsFields()
        for name in what.get("fields", ()):
            number = isinstance(what["rows"][0][name], (int, float))
            fields.append(QgsField(name, QVariant.Double if number else QVariant.String))
        layer.dataProvider().addAttributes(list(fields))
        layer.updateFields()
        for row in what["rows"]:
            feature = QgsFeature(layer.fields())
            feature.setGeometry(QgsGeometry.fromWkt(row["wkt"]))
            for name in what.get("fields", ()):
                feature.setAttribute(name, row.get(name))
            layer.dataProvider().addFeature(feature)
    else:
        layer = QgsVectorLayer(what["vector"], "layer", "ogr")
    if what.get("filter"):
        assert layer.setSubsetString(what["filter"])
    if what.get("select"):
        layer.selectByExpression(what["select"])
    if "edit" in what:  # so many rows are deleted
        layer.startEditing()
        layer.deleteFeatures([each.id() for each in layer.getFeatures()][: what["edit"]])
    QgsProject.instance().addMapLayer(layer)
    return layer


def given(values):
    from qgis.core import QgsProcessingFeatureSourceDefinition

    made = {}
    for name, value in values.items():
        made[name] = value
        if isinstance(value, dict):
            layer = layer_of(value)
            made[name] = layer
            if value.get("select") and not value.get("whole"):
                made[name] = QgsProcessingFeatureSourceDefinition(layer.id(), True)
    return made


def run(algorithm, values, stop_after_s=None, stop_at_percent=None, project_crs=None, beside=None):
    """processing.run, timed; optionally stopped by a person after a while."""
    import processing
    from qgis.core import QgsCoordinateReferenceSystem

    if project_crs:
        QgsProject.instance().setCrs(QgsCoordinateReferenceSystem(project_crs))
    if beside:
        layer_of(beside)
    feedback = Feedback()
    stopped = []

    def stop():
        stopped.append(time.monotonic())
        feedback.cancel()

    if stop_after_s is not None:
        threading.Timer(stop_after_s, stop).start()
    if stop_at_percent is not None:
        feedback.progressChanged.connect(
            lambda value: stop() if value >= stop_at_percent and not stopped else None
        )
    begun = time.monotonic()
    try:
        result = processing.run(algorithm, given(values), feedback=feedback)
    except Exception as error:  # noqa: BLE001 - told to the test
        return {
            "error": str(error),
            "after_stop_s": time.monotonic() - stopped[0] if stopped else None,
        }
    return {
        "result": {k: v for k, v in result.items() if isinstance(v, (str, int, float))},
        "wall_s": time.monotonic() - begun,
        "progress": feedback.seen,
        "log": feedback.textLog(),
    }


def shown(plan):
    """The names of a plan's layers as they are found again, by its path, after it was shown."""
    from geofield_qgis import plan_files, results

    results.show(plan)
    return sorted(plan_files.layers_of(plan))


def parameters():
    from geofield_qgis import description
    from geofield_qgis import parameters as own

    provider = QgsApplication.processingRegistry().providerById("geofield")
    found = {}
    for algorithm in provider.algorithms():
        reached = [row.get("setting") for row in algorithm.rows()]
        found[algorithm.id()] = {
            "group": algorithm.group(),
            "parameters": {
                each.name(): [each.type(), bool(each.flags() & each.FlagAdvanced), each.help()]
                for each in algorithm.parameterDefinitions()
            },
            "settings": [name for name in reached if name],
            "can": list(algorithm.canExecute()),
            "help": algorithm.shortHelpString(),
            "icon": not algorithm.icon().isNull(),
        }
    return {
        "algorithms": found,
        "in_file": list(own.IN_SETTINGS_FILE),
        "settings": list(description.settings()),
    }


def model(folder, imagery, point):
    """Outline, obstacles and tracks in a model of the designer, and that in a batch."""
    import processing
    from qgis.core import (
        QgsProcessingModelAlgorithm,
        QgsProcessingModelChildAlgorithm,
        QgsProcessingModelChildParameterSource,
        QgsProcessingModelParameter,
        QgsProcessingParameterPoint,
    )

    made = QgsProcessingModelAlgorithm("whole", "tests")
    made.addModelParameter(
        QgsProcessingParameterPoint("POINT", "point"), QgsProcessingModelParameter("POINT")
    )
    source = QgsProcessingModelChildParameterSource

    def child(algorithm, **values):
        step = QgsProcessingModelChildAlgorithm(f"geofield:{algorithm}")
        step.setChildId(algorithm)
        for name, value in values.items():
            step.addParameterSources(name, [value])
        made.addChildAlgorithm(step)

    child(
        "outline",
        IMAGERY=source.fromStaticValue(imagery),
        POINT=source.fromModelParameter("POINT"),
        OUTPUT=source.fromStaticValue(f"{folder}/outline.gpkg"),
    )
    child(
        "obstacles",
        IMAGERY=source.fromStaticValue(imagery),
        PLAN=source.fromChildOutput("outline", "FIELD"),
        OUTPUT=source.fromStaticValue(f"{folder}/obstacles.gpkg"),
    )
    child(
        "tracks",
        INPUT=source.fromChildOutput("obstacles", "FIELD"),
        SPACING_M=source.fromStaticValue(4),
        OUTPUT=source.fromStaticValue(f"{folder}/tracks"),
    )
    made.initAlgorithm()
    result = processing.run(made, {"POINT": point})
    return {k: v for k, v in result.items() if isinstance(v, (str, int, float))}


def loaded(algorithm, values):
    """What stands in the project after an algorithm that was run from its dialogue."""
    from processing.gui.Postprocessing import handleAlgorithmResults

    context = QgsProcessingContext()
    context.setProject(QgsProject.instance())
    feedback = Feedback()
    found = QgsApplication.processingRegistry().createAlgorithmById(algorithm)
    _, done = found.run(given(values), context, feedback)
    if not done:
        return {"error": feedback.textLog()}
    handleAlgorithmResults(found, context, feedback)
    QgsApplication.processEvents()
    root = QgsProject.instance().layerTreeRoot()
    return {
        "obstacles_m2": [
            sum(row.geometry().area() for row in layer.getFeatures())
            for layer in QgsProject.instance().mapLayersByName("Obstacles")
        ],
        "groups": {
            group.name(): [
                [node.name(), node.isVisible(), type(node.layer().renderer()).__name__]
                for node in group.findLayers()
            ]
            for group in root.findGroups()
        },
        "loose": [node.name() for node in root.children() if not hasattr(node, "findLayers")],
    }


def spoken(language):
    """What a dialogue says in another language."""
    from geofield_qgis.algorithms import ALGORITHMS, PlanAlgorithm, TracksAlgorithm
    from geofield_qgis.words import Words
    from qgis.PyQt.QtCore import QCoreApplication

    def helped():
        found = set()
        for kind in ALGORITHMS:
            tool = kind()
            tool.initAlgorithm()
            paragraphs = re.findall("<p>(.*?)</p>", tool.shortHelpString())
            found |= {tool.shortDescription(), *(each.split("</b>: ")[-1] for each in paragraphs)}
        return found

    english, words = helped(), Words(language)
    QCoreApplication.installTranslator(words)
    tracks = TracksAlgorithm()
    tracks.initAlgorithm()
    return {
        "plan": PlanAlgorithm().displayName(),
        "group": tracks.group(),
        "label": tracks.parameterDefinition("SPACING_M").description(),
        "theirs": QCoreApplication.translate("QgsProcessingParameters", "%1 [optional]"),
        "helped": len(english),
        "still_english": sorted(english & helped()),
    }


def told(language, texts):
    """What the plugin says for what the engine said."""
    from geofield_qgis.words import Words, tr
    from qgis.PyQt.QtCore import QCoreApplication

    words = Words(language)
    QCoreApplication.installTranslator(words)
    return [tr(each) for each in texts]


def web_layers(addresses):
    """How web layers are told to the command."""
    from geofield_qgis import sources

    made = []
    for address in addresses:
        layer = QgsRasterLayer(address, "web", "wms")
        layer.setAttribution("© Survey")
        made.append(sources.imagery(layer))
    return made


def install(requirements, wheels, killed_before):
    """The installer at work, with requirements of the test's own."""
    from geofield_qgis import engine
    from geofield_qgis import install as own

    own.REQUIREMENTS = own.Path(requirements)
    settings = QgsSettings()
    for name, value in (
        ("proxyEnabled", True), ("proxyHost", "proxy.farm"), ("proxyPort", "3128"),
        ("proxyUser", "anna"), ("proxyPassword", "p@ss word"), ("proxyType", "HttpProxy"),
    ):  # fmt: skip
        settings.setValue(f"proxy/{name}", value)
    told = {"network": own.network(settings), "consent": own.consent_text()}
    settings.setValue("proxy/proxyEnabled", False)
    for number, wheel in enumerate(wheels):
        if number == killed_before:  # QGIS, in the middle of another installation
            engine.own_environment().rename(engine.own_environment().with_name("engine.before"))
            engine.own_environment().mkdir()
        installer, ends = own.Installer(wheel), []
        installer.failed.connect(ends.append)
        installer.done.connect(lambda ends=ends: ends.append("done"))
        installer.start()
        while not ends:
            QgsApplication.processEvents()
            time.sleep(0.02)
        told.setdefault("ends", []).append(ends[0])
        told.setdefault("there", []).append(engine.command_in(engine.own_environment()).is_file())
        told.setdefault("folders", []).append(
            sorted(each.name for each in engine.own_environment().parent.iterdir())
        )

    def refused(*_):
        raise PermissionError("in use")

    # As Windows does with what runs.
    rename, own.Path.rename, in_use = own.Path.rename, refused, []
    installer = own.Installer()
    installer.failed.connect(in_use.append)
    installer.start()
    own.Path.rename = rename
    found = engine.find_engine()
    own.shutil.rmtree(engine.own_environment())
    return {**told, "found": found, "in_use": in_use}


def setting(name, value):
    QgsSettings().setValue(name, value)
    return value


def several(requests):
    return [ACTIONS[request.pop("do")](**request) for request in requests]


ACTIONS = {
    "run": run,
    "shown": shown,
    "parameters": parameters,
    "model": model,
    "loaded": loaded,
    "setting": setting,
    "web_layers": web_layers,
    "install": install,
    "spoken": spoken,
    "told": told,
    "several": several,
}


def begin():
    """A QGIS with the plugin's provider, as qgis_process has it."""
    sys.path += ["/usr/share/qgis/python/plugins", os.environ["QGIS_PLUGINPATH"]]
    from processing.core.Processing import Processing

    Processing.initialize()
    from geofield_qgis import classFactory

    plugin = classFactory(None)
    plugin.initProcessing()
    return plugin


def answer(actions):
    """Do what was asked for, and tell what came of it."""
    request = json.loads(sys.argv[1])
    try:
        told = actions[request.pop("do")](**request)
    except Exception:  # noqa: BLE001 - told to the test
        traceback.print_exc()
        os._exit(1)
    print("\n@@@" + json.dumps(told))
    sys.stdout.flush()
    # Leaving QGIS tidily crashes now and then in headless processes; the answer is out.
    os._exit(0)


if __name__ == "__main__":
    QgsApplication.setPrefixPath("/usr", True)
    application = QgsApplication([], False)
    application.initQgis()
    plugin = begin()
    answer(ACTIONS)
