"""What was learned: networks and tables beside the names of what goes in and comes out.

A model is two files of this folder: ``NAME.onnx``, a network that OpenCV runs, and
``NAME.json``, which names its input and output channels and carries the figures that belong to
it (calibration, thresholds, what it was trained on). Trainers are in ``tools/``. Begin with
`network`.
"""

from geofield.learned.network import Network, network

__all__ = ["Network", "network"]
