"""Stage 3: trees and other obstacles in a field."""

from geofield.model.circles import Circles
from geofield.obstacles.detect import detect_obstacles

__all__ = ["Circles", "detect_obstacles"]
