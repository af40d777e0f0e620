"""Whether a style or project is as geofield wrote it, or a person saved it again.

QGIS writes the whole document anew: the digest at its end is gone then. After an edit by hand it is
another one.
"""

from __future__ import annotations

import hashlib
import io
import zipfile

_MARK = "<!-- geofield {} -->\n"


def marked(document: str) -> str:
    """A QML file or project with its digest as a comment at its end."""
    return document + _MARK.format(hashlib.sha256(document.encode()).hexdigest())


def is_as_written(document: str | None) -> bool:
    """Whether geofield wrote a QML file or project, and nobody else since."""
    text = document or ""
    body = text[: text.rfind("<!-- geofield ")]
    # Earlier versions wrote no digest, and all elements in one line, as QGIS never does.
    return text == marked(body) or text.count("\n") == len(text.splitlines()) == 2


def is_project_as_written(qgz: bytes) -> bool:
    """The same of a ``.qgz``."""
    try:
        with zipfile.ZipFile(io.BytesIO(qgz)) as archive:
            (name,) = archive.namelist()
            return is_as_written(archive.read(name).decode())
    except (ValueError, zipfile.BadZipFile):
        return False
