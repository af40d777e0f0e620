"""Detected obstacles against a truth: matching, figures, pictures."""

from geofield.evaluation.matching import (
    Evaluation,
    Matches,
    Score,
    evaluate,
    match_points,
    reliability,
)
from geofield.evaluation.picture import draw_matches, draw_reliability, read_obstacles

__all__ = [
    "Evaluation",
    "Matches",
    "Score",
    "draw_matches",
    "draw_reliability",
    "evaluate",
    "match_points",
    "read_obstacles",
    "reliability",
]
