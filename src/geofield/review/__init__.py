"""Review: a person's corrections of a plan, on a page in the browser.

What comes in is a plan (a GeoPackage) and the picture beside it; what goes out is the same
GeoPackage with the person's word in it. Begin reading at `commands` (edits, pure functions of
a plan), then `session` (undo, redo, tracks that follow), `journal` (nothing is lost when the
program is killed), `desk` (what the page may ask for) and `shown` (a session as it sees it), and
last `server` and `guard` (this machine only). The page itself is `page/`: plain modules, no build
step; the map is drawn by OpenLayers, which lies there with its licence.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from geofield.late import late_names

if TYPE_CHECKING:
    from geofield.review.commands import apply_command
    from geofield.review.session import Session

__all__ = ["Session", "apply_command"]

# The server answers before tables and geometry are there.
__getattr__ = late_names(__name__, {"session": "Session", "commands": "apply_command"})
