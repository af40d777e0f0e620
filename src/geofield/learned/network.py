"""Networks of this package and of other folders, loaded once and run by OpenCV."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from geofield.learned.model_facts import facts, model_file, unreadable

FloatImage = NDArray[np.float32]

#: How a network is run whose file says nothing else.
ONE_STEP = {"suffix": "", "takes": [""], "gives": []}


@dataclass(frozen=True, eq=False)
class Step:
    """A file of a network: arrays go in by name, arrays come out.

    Any thread may call it: OpenCV's networks hold what runs through them, so each thread loads one
    of its own.

    Attributes
    ----------
    takes, gives : tuple of str
        The arrays' names; that of an only one is not needed.
    """

    _model: bytes = field(repr=False)
    takes: tuple[str, ...]
    gives: tuple[str, ...]
    _local: threading.local = field(default_factory=threading.local, repr=False)

    def __call__(self, *arrays: FloatImage) -> tuple[FloatImage, ...]:
        """Run the step: arrays (n, channels, rows, cols) for arrays of that kind."""
        if not hasattr(self._local, "net"):
            self._local.net = cv2.dnn.readNetFromONNX(np.frombuffer(self._model, np.uint8))
        net = self._local.net
        for name, array in zip(self.takes, arrays, strict=True):
            net.setInput(np.ascontiguousarray(array, dtype=np.float32), name)
        given = net.forward(self.gives or net.getUnconnectedOutLayersNames())
        return tuple(np.array(one, dtype=np.float32) for one in given)


@dataclass(frozen=True, eq=False)
class Network:
    """A network and what its channels mean; it travels to other processes by name and folder.

    Attributes
    ----------
    name : str
    inputs, outputs : tuple of str
        The channels' names, in the network's order.
    facts : dict
        The rest of ``NAME.json``.
    steps : tuple of Step
        What it is run in: several where what the first of them sees is asked more than once.
    folder : Path or None
        Where it lies; None in this package.
    """

    name: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    facts: dict[str, Any]
    steps: tuple[Step, ...] = field(repr=False)
    folder: Path | None = None

    def __call__(self, batch: FloatImage) -> FloatImage:
        """Run a network of one step.

        Parameters
        ----------
        batch : float32 array (n, inputs, rows, cols)

        Returns
        -------
        float32 array (n, outputs, rows, cols)
            Rows and columns of the network's own cells.

        Raises
        ------
        ValueError
            If the channels are not as many as the network's inputs.
        """
        if batch.ndim != 4 or batch.shape[1] != len(self.inputs):
            raise ValueError(
                f"{self.name} takes (n, {len(self.inputs)}, rows, cols), not {batch.shape}"
            )
        (step,) = self.steps
        return step(batch)[0]

    def stacked(self, **channels: FloatImage | float) -> FloatImage:
        """Return channels, given by name, as one batch (1, inputs, rows, cols).

        A number fills its channel.

        Raises
        ------
        ValueError
            If a channel is missing or unknown.
        """
        if set(channels) != set(self.inputs):
            raise ValueError(f"{self.name} takes {self.inputs}, not {tuple(channels)}")
        rows = np.broadcast_arrays(*(channels[name] for name in self.inputs))
        return np.stack([np.asarray(row, np.float32) for row in rows])[None]

    def named(self, batch: FloatImage) -> dict[str, FloatImage]:
        """Run the network on one picture and return its output by name, each (rows, cols)."""
        return dict(zip(self.outputs, self(batch)[0], strict=True))

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        # As it is usually asked for: then the other process has one of it, too.
        return network, (self.name,) if self.folder is None else (self.name, self.folder)


@cache
def network(name: str, folder: Path | None = None) -> Network:
    """Return a network of this package, or of another folder, by its name.

    Raises
    ------
    GeofieldError
        If there is none of that name, or its file is damaged.
    """
    known = facts(name, folder)
    try:
        steps = tuple(
            Step(
                model_file(f"{name}{one['suffix']}.onnx", folder).read_bytes(),
                tuple(one["takes"]),
                tuple(one["gives"]),
            )
            for one in known.pop("steps", [ONE_STEP])
        )
        inputs, outputs = tuple(known.pop("inputs")), tuple(known.pop("outputs"))
    except (OSError, KeyError, TypeError) as error:
        raise unreadable(name, folder) from error
    return Network(name, inputs, outputs, known, steps, folder)
