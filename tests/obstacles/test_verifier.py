"""The verifier's parts: shade, rings, context, forests."""

import numpy as np
import pytest

from geofield.obstacles.auto import picture_channels
from geofield.obstacles.context import context_features
from geofield.obstacles.features import FeatureTable
from geofield.obstacles.forest import Forest
from geofield.obstacles.rings import RINGS_PX, SECTORS, ring_features
from geofield.obstacles.shade import shade_direction, shade_votes


def crowns(toward, size=160, radius=6.0):
    """A grey picture of crowns that are darker on one side, each with a shadow there."""
    y, x = np.mgrid[:size, :size].astype(float)
    picture = np.full((size, size), 150.0)
    at = np.array([(c, r) for c in range(20, size, 30) for r in range(20, size, 30)], float)
    for shadow in (True, False):
        for cx, cy in at:
            shift = 1.2 * radius if shadow else 0.0
            dx, dy = x - cx - shift * np.cos(toward), y - cy - shift * np.sin(toward)
            disc = np.hypot(dx, dy) < radius
            slope = 4 * (dx * np.cos(toward) + dy * np.sin(toward))
            picture[disc] = 30 if shadow else (90 - slope)[disc]
    return picture.astype(np.float32), at


@pytest.mark.parametrize("degrees", [0, 65, 180, -120])
def test_crowns_tell_where_shade_falls(degrees):
    luma, at = crowns(np.radians(degrees))
    found = picture_channels(luma, None, None)
    direction = shade_direction(shade_votes(found, *at.T, np.ones(len(at))))
    difference = np.angle(np.exp(1j * (direction - np.radians(degrees))))
    assert abs(np.degrees(difference)) <= 5
    steps = np.degrees(direction) / 5
    assert steps == pytest.approx(round(steps))


def test_nobody_votes_in_an_empty_picture():
    found = picture_channels(np.full((40, 40), 90, np.float32), None, None)
    none = np.empty(0)
    assert shade_votes(found, none, none, none) == 0
    assert shade_direction(0j) == 0


def test_sectors_are_laid_out_from_the_shade():
    degrees = 65
    luma, at = crowns(np.radians(degrees))
    found = picture_channels(luma, None, None)
    table = ring_features(found, *at[5:9].T, np.radians(degrees))
    column = {name: table.values[:, i] for i, name in enumerate(table.names)}
    # Eight pixels out there is shadow on one side, ground on the other.
    assert (column["lumaring_8_shade"] < -40).all()
    assert (column["lumaring_8_sun"] > 40).all()
    turned = ring_features(found, *at[5:9].T, np.radians(degrees + 180))
    other = turned.values[:, turned.names.index("lumaring_8_sun")]
    assert other == pytest.approx(column["lumaring_8_shade"], abs=8)
    assert sorted(k for part in SECTORS.values() for k in part) == list(range(16))
    assert len(RINGS_PX) == sum(name.startswith("lumaring") for name in table.names) / 9


def test_context_counts_what_is_around():
    x = np.array([10.0, 12, 30, 100, 101])
    y = np.array([10.0, 10, 10, 100, 100])
    score = np.array([1.0, 0, -1, 2, -9])
    kept = np.array([0, 2, 3])
    table = context_features(x, y, score, kept, np.array([8.0, 9, 10]))
    column = {name: table.values[:, i] for i, name in enumerate(table.names)}
    near = 1 / (1 + np.exp(-score))
    assert column["score"].tolist() == [1, -1, 2]
    assert column["rival_3"].tolist() == [0, -8, -8]
    assert column["rival_25"].tolist() == [0, 1, -8]
    assert column["lead_6"] == pytest.approx([1, 7, 10])
    assert column["mass_3"] == pytest.approx([near[0] + near[1], near[2], near[3]], abs=1e-3)
    assert column["mass_25"][1] == pytest.approx(near[:3].sum(), abs=1e-3)
    assert column["off_centre"] == pytest.approx(
        [2 * near[1] / (near[0] + near[1]), 0, 0], abs=1e-3
    )
    assert column["stronger_distance"].tolist() == [41, 18, 41]
    assert column["neighbour_distance"].tolist() == [20, 20, 41]
    assert column["neighbour_score"].tolist() == [-1, 1, -8]
    assert column["neighbours_25"] == pytest.approx([near[2], near[0], 0], abs=1e-3)


def test_context_of_nothing_is_empty():
    none = np.empty(0)
    table = context_features(none, none, none, np.empty(0, np.intp), none)
    assert table.values.shape == (0, len(table.names))


def test_hopeless_candidates_are_not_asked_further():
    stump = {"nodes": [[0, 0.5, -1, -2]], "leaves": [-1.0, 1.0]}
    table = {"features": ["a"], "trees": [stump, stump, stump]}
    values = FeatureTable(("a",), np.array([[0.0], [1.0], [0.5]], np.float32))
    assert Forest.read(table).evaluate(values).tolist() == [-3, 3, -3]
    early = Forest.read(table | {"early": [1, 0.0]}).evaluate(values)
    assert early.tolist() == [-np.inf, 3, -np.inf]


def test_a_tree_has_up_to_32_leaves():
    # A comb: node k parts off the values up to k.
    nodes = [[0, float(k), -1 - k, k + 1 if k < 30 else -32] for k in range(31)]
    table = {"features": ["a"], "trees": [{"nodes": nodes, "leaves": list(range(32))}]}
    values = np.arange(32, dtype=np.float32)
    found = Forest.read(table).evaluate(FeatureTable(("a",), values[:, None]))
    assert found.tolist() == list(range(32))
