"""Stage 3: trees and other obstacles in a field."""

from geofield.obstacles.detect import detect_obstacles

__all__ = ["detect_obstacles"]
