"""Detected obstacles against a truth: matching, figures, pictures."""

from geofield.evaluation.compare import Evaluation, evaluate
from geofield.evaluation.driving import Driving, driving, unseen
from geofield.evaluation.matching import Matches, match_points
from geofield.evaluation.picture import draw_matches, placed, read_obstacles
from geofield.evaluation.scores import Score, reliability

__all__ = [
    "Driving",
    "Evaluation",
    "Matches",
    "Score",
    "draw_matches",
    "driving",
    "evaluate",
    "match_points",
    "placed",
    "read_obstacles",
    "reliability",
    "unseen",
]
