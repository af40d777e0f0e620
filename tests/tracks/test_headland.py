"""The border moved inwards: whole, whatever the width."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
import shapely
from shapely import box
from shapely.affinity import rotate, translate

import geofield as gf
from geofield.errors import TrackError
from geofield.tracks.headland import inset


def test_no_width_loses_a_part_of_the_field() -> None:
    lobes, neck = (box(0, 0, 80, 100), box(120, 0, 200, 120)), box(60, 40, 140, 48)
    for turned_deg in (3, 39, 45):
        outline: Any = rotate(shapely.union_all([*lobes, neck]), turned_deg)
        for width_m in np.linspace(4.5, 12.0, 200):
            # GEOS loses a lobe at some of these widths, the other at none.
            both = sum((80 - 2 * width_m) * (long - 2 * width_m) for long in (100, 120))
            assert abs(inset(outline, width_m).area - both) < 1.0


def test_a_hole_in_the_strip_cuts_the_pass_around_the_field() -> None:
    """The pass went along the hole's border instead, half the machine in the hole: 52 m of it."""
    field = box(500_000, 5_500_000, 500_200, 5_500_100)
    hole = box(500_090, 5_500_002, 500_110, 5_500_020)
    holed = shapely.Polygon(field.exterior, [hole.exterior])
    tracks = gf.plan_tracks(holed, crs=32633, spacing_m=8, headland_m=8, direction=90)
    (ring,) = tracks.headland_tracks.geometry
    assert ring.intersection(hole.buffer(0.01)).length < 0.05
    around = gf.plan_tracks(field, crs=32633, spacing_m=8, headland_m=8, direction=90)
    (whole,) = around.headland_tracks.geometry
    assert whole.difference(hole).length == pytest.approx(ring.length, abs=0.01)


def test_both_parts_that_a_headland_leaves_have_tracks_and_passes() -> None:
    lobes, neck = (box(0, 0, 80, 100), box(120, 0, 200, 120)), box(60, 40, 140, 48)
    field: Any = translate(shapely.union_all([*lobes, neck]), 500_000, 5_500_000)
    # Of this zone a metre is 0.9 units.
    crs: Any = "+proj=tmerc +lon_0=15 +k=0.9 +x_0=500000 +datum=WGS84 +units=m"
    tracks = gf.plan_tracks(field, crs=crs, spacing_m=5, headland_m=10, direction=0)
    inner = [
        box(500_009, 5_500_009, 500_071, 5_500_091),
        box(500_129, 5_500_009, 500_191, 5_500_111),
    ]
    segments = tracks.segments.to_crs(crs)
    lost = segments.geometry.difference(shapely.union_all(inner).buffer(0.01)).length
    assert lost.max() < 0.01
    for part in inner:
        assert segments.intersects(part).sum() in (13, 14)  # one every 4.5 units of 62
    rings = tracks.headland_tracks.to_crs(crs)
    # The first pass runs through the neck, the second around each part.
    assert rings["pass_no"].tolist() == [1, 2, 2]
    assert rings["segment_no"].tolist() == [1, 1, 2]
    strip_m2 = (field.area - shapely.union_all(inner).area) / 0.9**2
    assert tracks.headland["area_ha"].tolist() == pytest.approx([strip_m2 / 1e4], rel=1e-3)


def test_passes_run_around_holes_where_the_headland_does() -> None:
    field = box(500_000, 5_500_000, 500_200, 5_500_100)
    hole = box(500_090, 5_500_040, 500_110, 5_500_060)
    holed = shapely.Polygon(field.exterior, [hole.exterior])
    crs: Any = "+proj=tmerc +lon_0=15 +k=1 +x_0=500000 +datum=WGS84 +units=m"
    options: Any = {"crs": crs, "spacing_m": 3, "headland_m": 6, "direction": 90}
    tracks = gf.plan_tracks(holed, headland_holes=True, **options)
    rings = tracks.headland_tracks
    assert rings["pass_no"].tolist() == [1, 1, 2, 2]
    assert rings["segment_no"].tolist() == [1, 2, 1, 2]
    assert rings["offset_m"].tolist() == [1.5, 1.5, 4.5, 4.5]
    around = [2 * (197 + 97), 4 * 23, 2 * (191 + 91), 4 * 29]
    assert rings["length_m"].tolist() == pytest.approx(around, abs=0.05)
    (strip,) = tracks.headland["area_ha"]
    assert strip * 1e4 == pytest.approx(200 * 100 - 188 * 88 + 32 * 32 - 20 * 20, abs=0.5)
    # Else the hole has no strip of its own.
    alone = gf.plan_tracks(holed, **options)
    assert alone.headland_tracks["length_m"].tolist() == pytest.approx(around[::2], abs=0.05)
    assert alone.headland["area_ha"][0] * 1e4 == pytest.approx(200 * 100 - 188 * 88, abs=0.5)


def test_a_headland_of_nothing_is_refused() -> None:
    field = box(500_000, 5_500_000, 500_200, 5_500_100)
    with pytest.raises(TrackError, match="too narrow to be one"):
        gf.plan_tracks(field, crs=32633, spacing_m=8, headland_m=1e-7)


def test_rings_of_a_centimetre_are_not_united() -> None:
    """A thousand rings around a round field took half a minute, nearly all of it for that."""
    angles = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    far_m = 120 * (1 + 0.2 * np.cos(2 * angles) + 0.1 * np.cos(5 * angles))
    x, y = 500_000 + far_m * np.cos(angles), 5_500_000 + far_m * np.sin(angles)
    field, tree = shapely.Polygon(np.column_stack((x, y))), shapely.Point(500_140, 5_500_000)
    began = time.process_time()
    tracks = gf.plan_tracks(
        field, [tree.buffer(3)], crs=32633, spacing_m=0.01, headland_m=10, step_m=20
    )
    assert time.process_time() - began < 6
    rings = tracks.headland_tracks
    assert rings["pass_no"].max() == 1000
    assert rings.intersection(tree.buffer(2.99)).is_empty.all()


def test_a_spacing_of_millions_of_pieces_is_refused() -> None:
    """Two million were planned for a minute."""
    field = box(500_000, 5_500_000, 500_300, 5_500_200)
    with pytest.raises(TrackError, match="1,000,000 are the most"):
        gf.plan_tracks(field, crs=32633, spacing_m=0.00015, step_m=100)
