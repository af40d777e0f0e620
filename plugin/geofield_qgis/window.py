"""What the plugin adds to the window: a toolbar, a menu, a map tool and a panel."""

from __future__ import annotations

from html import escape
from typing import Any, Callable

from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import QPushButton

from .algorithm import ICONS
from .compat import QAction
from .dock import ReviewDock
from .engine_dialog import EngineDialog
from .map_tools import PointTool
from .planner import Planner
from .words import tr

MENU = "geofield"


class Window:
    """The plugin's part of the window; :meth:`close` takes all of it away.

    Parameters
    ----------
    iface
        QGIS's window.
    """

    def __init__(self, iface: Any) -> None:
        self.iface = iface
        self._actions: list[QAction] = []
        self.toolbar = iface.addToolBar("geofield")
        self.toolbar.setObjectName("geofield_toolbar")
        self.planner = Planner(iface)
        self.tool = PointTool(iface.mapCanvas(), self.planner.click, self.planner.clear)
        self.dock = ReviewDock(iface)
        iface.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, self.dock)
        self.dock.hide()
        self.plan = self._action(
            "plan.svg", tr("Plan the field here"), self._take_tool, checkable=True
        )
        self.plan.setWhatsThis(
            tr("Click in a field. Shift+click adds ground, Alt+click takes it away.")
        )
        self.tool.setAction(self.plan)
        self.panel = self._action("review.svg", tr("Review obstacles"), self.show_review)
        self.engine = self._action("", tr("Engine..."), self.show_engine)
        self.dialog: EngineDialog | None = None
        self.planner.finished.connect(self._planned)
        self.planner.engine_missing.connect(self._offer_engine)
        self.tool.deactivated.connect(self.planner.awake.sleep)

    def close(self) -> None:
        """Leave the window as it was before."""
        self.planner.remove()
        self.iface.mapCanvas().unsetMapTool(self.tool)
        self.dock.remove()
        if self.dialog is not None:
            self.dialog.reject()
            self.dialog.deleteLater()
        for action in self._actions:
            self.iface.removePluginMenu(MENU, action)
            self.toolbar.removeAction(action)
            action.deleteLater()
        self._actions = []
        self.iface.mainWindow().removeToolBar(self.toolbar)
        self.toolbar.deleteLater()
        self.planner.deleteLater()

    def show_review(self, path: str = "") -> None:
        """Show the panel with a plan."""
        self.dock.show()
        self.dock.raise_()
        self.dock.open(path if isinstance(path, str) else "")

    def show_engine(self) -> None:
        """Show the dialogue of the engine."""
        if self.dialog is None:
            self.dialog = EngineDialog(self.iface.mainWindow())
            self.dialog.ready.connect(self._engine_is_there)
        self.dialog.tell()
        self.dialog.show()
        self.dialog.raise_()

    def _take_tool(self) -> None:
        self.iface.mapCanvas().setMapTool(self.tool)
        self.planner.awake.wake()

    def _offer_engine(self, why: str) -> None:
        """Say what is missing, with the way to it."""
        messages = self.iface.messageBar()
        item = messages.createMessage("geofield", escape(why))
        button = QPushButton(tr("Engine..."))
        button.clicked.connect(lambda *_: (messages.popWidget(item), self.show_engine()))
        item.layout().addWidget(button)
        messages.pushWidget(item)

    def _engine_is_there(self) -> None:
        """Go on where a click waits for the engine."""
        if self.planner.waits:
            self.dialog.accept()
            self.planner.go_on()

    def _planned(self, path: str) -> None:
        self.show_review(path)

    def _action(
        self, icon: str, text: str, slot: Callable[[], None], *, checkable: bool = False
    ) -> QAction:
        picture = QIcon(str(ICONS / icon)) if icon else QIcon(str(ICONS / "geofield.svg"))
        action = QAction(picture, text, self.iface.mainWindow())
        action.setCheckable(checkable)
        action.triggered.connect(lambda *_: slot())
        self.iface.addPluginToMenu(MENU, action)
        if icon:
            self.toolbar.addAction(action)
        self._actions.append(action)
        return action
