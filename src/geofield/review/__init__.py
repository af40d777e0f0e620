"""Review: a person's corrections of a plan, on a page in the browser.

What comes in is a plan (a GeoPackage) and the picture beside it; what goes out is the same
GeoPackage with the person's word in it. Begin reading at `commands` (edits, pure functions of
a plan), then `session` (undo, redo, tracks that follow), `journal` (nothing is lost when the
program is killed), `view` (a plan as the page sees it), `picture` (tiles), and last `server` and
`guard` (this machine only). The page itself is `page/`: plain modules, no build step; the map
is drawn by OpenLayers, which lies there with its licence.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from geofield.review.commands import apply_command
    from geofield.review.session import Session

__all__ = ["Session", "apply_command"]

#: Loaded when first used: the server answers before tables and geometry are there.
_LATE = {"Session": "session", "apply_command": "commands"}


def __getattr__(name: str) -> Any:
    if name not in _LATE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LATE[name]}"), name)
