"""QGIS: styles and a project that a person can work with at once."""

from geofield.formats.qgis.as_written import is_as_written, is_project_as_written
from geofield.formats.qgis.project import project_xml, qgz_bytes
from geofield.formats.qgis.store import add_project, add_styles

__all__ = [
    "add_project",
    "add_styles",
    "is_as_written",
    "is_project_as_written",
    "project_xml",
    "qgz_bytes",
]
