"""ISOXML (ISO 11783-10): task data of farm terminals, versions 3 and 4."""

from geofield.formats.isoxml.read import read, several
from geofield.formats.isoxml.write import write_v3, write_v4

__all__ = ["read", "several", "write_v3", "write_v4"]
