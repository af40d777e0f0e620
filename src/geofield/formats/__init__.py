"""Products: every file that geofield writes and reads, one registry for all.

A format turns a `geofield.model.Dataset` into files and back. Writers put their files into
a staging folder; :func:`write_dataset` moves them into place when all of them are whole.
"""

from geofield.formats.export import write_dataset, write_datasets
from geofield.formats.importing import read_dataset
from geofield.formats.registry import FORMATS, Drop, Format, detect, format_named
from geofield.formats.validation import Finding, validate_file

__all__ = [
    "FORMATS",
    "Drop",
    "Finding",
    "Format",
    "detect",
    "format_named",
    "read_dataset",
    "validate_file",
    "write_dataset",
    "write_datasets",
]
