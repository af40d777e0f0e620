"""Where the outline runs along the picture's frame, that is no edge of the field."""

from __future__ import annotations

import pytest
from affine import Affine
from pyproj import CRS
from shapely import Polygon

from geofield.grid import Grid
from geofield.tracks import plan_tracks
from geofield.tracks.longest_edge import longest_edge

UTM = CRS.from_epsg(32636)
GRID = Grid(200, 200, Affine(1.0, 0, 500_000, 0, -1.0, 3_900_200), UTM)
FRAME = Polygon(
    [(500_000, 3_900_000), (500_200, 3_900_000), (500_200, 3_900_200), (500_000, 3_900_200)]
)
#: Cut off by the picture on three sides; its own border runs north-east.
CUT = Polygon(
    [(500_000, 3_900_000), (500_200, 3_900_000), (500_200, 3_900_140), (500_000, 3_900_060)]
)


def test_the_fields_own_edge_is_taken_though_the_frame_is_as_long() -> None:
    free = longest_edge(CUT)
    own = longest_edge(CUT, frame=FRAME)
    slope = (own.y1 - own.y0) / (own.x1 - own.x0)
    assert slope == pytest.approx(80 / 200, abs=1e-6)
    assert own.length == pytest.approx((200**2 + 80**2) ** 0.5, abs=1e-6)
    assert free.length >= own.length


def test_tracks_follow_the_fields_own_edge() -> None:
    steep = Polygon(
        [(500_000, 3_900_000), (500_200, 3_900_000), (500_090, 3_900_200), (500_000, 3_900_200)]
    )
    without = plan_tracks(steep, crs=UTM, spacing_m=5.0, direction="longest_edge")
    within = plan_tracks(steep, crs=UTM, spacing_m=5.0, grid=GRID)
    assert within.heading_deg == pytest.approx(180 - 28.81, abs=1.5)
    assert without.heading_deg == pytest.approx(within.heading_deg, abs=1.5)
    corner = [(500_000, 3_900_000), (500_200, 3_900_000), (500_200, 3_900_060)]
    cut = Polygon([*corner, (500_060, 3_900_200), (500_000, 3_900_200)])
    assert plan_tracks(cut, crs=UTM, spacing_m=5.0).heading_deg != pytest.approx(135, abs=1)
    tracks = plan_tracks(cut, crs=UTM, spacing_m=5.0, grid=GRID)
    assert tracks.heading_deg == pytest.approx(135, abs=1)


def test_a_field_that_fills_the_picture_still_gets_tracks() -> None:
    tracks = plan_tracks(FRAME, crs=UTM, spacing_m=5.0, grid=GRID)
    assert len(tracks.lines) == 40
