"""The second opinion of the default method: what each superpixel shows, and what that says."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import box

from geofield.field import auto, extract_field, scoring
from geofield.field.choice import Judge, Outline
from geofield.field.ground import AGREEMENT, Ground, Network, agreement, learned
from geofield.field.looks import LOOKS, looks
from geofield.field.regions import Region, partition
from geofield.field.straight import ring
from geofield.field.surface import Surface
from geofield.simulate import SimulationSettings, simulate_field


@pytest.fixture(scope="module")
def two_fields():
    """A surface whose right part differs, its looks from a seed on the left, who is left."""
    stack = np.random.default_rng(0).normal(0, 0.4, (3, 160, 160)).astype(np.float32)
    stack[0, :, 90:] += 10
    surface = Surface(stack, partition(stack), np.zeros((160, 160), bool))
    raw = np.clip(100 + 5 * stack, 0, 255).astype(np.float32)
    found = looks(surface, surface.parted, raw, (40.5, 80.5))
    return surface, found, surface.centres[1] < 90


def test_looks_tell_the_ground_beyond_a_border(two_fields):
    _, found, left = two_fields
    assert found.shape == (len(left), len(LOOKS))
    assert len(set(LOOKS)) == len(LOOKS)
    assert np.isfinite(found).all()
    look = dict(zip(LOOKS, found.T, strict=True))
    for name in ("unlike_seed", "joined_height", "sight_border_most", "sight_unlike_most"):
        assert look[name][~left].min() > np.quantile(look[name][left], 0.98), name
    assert look["way_cost"][~left].min() > np.median(look["way_cost"][left]) + 1
    assert not look["has_vegetation"].any()
    assert look["has_colour"].all()


def test_the_learned_network_believes_what_is_plain(two_fields):
    _, found, left = two_fields
    odds = learned().odds(found)
    assert np.median(odds[left]) > 2
    assert np.median(odds[~left]) < -2


def test_the_outline_that_agrees_with_the_ground_overlaps_it_most(two_fields):
    surface, _, left = two_fields
    first = np.zeros((len(LOOKS), 1))
    first[0] = 1.0
    network = Network(
        np.zeros(len(LOOKS)), np.ones(len(LOOKS)), first, np.zeros(1), np.array([4.0]), -2.0
    )
    told = np.zeros((len(left), len(LOOKS)))
    told[:, 0] = left
    ground = Ground(surface, told, network)
    assert ground.likely[left].min() == pytest.approx(1 / (1 + np.exp(-2)))
    assert ground.likely[~left].max() == pytest.approx(1 / (1 + np.exp(2)))
    outlines = (box(0, 0, 90, 160), box(0, 0, 70, 160), box(0, 0, 120, 160), box(90, 0, 160, 160))
    rows = [agreement(ground, surface.members(ring(one))) for one in outlines]
    figures = [dict(zip(AGREEMENT, row, strict=True)) for row in rows]
    assert max(range(4), key=lambda k: figures[k]["ground_overlap"]) == 0
    assert min(range(4), key=lambda k: figures[k]["ground_fit"]) == 0
    assert figures[0]["ground_unlikely_share"] == 0
    assert figures[2]["ground_unlikely_share"] == pytest.approx(0.25, abs=0.03)


def test_the_curves_of_the_second_opinion_count_the_ground():
    curves = scoring.learned(ground=True)
    assert curves.slope.shape == (3, len(scoring.NAMES) + len(AGREEMENT))
    usual = curves.usual[None]
    agrees = usual.copy()
    agrees[0, scoring.WITH_GROUND.index("ground_overlap")] += 1.0
    agrees[0, scoring.WITH_GROUND.index("ground_fit")] -= 1.0  # logarithm of what does not fit
    assert curves.score(agrees) > curves.score(usual)


@pytest.mark.parametrize(("doubt_below", "opinions"), [(0.0, 1), (1.1, 2)])
def test_the_ground_is_asked_where_there_is_doubt(monkeypatch, doubt_below, opinions):
    asked = []
    given = auto.opinion

    def opinion(ready, curves, network=None):
        asked.append(network)
        return given(ready, curves, network)

    monkeypatch.setattr(auto, "opinion", opinion)
    monkeypatch.setattr(auto, "SECOND_OPINION", doubt_below)
    truth = simulate_field(3, SimulationSettings(width_px=320, height_px=320))
    field = extract_field(truth.scene, lat=truth.lat, lon=truth.lon)
    assert len(asked) == opinions
    assert asked[0] is None
    assert opinions == 1 or asked[1] is learned()
    common = field.polygon.intersection(truth.field.polygon).area
    assert common / field.polygon.union(truth.field.polygon).area > 0.95


def test_the_second_opinion_is_the_one_taken(monkeypatch):
    given = auto.opinion

    def opinion(ready, curves, network=None):
        found = given(ready, curves, network)
        if network is None:
            return replace(found, certainty=0.1)
        return replace(found, outline=replace(found.outline, polygon=square), certainty=0.33)

    monkeypatch.setattr(auto, "opinion", opinion)
    truth = simulate_field(3, SimulationSettings(width_px=320, height_px=320))
    x, y = truth.scene.grid.from_lonlat(truth.lon, truth.lat)
    square = box(x - 40, y - 40, x + 40, y + 40)
    found = auto.segment(truth.scene, x, y)
    assert found.mask.sum() < 90**2
    assert dict(found.figures)["certainty"] == 0.33


def test_the_second_opinion_believes_its_scores_more(monkeypatch):
    asked = []
    given = auto.choose
    monkeypatch.setattr(
        auto,
        "choose",
        lambda polygons, score, boldness: (
            asked.append(boldness) or given(polygons, score, boldness)
        ),
    )
    monkeypatch.setattr(auto, "SECOND_OPINION", 1.01)
    truth = simulate_field(3, SimulationSettings(width_px=320, height_px=320))
    auto.segment(truth.scene, *truth.scene.grid.from_lonlat(truth.lon, truth.lat))
    assert asked == [1.0, 2.0]


def test_what_one_judge_measured_serves_another(two_fields, monkeypatch):
    surface, told, _ = two_fields
    ground = Ground(surface, told, learned())
    region = Region(np.ones(surface.shape, bool), np.zeros(surface.shape, bool), np.zeros(14))
    outlines = [box(0, 0, 90, 160), box(0, 0, 70, 160), box(5, 5, 6, 6)]
    afresh = Judge(surface, scoring.learned(ground=True), ground).measured(outlines, region)
    known = {}
    first = Judge(surface, scoring.learned(), known=known).measured(outlines, region)
    monkeypatch.setattr("geofield.field.choice.measure", None)  # not asked again
    second = Judge(surface, scoring.learned(ground=True), ground, known).measured(outlines, region)
    assert len(first) == len(second) == 2  # one is a scrap
    for one, other, again in zip(first, second, afresh, strict=True):
        assert np.array_equal(other.figures, again.figures)
        assert np.array_equal(other.figures[: len(scoring.NAMES)], one.figures)


@pytest.mark.parametrize(
    ("name", "plain", "doubtful", "told"),
    [
        (
            "inside_95_above_border",
            -1.0,
            0.2,
            "borders close inside it are nearly as strong as its own",
        ),
        ("long_sides_share", 0.95, 0.5, "much of its course is crooked"),
    ],
)
def test_the_reasons_of_a_low_certainty_are_told(name, plain, doubtful, told):
    said = []
    for value in (plain, doubtful):
        figures = scoring.learned().usual.copy()
        figures[scoring.NAMES.index(name)] = value
        notes, _ = auto._evidence(auto.Opinion(Outline(box(0, 0, 1, 1), None, figures), 0.9, 0.9))
        said.append(told in notes)
    assert said == [False, True]
