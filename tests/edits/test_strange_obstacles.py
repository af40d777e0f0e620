"""Obstacles as other programs leave them by a slip: told or refused, and never driven through."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from changed_plans import Frame, at, geofield, plan_in, rewritten, rows

from geofield.errors import FormatWarning
from geofield.model.review import reconcile
from geofield.model.written import same_shapes
from geofield_command import run_geofield


def test_borders_that_became_lines_are_the_areas_that_they_were(folder: Path) -> None:
    """As "polygons to lines" leaves them: strips, with a way through the middle of a tree."""
    plan = plan_in(folder)
    before = rows(plan)
    fence = shapely.LineString(before.geometry[2].exterior.coords[:20])
    lines = [shapely.LineString(shape.exterior.coords) for shape in before.geometry]
    table = before.set_geometry([lines[0], fence, *lines[2:]], crs=before.crs)
    with pytest.warns(FormatWarning, match=r"borders of obstacles became lines \(1, 3, 4"):
        after = reconcile(table, plan.evidence.written, plan.grid)[0].set_index("obstacle_no")
    kept = before.index != 2
    assert after.geometry[kept].geom_equals_exact(before.geometry[kept], 1e-3).all()
    assert after["status"][kept].equals(before["status"][kept])
    assert after.geometry[2].disjoint(before.geometry[2].centroid)


def test_degrees_in_a_layer_of_metres_are_refused(folder: Path) -> None:
    """The trees were gone to the equator, and the command ended in a traceback."""
    file = folder / "out/field.gpkg"

    def degrees(table: Frame) -> Frame:
        return table.set_geometry(table.geometry.to_crs("EPSG:4326").to_numpy(), crs=None).set_crs(
            table.crs, allow_override=True
        )

    rewritten(file, "obstacles", degrees)
    done = run_geofield("tracks", file, "-o", file)
    assert done.returncode == 1
    assert "11 rows of layer 'obstacles' lie nowhere near the field, as at x 33." in done.stderr


def test_a_radius_larger_than_any_field_is_refused_with_its_obstacle(folder: Path) -> None:
    """Pieces of track were counted instead."""
    file = folder / "out/field.gpkg"

    def typed(table: Frame) -> Frame:
        return table.assign(radius_m=table["radius_m"].mask(at(table, 3), 1e9))

    rewritten(file, "obstacles", typed)
    done = run_geofield("tracks", file, "-o", file)
    assert (done.returncode, "Obstacle 3: radius_m is 1e+09." in done.stderr) == (1, True)


def test_a_circle_of_nearly_no_size_may_be_drawn(folder: Path) -> None:
    """Its record was an empty shape: a traceback with every command."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    dot = before.geometry[1].centroid.buffer(1e-5)

    def draw(table: Frame) -> Frame:
        return pd.concat([table, gpd.GeoDataFrame(geometry=[dot], crs=table.crs)])

    rewritten(file, "obstacles", draw)
    geofield("tracks", file, "-o", file)
    geofield("tracks", file, "-o", file)
    assert len(rows(plan_in(folder))) == len(before) + 1


def test_a_radius_of_nothing_is_none(folder: Path) -> None:
    """Of a pond it made a circle as large as the margin, which was driven through at its sides."""
    file = folder / "out/field.gpkg"

    def pond(table: Frame) -> Frame:
        table.loc[at(table, 2), "geometry"] = table.geometry[at(table, 2)].envelope.buffer(3)
        return table

    rewritten(file, "obstacles", pond)
    geofield("tracks", file, "-o", file)
    before = rows(plan_in(folder))
    # As programs write it that know no empty number.
    rewritten(file, "obstacles", lambda table: table.assign(radius_m=table["radius_m"].fillna(0)))
    assert "obstacles" not in geofield("tracks", file, "-o", file)
    after = rows(plan_in(folder))
    assert after.geometry[2].equals_exact(before.geometry[2], 1e-6)
    assert after["radius_m"].equals(before["radius_m"])


@pytest.mark.parametrize("typed", [None, 2**31 - 1])
def test_the_number_of_what_was_taken_away_is_no_other_s(folder: Path, typed: int | None) -> None:
    """The last obstacle, taken away while another was drawn, was found again; a huge number that
    was typed led to numbers that no file holds."""
    file = folder / "out/field.gpkg"
    before = rows(plan_in(folder))
    last = int(before.index.max())
    place = plan_in(folder).field.polygon.representative_point().buffer(1.5)

    def exchanged(table: Frame) -> Frame:
        rest = table[~at(table, last)].copy()
        if typed:
            rest.loc[at(rest, 1), "obstacle_no"] = typed
        return pd.concat([rest, gpd.GeoDataFrame(geometry=[place], crs=table.crs)])

    rewritten(file, "obstacles", exchanged)
    told = geofield("obstacles", folder / "picture.tif", file, "-o", file)
    assert "1 you took away not taken up again" in " ".join(told.split())
    after = rows(plan_in(folder))
    assert after["status"][last + 1] == "added"
    assert not after.intersects(before.geometry[last].centroid).any()
    assert sorted(set(after.index) - set(before.index)) == [last + 1, *[typed][: bool(typed)]]
    # Nor once that, too, was taken away and forgotten.
    rewritten(file, "obstacles", lambda table: table[~at(table, last + 1)])
    geofield("tracks", file, "-o", file)

    def drawn(table: Frame) -> Frame:
        return pd.concat([table, gpd.GeoDataFrame(geometry=[place], crs=table.crs)])

    rewritten(file, "obstacles", drawn)
    geofield("tracks", file, "-o", file)
    assert rows(plan_in(folder))["status"][last + 2] == "added"


def test_places_in_another_order_are_the_same_shape_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """To measure how far apart 300 such are took 40 ms of each edit's 100 on the review page."""
    measured: list[int] = []
    hausdorff_distance = shapely.hausdorff_distance

    def counted(one: Any, other: Any) -> Any:
        measured.append(len(one))
        return hausdorff_distance(one, other)

    monkeypatch.setattr(shapely, "hausdorff_distance", counted)
    two = [shapely.box(0, 0, 2, 2), shapely.box(5, 0, 6, 9)]
    disc = shapely.Point(5e5, 4e6).buffer(3.0)
    ring = np.array(disc.exterior.coords[:-1])
    turned = shapely.Polygon(np.roll(ring, 7, axis=0)[::-1] + 0.001)
    finer = shapely.segmentize(disc, 0.1)
    one = [disc, disc, shapely.MultiPolygon(two), disc, disc]
    others = [turned, finer, shapely.MultiPolygon(two[::-1]), disc.buffer(0.03), None]
    assert same_shapes(one, others).tolist() == [True, True, True, False, False]
    assert sum(measured) == 1
