"""The panel's keys: they work where the hands are, on the map and in the panel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Callable

from qgis.PyQt.QtCore import QEvent, QObject, Qt
from qgis.PyQt.QtGui import QKeySequence
from qgis.PyQt.QtWidgets import QWidget

#: QGIS's own keys for the layer that is active.
UNDO, REDO = "undo", "redo"
_STANDARD = {UNDO: QKeySequence.StandardKey.Undo, REDO: QKeySequence.StandardKey.Redo}
#: Keys that go on while they are held; a decision is one press.
_ON_AND_ON = ("J", "K", "+", "-")


def written(key: str) -> str:
    """A key as it stands on a button, in the person's language."""
    native = QKeySequence.SequenceFormat.NativeText
    return QKeySequence(_STANDARD.get(key, key)).toString(native)


class Keys(QObject):
    """Letters and signs that do something on the map and in a panel.

    A key that QGIS has a shortcut for as well is the panel's there. Qt itself does nothing where
    two shortcuts have one key; in German QGIS has J, R and U.

    Parameters
    ----------
    panel, canvas
        Where the keys work.
    actions : mapping
        What each key does: a letter, a sign, `UNDO` or `REDO`.
    is_ours
        Whether a key does it now.
    """

    def __init__(
        self,
        panel: QWidget,
        canvas: QWidget,
        actions: Mapping[str, Callable[[], Any]],
        is_ours: Callable[[str], bool],
    ) -> None:
        super().__init__(panel)
        self._places, self._actions, self._is_ours = (canvas, panel), actions, is_ours
        for place in self._places:
            place.installEventFilter(self)

    def remove(self) -> None:
        """Have them no more."""
        for place in self._places:
            place.removeEventFilter(self)

    def eventFilter(self, watched: Any, event: Any) -> bool:
        """Take a key before QGIS does."""
        if event.type() in (QEvent.Type.ShortcutOverride, QEvent.Type.KeyPress):
            key = _pressed(event)
            action = self._actions.get(key)
            if action is not None and self._is_ours(key):
                event.accept()
                held = event.isAutoRepeat() and key not in _ON_AND_ON
                if event.type() == QEvent.Type.KeyPress and not held:
                    action()
                return True
        return False


def _pressed(event: Any) -> str:
    """The name of a key; Shift makes some signs, and no letter another one."""
    for key, standard in _STANDARD.items():
        if event.matches(standard):
            return key
    text, held = event.text().upper(), event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
    if not text.isalpha():
        held &= ~Qt.KeyboardModifier.ShiftModifier
    return text if held == Qt.KeyboardModifier.NoModifier else ""
