"""Stage 3: trees and other obstacles in a field."""

from geofield.obstacles.circles import Circles
from geofield.obstacles.detect import detect_obstacles
from geofield.obstacles.edges import EDGE_METHODS, EdgeScan, edge_map
from geofield.obstacles.phase_code import find_circles
from geofield.obstacles.strategies import EdgeCircles, StrategyResult, run_strategy

__all__ = [
    "EDGE_METHODS",
    "Circles",
    "EdgeCircles",
    "EdgeScan",
    "StrategyResult",
    "detect_obstacles",
    "edge_map",
    "find_circles",
    "run_strategy",
]
