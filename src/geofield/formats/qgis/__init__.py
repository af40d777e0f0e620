"""QGIS: styles and a project that a person can work with at once."""

from geofield.formats.qgis.project import project_xml, qgz_bytes
from geofield.formats.qgis.store import add_project, add_styles

__all__ = ["add_project", "add_styles", "project_xml", "qgz_bytes"]
