"""The plugin's files with PyQt6 in the place of `qgis.PyQt`; run by Debian's Python.

QGIS itself is built for one Qt, so its own classes are stand-ins here: what is tried is all that
the plugin asks of Qt. The argument is JSON with `plugins`, `requirements`, `folder` and
`old`, a source for Qt 5 alone; the last line
of the output is the answer.
"""

import ast
import importlib
import importlib.abc
import importlib.machinery
import json
import sys
import types
from pathlib import Path

from PyQt6 import QtCore, QtWidgets

ASKED = json.loads(sys.argv[1])
sys.path.insert(0, ASKED["plugins"])
PLUGIN = Path(ASKED["plugins"]) / "geofield_qgis"


class Stand(type):
    """A class of QGIS: whatever is asked of it is another one."""

    def __getattr__(cls, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return stand(name)


def stand(name):
    return Stand(
        name,
        (),
        {
            "__init__": lambda self, *given, **named: None,
            "__getattr__": lambda self, asked: getattr(type(self), asked),
        },
    )


#: Those of QGIS that are classes of Qt to the plugin.
OF_QT = {
    "QgsSettings": QtCore.QSettings,
    "QgsMapTool": QtCore.QObject,
    "QgsProcessingProvider": QtCore.QObject,
}


class Modules(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """`qgis.PyQt` is PyQt6, the rest of `qgis` stand-ins."""

    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] not in ("qgis", "processing"):
            return None
        return importlib.machinery.ModuleSpec(name, self, is_package=True)

    def create_module(self, spec):
        if spec.name.startswith("qgis.PyQt."):
            return importlib.import_module(spec.name.replace("qgis.PyQt", "PyQt6"))
        module = types.ModuleType(spec.name)
        module.__path__ = []
        if spec.name not in ("qgis", "qgis.PyQt"):
            module.__getattr__ = lambda name: OF_QT.get(name) or stand(name)
        return module

    def exec_module(self, module):
        pass


sys.meta_path.insert(0, Modules())


def chains(tree):
    """Every dotted name that begins with something imported from Qt, with that thing's module."""
    imported = {
        (alias.asname or alias.name): (node.module.replace("qgis.PyQt", "PyQt6"), alias.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("qgis.PyQt.")
        for alias in node.names
    }
    for node in ast.walk(tree):
        names, inner = [], node
        while isinstance(inner, ast.Attribute):
            names.insert(0, inner.attr)
            inner = inner.value
        if names and isinstance(inner, ast.Name) and inner.id in imported:
            yield *imported[inner.id], names


def unknown(sources):
    """What sources ask of a class of Qt by name, and Qt 6 does not have; how much they ask."""
    missing, count = [], 0
    for file, text in sources.items():
        for module, owner, names in chains(ast.parse(text)):
            count += 1
            value = getattr(importlib.import_module(module), owner, None)
            if value is None:
                continue  # compat.py tries the place of Qt 5
            for name in names:
                if not hasattr(value, name):
                    missing.append(f"{file}: {owner}.{'.'.join(names)}")
                    break
                value = getattr(value, name)
    return missing, count


def at_work():
    """The dialogue of the engine, an installation, a command and its progress, under Qt 6."""
    from geofield_qgis import engine, engine_dialog, install, jobs

    application = QtWidgets.QApplication(sys.argv[:1])
    application.setOrganizationName("QGIS")
    told = {"qt": QtCore.qVersion()}
    engine.own_environment = lambda: Path(ASKED["folder"]) / "own" / "engine"
    install.REQUIREMENTS = Path(ASKED["requirements"])
    dialog, ready, said = engine_dialog.EngineDialog(None), [], []
    dialog.ready.connect(lambda: ready.append(True))
    told["before"] = dialog.state.text()
    dialog.show()
    dialog.buttons["install"].click()
    wait(application, lambda: ready or dialog.buttons["install"].isEnabled())
    told["after"], told["log"] = dialog.state.text(), dialog.log.toPlainText()
    dialog.close()
    job, ends = jobs.Job(["count"], {}, dialog), []
    job.progressed.connect(lambda done, total, what: said.append([done, total, what]))
    job.done.connect(lambda result: ends.append(result.data))
    job.failed.connect(ends.append)
    wait(application, lambda: ends)
    failing, why = jobs.Job(["fail"], {}, dialog), []
    failing.failed.connect(why.append)
    wait(application, lambda: why)
    return {**told, "progress": said, "end": ends[0], "why": why[0]}


def wait(application, true):
    timer = QtCore.QElapsedTimer()
    timer.start()
    while not true():
        if timer.elapsed() > 60_000:
            raise TimeoutError
        application.processEvents(QtCore.QEventLoop.ProcessEventsFlag.AllEvents, 50)


imported = [
    importlib.import_module(f"geofield_qgis.{file.stem}").__name__
    for file in sorted(PLUGIN.glob("*.py"))
    if file.stem != "__init__"
]
missing, asked = unknown({each.name: each.read_text("utf-8") for each in PLUGIN.glob("*.py")})
answer = {
    "imported": imported,
    "missing": missing,
    "asked": asked,
    "of_old": unknown({"old.py": ASKED["old"]})[0],
    "work": at_work(),
}
sys.stdout.write(json.dumps(answer) + "\n")
