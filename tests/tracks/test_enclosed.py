"""Ground that obstacles enclose: tracks there are told of, for no machine gets there."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
import shapely
from shapely import Polygon

from geofield.errors import TrackWarning
from geofield.tracks import plan_tracks

CRS = "EPSG:32636"
CENTRE = (500_100.0, 3_900_100.0)
FIELD = shapely.box(500_000, 3_900_000, 500_200, 3_900_200)
YARD = shapely.Point(CENTRE).buffer(40.0)
RING = YARD.buffer(5.0).difference(YARD.buffer(-5.0))
TOLD = r"(\d+) segments \((\d+) m\) lie on ground that obstacles enclose"


def trees(count: int, kept: int) -> gpd.GeoDataFrame:
    """Points around the yard, as many as fit beside each other, or fewer of them."""
    turn = 2.0 * np.pi * np.arange(kept) / count
    x, y = CENTRE[0] + 40.0 * np.cos(turn), CENTRE[1] + 40.0 * np.sin(turn)
    return gpd.GeoDataFrame(
        {"radius_m": np.full(kept, 5.0)}, geometry=gpd.points_from_xy(x, y), crs=CRS
    )


@pytest.mark.parametrize("obstacles", [trees(30, 30), [RING]], ids=["trees", "one ring"])
def test_what_a_ring_holds_is_told(obstacles: object) -> None:
    with pytest.warns(TrackWarning, match=TOLD) as told:
        tracks = plan_tracks(FIELD, obstacles, crs=CRS, spacing_m=5.0, direction=0)
    inside = tracks.segments[tracks.segments.within(YARD)]
    assert len(inside) > 10
    assert str(told[0].message) in tracks.notes
    assert f"{len(inside)} segments ({inside['length_m'].sum():.3g} m)" in str(told[0].message)


def test_a_gap_to_drive_through_is_not_told() -> None:
    assert plan_tracks(FIELD, trees(30, 29), crs=CRS, spacing_m=5.0, direction=0).notes == ()
    slit = shapely.LineString([CENTRE, (CENTRE[0] + 100.0, CENTRE[1])]).buffer(1.0)
    half = RING.difference(slit)
    assert plan_tracks(FIELD, [half], crs=CRS, spacing_m=5.0, direction=0).notes == ()


def test_a_hole_of_the_field_closes_a_ring() -> None:
    gate = shapely.Point(CENTRE[0] + 40.0, CENTRE[1]).buffer(8.0)
    pond = RING.difference(gate.buffer(-1.0))
    field = Polygon(FIELD.exterior, [shapely.get_exterior_ring(pond)])
    with pytest.warns(TrackWarning, match=TOLD):
        plan_tracks(field, [gate], crs=CRS, spacing_m=5.0, direction=0)
    assert plan_tracks(field, crs=CRS, spacing_m=5.0, direction=0).notes == ()
