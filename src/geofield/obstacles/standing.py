"""What stands in a field beside single trees: walls, huts, trucks, heaps, ponds, hedges, copses.

The network says of each cell whether something stands there, and whether it is under a crown. Cells
that hang together become one polygon, as probable as its clearest cells; what the trees explain is
left to them.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from skimage.filters import apply_hysteresis_threshold

from geofield.model.circles import Circles
from geofield.obstacles.crowns import CELL_PX
from geofield.obstacles.picture import WORKING_RESOLUTION_M
from geofield.raster import Image

MAX_CELLS = 100e6
"""Larger fields are searched for trees alone, for their cells would not fit into memory."""
RIM = 0.5
"""A thing reaches as far as its cells are at least this share of its clearest ones."""
CANOPY, LEAST_CANOPY_CELLS = 0.5, 4
"""What is a crown more likely than not, and reaches so many cells beyond all trees, stands there,
too."""
BORDER_M, DEEP_M = 3.0, 9.0
"""What begins so near to the field's border and ends so near is the border: a road's edge, a ditch,
the neighbour's wall."""
_EXPLAINED, _CROWN_REACH = 0.5, 1.2
"""Of a thing's cells within so many radii of a tree: then it is the tree, or its shade."""
_CLEAR_CELLS = 8
_ALL_AROUND = np.ones((3, 3), bool)
_NECK_CELLS = 0.02
"""So far cells that meet at a corner alone are grown, to be one polygon when files round, too."""
CELL_M = CELL_PX * WORKING_RESOLUTION_M


@dataclass(slots=True)
class StandingMap:
    """How probable it is that something stands in each cell (0..255), filled window by window.

    Attributes
    ----------
    cells : uint8 array (rows, cols)
        Of what is no tree.
    canopy : uint8 array (rows, cols)
        Of crowns.
    col, row : int
        Of its first cell, counted in cells from the picture's corner.
    """

    cells: NDArray[np.uint8]
    canopy: NDArray[np.uint8]
    col: int
    row: int

    @classmethod
    def over(cls, left: float, top: float, right: float, bottom: float) -> StandingMap | None:
        """Return an empty map of an area (working pixels), None where it would be too large."""
        c0, r0 = int(left // CELL_PX), int(top // CELL_PX)
        shape = (int(bottom // CELL_PX) + 1 - r0, int(right // CELL_PX) + 1 - c0)
        if shape[0] * shape[1] > MAX_CELLS:
            return None
        return cls(np.zeros(shape, np.uint8), np.zeros(shape, np.uint8), c0, r0)

    def fill(self, named: dict[str, Image], region: NDArray[np.bool_], col: int, row: int) -> None:
        """Enter a window's answers where its region is, its first cell at (col, row)."""
        c0, r0 = max(self.col - col, 0), max(self.row - row, 0)
        c1 = min(self.col + self.cells.shape[1] - col, region.shape[1])
        r1 = min(self.row + self.cells.shape[0] - row, region.shape[0])
        if c0 >= c1 or r0 >= r1:
            return
        part = np.s_[row + r0 - self.row : row + r1 - self.row,
                     col + c0 - self.col : col + c1 - self.col]  # fmt: skip
        here = np.s_[r0:r1, c0:c1]
        for cells, answer in ((self.cells, named["other"]), (self.canopy, named["cover"])):
            values = np.where(region[here], np.rint(255 * answer[here]), 0).astype(np.uint8)
            # Regions do not overlap; elsewhere a window has nothing to say.
            np.maximum(cells[part], values, out=cells[part])

    def things(
        self, field: shapely.Polygon, trees: Circles, least: float
    ) -> tuple[list[shapely.Polygon], list[float]]:
        """Return what stands there beside the trees, and how probable each is.

        Parameters
        ----------
        field : Polygon
            Its outer ring, working pixels; along it there is its border.
        trees : Circles
            Working pixels.
        least : float
            Least probability of a thing, before it is calibrated.

        Returns
        -------
        polygons : list of Polygon
            Working pixels from the corner of the picture.
        probabilities : list of float
        """
        known = self._discs(trees, _CROWN_REACH)
        beyond = self._canopy_beyond(self._discs(trees, 1.0), known)
        p = np.maximum(self.cells, np.where(beyond, self.canopy, 0)).astype(np.float32) / 255
        mask = apply_hysteresis_threshold(p, RIM * least, least)
        labels, count = ndimage.label(mask, structure=_ALL_AROUND)
        if not count:
            return [], []
        known &= ~beyond
        depth = self._depth(field)
        polygons, probabilities = [], []
        for number, where in enumerate(ndimage.find_objects(labels), start=1):
            part = labels[where] == number
            if float(known[where][part].mean()) >= _EXPLAINED:
                continue
            deep = depth[where][part]
            if deep.min() * CELL_M <= BORDER_M and deep.max() * CELL_M <= DEEP_M:
                continue
            clearest = np.sort(p[where][part])[-_CLEAR_CELLS:]
            thing = part & (p[where] >= RIM * float(clearest.mean()))
            outline = _outline(np.pad(thing, 1))
            place = np.array([where[1].start - 1 + self.col, where[0].start - 1 + self.row])
            corners = shapely.get_coordinates(outline)
            polygons.append(shapely.Polygon((corners + place) * CELL_PX))
            probabilities.append(float(clearest.mean()))
        return polygons, probabilities

    def _canopy_beyond(
        self, crowns: NDArray[np.bool_], near: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Return canopy outside of crowns that reaches farther: hedges, copses, odd crowns."""
        beyond = (self.canopy >= CANOPY * 255) & ~crowns
        parts, count = ndimage.label(beyond, structure=_ALL_AROUND)
        wide = np.bincount(parts[~near], minlength=count + 1) >= LEAST_CANOPY_CELLS
        wide[0] = False
        return np.asarray(wide[parts], dtype=bool)

    def _depth(self, field: shapely.Polygon) -> Image:
        """Return how many cells each lies inside the field."""
        ring = shapely.get_coordinates(field.exterior) / CELL_PX - [self.col, self.row]
        inside = np.zeros(np.add(self.cells.shape, 2), np.uint8)
        cv2.fillPoly(inside, [np.rint(ring * 16 + 8).astype(np.int32)], 1, cv2.LINE_8, 4)
        depth = cv2.distanceTransform(inside, cv2.DIST_L2, 5)[1:-1, 1:-1]
        return np.asarray(depth, dtype=np.float32)

    def _discs(self, trees: Circles, radii: float) -> NDArray[np.bool_]:
        mask = np.zeros(self.cells.shape, np.uint8)
        for x, y, radius in zip(trees.x_px, trees.y_px, trees.radius_px, strict=True):
            # A sixteenth of a cell is what OpenCV can place.
            centre = [
                round(16 * (v / CELL_PX - o - 0.5)) for v, o in ((x, self.col), (y, self.row))
            ]
            reach = round(16 * radii * radius / CELL_PX)
            cv2.circle(mask, centre, reach, 1, -1, cv2.LINE_8, 4)
        return mask.astype(bool)


def _outline(part: NDArray[np.bool_]) -> shapely.Polygon:
    """Return the outline of one region of cells, holes filled, its stairs smoothed away."""
    from rasterio.features import shapes

    filled = ndimage.binary_fill_holes(part).astype(np.uint8)
    rings = [
        shapely.Polygon(shape["coordinates"][0])
        for shape, _ in shapes(filled, mask=filled.astype(bool), connectivity=8)
    ]
    largest = max(rings, key=lambda ring: ring.area)
    # Where cells meet at a corner alone, the ring touches itself: no polygon without a neck.
    neck_cells = 0.0 if largest.is_valid else _NECK_CELLS
    joined = largest.buffer(neck_cells, join_style="mitre")
    simple: shapely.Polygon = shapely.simplify(joined, 0.75)
    return simple
