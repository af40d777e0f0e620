"""What was learned: networks and tables beside the names of what goes in and comes out.

A model is ``NAME.json`` of this folder: what goes in by name, the figures that belong to it
(curves, calibration, thresholds), and what it was learned with (data, seed, versions). Where it is
a network, ``NAME.onnx`` lies beside it, which OpenCV runs; what is asked of what that saw is in
``NAME_points.onnx``. Trainers are in ``tools/``. Begin with `network` and `facts`.
"""

from geofield.learned.model_facts import facts
from geofield.learned.network import Network, network

__all__ = ["Network", "facts", "network"]
