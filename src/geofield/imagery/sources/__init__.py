"""Imagery sources: servers, files, folders."""

from geofield.imagery.sources.base import PictureSource, Source, TileSource
from geofield.imagery.sources.catalogue import BUILTIN, SourceEntry
from geofield.imagery.sources.registry import find_source

__all__ = [
    "BUILTIN",
    "PictureSource",
    "Source",
    "SourceEntry",
    "TileSource",
    "find_source",
]
