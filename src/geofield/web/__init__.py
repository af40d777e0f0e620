"""What pages in a browser share: OpenLayers, symbols, words. Read as text, never run here.

`page_file` gives one file; `inlined` makes one script of several modules, for a page that is a
single file and needs no server.
"""

from __future__ import annotations

import re
from importlib import resources

_IMPORT = re.compile(r"^import [^;]*;\n", re.MULTILINE)
_EXPORT = re.compile(r"^export ", re.MULTILINE)


def page_file(name: str) -> bytes:
    """The bytes of a file of this folder, such as ``vendor/ol.js``."""
    return resources.files(__name__).joinpath(*name.split("/")).read_bytes()


def inlined(*names: str) -> str:
    """Modules that import each other as one script, in the order given."""
    parts = (page_file(name).decode() for name in names)
    return "\n".join(_EXPORT.sub("", _IMPORT.sub("", part)) for part in parts)
