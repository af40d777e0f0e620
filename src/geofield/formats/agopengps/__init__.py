"""AgOpenGPS: the folder of one field."""

from geofield.formats.agopengps.read import read
from geofield.formats.agopengps.write import write

__all__ = ["read", "write"]
