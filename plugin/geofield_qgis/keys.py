"""The panel's keys: they work where the hands are, on the map and in the panel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Callable

from qgis.PyQt.QtCore import QEvent, QObject, Qt
from qgis.PyQt.QtWidgets import QWidget


class Keys(QObject):
    """Letters and signs that do something on the map and in a panel.

    A key that QGIS has a shortcut for as well is the panel's there. Qt itself does nothing where
    two shortcuts have one key; in German QGIS has J, R and U.

    Parameters
    ----------
    panel, canvas
        Where the keys work.
    actions : mapping
        What each key does.
    awake
        Whether they do it now.
    """

    def __init__(
        self,
        panel: QWidget,
        canvas: QWidget,
        actions: Mapping[str, Callable[[], Any]],
        awake: Callable[[], bool],
    ) -> None:
        super().__init__(panel)
        self._places, self._actions, self._awake = (canvas, panel), actions, awake
        for place in self._places:
            place.installEventFilter(self)

    def remove(self) -> None:
        """Have them no more."""
        for place in self._places:
            place.removeEventFilter(self)

    def eventFilter(self, watched: Any, event: Any) -> bool:
        """Take a key before QGIS does."""
        if event.type() in (QEvent.Type.ShortcutOverride, QEvent.Type.KeyPress):
            action = self._actions.get(_pressed(event))
            if action is not None and self._awake():
                event.accept()
                if event.type() == QEvent.Type.KeyPress:
                    action()
                return True
        return False


def _pressed(event: Any) -> str:
    """A key as it is written on a button; Shift makes some signs, and no letter another one."""
    text, held = event.text().upper(), event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
    if not text.isalpha():
        held &= ~Qt.KeyboardModifier.ShiftModifier
    return text if held == Qt.KeyboardModifier.NoModifier else ""
