"""What stands in several fields: each avoids it, whichever field a person drew it in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import geopandas as gpd
import numpy as np
import shapely

from geofield import schema
from geofield.crs import metre_in, reproject
from geofield.farm.layers import EPSG, FIELD_ID
from geofield.farm.value import Farm
from geofield.known import with_rows
from geofield.model.obstacles import active
from geofield.plan import Plan

#: Ground that is not worth a row of its own, square metres.
_LEAST_M2 = 0.01
#: Shapes that differ by less are the same, metres.
_SAME_M = 0.01


def shared(edited: Mapping[str, Plan], farm: Farm) -> dict[str, Plan]:
    """Edited plans with what stands in them of their neighbours', and those that an edit reaches.

    An obstacle gets a row in each field in which it newly stands: because it was drawn, moved or
    confirmed, or because the outline was moved over it. What a person took away in one of two
    fields that it stood in stays away there. Tracks are not planned. `edited` are plans by field
    id, their obstacles as :func:`reconcile` leaves them; `farm` is as it was before the edits.
    """
    fields = farm.layer(schema.FIELD.name).set_index(FIELD_ID).geometry
    before = active(farm.layer(schema.OBSTACLES.name).to_crs(fields.crs))
    outlines = fields.copy()
    for one, plan in edited.items():
        outlines[one] = reproject(plan.field.polygon, plan.field.crs, fields.crs)
    tree, ids = shapely.STRtree(outlines.to_numpy()), list(outlines.index)
    plans = dict(edited)
    for owner, table in _standing(edited, before, outlines):
        shapes = table.geometry.to_crs(fields.crs).to_numpy()
        was = before.geometry[before[FIELD_ID] == owner].to_crs(table.crs)
        for row, at in zip(*tree.query(shapes, predicate="intersects"), strict=True):
            one = ids[at]
            if one == owner or (owner not in edited and one not in edited):
                continue
            stood = _is_there(table.geometry.iloc[row], was)
            if stood and fields[one].intersects(shapes[row]):
                continue
            plan = plans[one] if one in plans else farm[one]
            mine = table.iloc[[row]].to_crs(plan.field.crs)
            if _is_new_ground(plan, mine.geometry.iloc[0]):
                plans[one] = with_rows(plan, mine.drop(columns=[FIELD_ID, EPSG], errors="ignore"))
    return plans


def _standing(
    edited: Mapping[str, Plan], before: gpd.GeoDataFrame, outlines: gpd.GeoSeries
) -> Iterator[tuple[str, gpd.GeoDataFrame]]:
    """What is avoided in edited fields, and what is avoided of others in their outlines."""
    for one, plan in edited.items():
        if plan.obstacles is not None:
            yield one, active(plan.obstacles)
    reach = outlines[list(edited)].to_numpy()
    near = before.iloc[np.unique(before.sindex.query(reach, predicate="intersects")[1])]
    for one, rows in near[~near[FIELD_ID].isin(list(edited))].groupby(FIELD_ID):
        yield str(one), rows


def _is_there(shape: shapely.Geometry, others: gpd.GeoSeries) -> bool:
    """Whether a shape is one of others."""
    near = others[others.intersects(shape)].to_numpy()
    return bool((shapely.hausdorff_distance(near, shape) <= _SAME_M * metre_in(others.crs)).any())


def _is_new_ground(plan: Plan, shape: shapely.Geometry) -> bool:
    """Whether a shape stands in a field where nothing is avoided yet."""
    own = [] if plan.obstacles is None else active(plan.obstacles).geometry.buffer(_SAME_M)
    ground = shapely.intersection(shape, plan.field.polygon).difference(shapely.union_all(own))
    return bool(ground.area > _LEAST_M2)
