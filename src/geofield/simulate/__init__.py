"""Synthetic fields with known truth: believable pictures made from a seed.

A picture shows one target field among neighbours: rows and tramlines, soil patches, a track
along one side, crowns with shadows, hedges, noise and the blur of a lens. The truth is the
outline and the circle of every crown. The same seed gives the same picture everywhere.

Simulated pictures flatter every method; they are for tests, examples and controlled
comparisons, not for claims about real fields.
"""

from geofield.simulate.fields import SimulatedField, simulate_field, simulate_fields
from geofield.simulate.settings import CLIMATES, Climate, SimulationSettings

__all__ = [
    "CLIMATES",
    "Climate",
    "SimulatedField",
    "SimulationSettings",
    "simulate_field",
    "simulate_fields",
]
