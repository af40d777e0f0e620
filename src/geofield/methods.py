"""Methods by name: where the code of each lies.

A stage looks the method that was asked for up here and loads its module only then. So the
stages know the study's methods by name and do not lean on them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pkgutil import resolve_name
from types import MappingProxyType
from typing import Any, Literal, get_args

_STUDY_DETECTORS = "geofield.study.detectors:detect_by_study"

FIELD: Mapping[str, str] = MappingProxyType(
    {
        "auto": "geofield.field.auto:segment",
        "study": "geofield.study.threshold:segment",
    }
)
"""Each takes (scene, x_px, y_px) and returns a `Segmentation`; of auto also `include`, `exclude`
and `search`, of the study also `regions`."""

Strategy = Literal[
    "auto",
    "single",
    "t_range",
    "max_of_all",
    "dlc",
    "consensus",
    "study_text",
    "study_listing",
    "study_dlc",
]
"""Ways to find obstacles: geofield's own, then the study's."""

STUDY_STRATEGIES: Mapping[str, str] = MappingProxyType(
    dict.fromkeys(get_args(Strategy)[1:], _STUDY_DETECTORS)
)
"""Each takes (scene, region, strategy, radius_px, options, progress)."""

LONGEST_EDGE: Mapping[str, str] = MappingProxyType({"hough": "geofield.study.hough:hough_edge"})
"""Each takes a polygon and returns the line of its longest edge, the field to its left."""


def method(methods: Mapping[str, str], name: str) -> Callable[..., Any]:
    """Load the method of a name."""
    found: Callable[..., Any] = resolve_name(methods[name])
    return found
