"""Detected obstacles against a truth: matching, figures, pictures."""

from geofield.evaluation.driving import Driving, driving, unseen
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
    "Driving",
    "Evaluation",
    "Matches",
    "Score",
    "draw_matches",
    "draw_reliability",
    "driving",
    "evaluate",
    "match_points",
    "read_obstacles",
    "reliability",
    "unseen",
]
