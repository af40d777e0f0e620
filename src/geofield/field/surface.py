"""Surface: the picture in which outlines are searched, and what is asked of it again and again."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from geofield.field.frame import Frame, covered
from geofield.field.regions import Partition

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Surface:
    """The picture that outlines are measured on.

    Attributes
    ----------
    stack : float32 array (channels, rows, columns)
        Whitened channels, small things painted over.
    parted : Partition
        Of that stack.
    things : bool array (rows, columns)
        What was painted over.
    frame : Frame
        Where it ends.
    """

    stack: NDArray[np.float32]
    parted: Partition
    things: BoolArray
    frame: Frame

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.frame.shape

    @cached_property
    def layers(self) -> NDArray[np.float32]:
        """The channels last, as OpenCV reads them, with roughness as one more."""
        import cv2

        rough = np.zeros(self.shape, np.float32)
        for layer in self.stack:
            rough += np.square(layer - cv2.GaussianBlur(layer, (0, 0), 2.0))
        rough = np.sqrt(cv2.GaussianBlur(rough, (0, 0), 2.0))
        return np.ascontiguousarray(np.moveaxis(np.stack([*self.stack, rough]), 0, -1))

    @cached_property
    def size_px(self) -> FloatArray:
        """Pixels in each superpixel."""
        return self.parted.tree.size_px[: self.parted.tree.leaf_count]

    @cached_property
    def centres(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Row and column of each superpixel's centre."""
        labels = self.parted.labels
        count = self.parted.tree.leaf_count
        rows, columns = (
            np.bincount(labels.ravel(), index.ravel(), count) / self.size_px
            for index in np.indices(labels.shape)
        )
        return np.rint(rows).astype(np.intp), np.rint(columns).astype(np.intp)

    @cached_property
    def means(self) -> FloatArray:
        """Mean of each channel in each superpixel, (channels, superpixels)."""
        labels = self.parted.labels.ravel()
        count = self.parted.tree.leaf_count
        return np.stack(
            [np.bincount(labels, layer.ravel(), count) / self.size_px for layer in self.stack]
        )

    @cached_property
    def neighbours(self) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]:
        """Pairs of neighbouring superpixels and their strengths, the weakest pair first."""
        first, second, _, strength = self.parted.pairs
        order = np.argsort(strength)
        return first[order], second[order], strength[order]

    def members(self, vertices: FloatArray) -> BoolArray:
        """The superpixels with their centres in a polygon, given by its vertices (n, 2)."""
        rows, columns = self.centres
        return np.asarray(covered(vertices, self.shape)[rows, columns] > 0)
