"""Names that moved between QGIS 3.22 and QGIS 4, each looked up once."""

from __future__ import annotations

from typing import Any

from qgis.core import (
    QgsFeatureRequest,
    QgsProcessing,
    QgsProcessingFeatureSource,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterNumber,
)

try:  # Qt 6
    from qgis.PyQt.QtGui import QAction
except ImportError:  # Qt 5
    from qgis.PyQt.QtWidgets import QAction

__all__ = ["QAction"]


def _enum(owner: Any, scope: str, *names: str) -> Any:
    """A value of an enumeration, by the first of its names that this QGIS knows."""
    holders = [getattr(owner, scope, None), owner]
    for name in names:
        for holder in holders:
            if holder is not None and hasattr(holder, name):
                return getattr(holder, name)
    raise AttributeError(f"{owner.__name__} has none of {names}")


POLYGONS = _enum(QgsProcessing, "SourceType", "TypeVectorPolygon", "VectorPolygon")
VECTORS = _enum(QgsProcessing, "SourceType", "TypeVectorAnyGeometry", "VectorAnyGeometry")
FILES = _enum(QgsProcessing, "SourceType", "TypeFile", "File")
ADVANCED = _enum(QgsProcessingParameterDefinition, "Flag", "FlagAdvanced", "Advanced")
REAL = _enum(QgsProcessingParameterNumber, "Type", "Double")
WHOLE = _enum(QgsProcessingParameterNumber, "Type", "Integer")
STOP_AT_INVALID = _enum(
    QgsFeatureRequest, "InvalidGeometryCheck", "GeometryAbortOnInvalid", "AbortOnInvalid"
)
UNCHECKED = _enum(
    QgsProcessingFeatureSource,
    "Flag",
    "FlagSkipGeometryValidityChecks",
    "SkipGeometryValidityChecks",
)
