"""What a driver loses: things that tracks run into, ground given up for nothing.

Precision and recall count every detection alike. A driver does not: a tree under the wheels
ends the day, a false alarm costs a detour.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray

from geofield.crs import ground_areas_m2, ground_lengths_m, ground_scale_of
from geofield.model.obstacles import active

if TYPE_CHECKING:
    import geopandas as gpd

DEFAULT_REACH_M = 2.0
"""A wheel this near to a trunk is in its crown."""
#: The chords of a disc of so many sides are .03 % short, of the usual 32 sides 1 %.
_QUARTER_SEGMENTS = 32


@dataclass(frozen=True, slots=True)
class Driving:
    """What a driver loses in one field, or in several added up.

    Attributes
    ----------
    things : int
        True things in the field.
    driven_through : int
        Those that a track comes nearer to than the reach.
    driven_through_m, driven_m : float
        Metres of track within the reach of true things, and all metres.
    field_m2, lost_m2 : float
        Area of the field, and what of it is given up for obstacles at which nothing stands.
    expected_unseen : float
        Things that the confidences say stand among what is merely possible.
    """

    things: int = 0
    driven_through: int = 0
    driven_through_m: float = 0.0
    driven_m: float = 0.0
    field_m2: float = 0.0
    lost_m2: float = 0.0
    expected_unseen: float = 0.0

    def __add__(self, other: Driving) -> Driving:
        mine, theirs = asdict(self), asdict(other)
        return Driving(**{name: mine[name] + theirs[name] for name in mine})

    @property
    def share_driven_through(self) -> float:
        """Of the true things; NaN where there are none."""
        return self.driven_through / self.things if self.things else float("nan")

    @property
    def share_lost(self) -> float:
        """Of the field's area."""
        return self.lost_m2 / self.field_m2 if self.field_m2 else float("nan")

    @property
    def expected_unseen_per_ha(self) -> float:
        """Things per hectare."""
        return self.expected_unseen / self.field_m2 * 1e4 if self.field_m2 else float("nan")

    def as_dict(self) -> dict[str, Any]:
        """Return plain values, NaN as None."""
        values = asdict(self)
        for name in ("share_driven_through", "share_lost", "expected_unseen_per_ha"):
            value = getattr(self, name)
            values[name] = float(value) if np.isfinite(value) else None
        return values


def driving(
    segments: gpd.GeoDataFrame,
    obstacles: gpd.GeoDataFrame,
    truth: gpd.GeoDataFrame,
    field: shapely.Geometry,
    *,
    reach_m: float = DEFAULT_REACH_M,
) -> Driving:
    """Return what a driver loses.

    Parameters
    ----------
    segments : GeoDataFrame
        The lines that are driven (`Tracks.segments`), in metres.
    obstacles : GeoDataFrame
        What they were planned around, possible and rejected rows included.
    truth : GeoDataFrame
        Points or polygons of what stands there.
    field : Polygon or MultiPolygon
        In the CRS of the segments. Truth outside is not counted, yet ground inside that is
        kept free of its crown is not lost for nothing.
    reach_m : float
        How near to a true centre a track may not come.
    """
    crs = segments.crs
    lines = segments.geometry.to_numpy()
    centres = shapely.centroid(truth.to_crs(crs).geometry.to_numpy())
    reach = reach_m * float(ground_scale_of(field, crs))
    all_discs = shapely.buffer(centres, reach, quad_segs=_QUARTER_SEGMENTS)
    here = shapely.covers(field, centres)
    discs = all_discs[here]
    tree = shapely.STRtree(lines)
    met = np.unique(tree.query(centres[here], predicate="dwithin", distance=reach)[0])
    inside = shapely.intersection(shapely.union_all(lines), shapely.union_all(discs[met]))
    table = obstacles.to_crs(crs)
    avoided = active(table)
    return Driving(
        len(discs),
        len(met),
        float(ground_lengths_m(inside, crs)),
        float(ground_lengths_m(lines, crs).sum()),
        float(ground_areas_m2(field, crs)),
        float(ground_areas_m2(_given_up(avoided.geometry.to_numpy(), all_discs, field), crs)),
        unseen(table, field),
    )


def unseen(obstacles: gpd.GeoDataFrame, field: shapely.Geometry) -> float:
    """Return how many things the confidences say stand in a field and are not driven around."""
    if not {"status", "confidence"} <= set(obstacles.columns):
        return 0.0
    possible = obstacles[obstacles["status"] == "possible"]
    centres = shapely.centroid(possible.geometry.to_numpy())
    confidence = possible["confidence"].to_numpy(dtype="float64", na_value=0.0)
    return float(confidence[shapely.covers(field, centres)].sum())


def _given_up(
    footprints: NDArray[np.object_], discs: NDArray[np.object_], field: shapely.Geometry
) -> shapely.Geometry:
    """Return where footprints stand for nothing, and nothing true takes the ground anyway."""
    right = np.zeros(len(footprints), dtype=bool)
    right[shapely.STRtree(footprints).query(discs, predicate="intersects")[1]] = True
    false = shapely.union_all(footprints[~right])
    for_something = shapely.union_all(footprints[right])
    return shapely.intersection(shapely.difference(false, for_something), field)
