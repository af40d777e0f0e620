"""What was learned is read by name: no two figures or channels can be swapped unnoticed."""

import itertools
import json
from dataclasses import replace
from importlib.resources import files
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely

from geofield.errors import FieldError
from geofield.field import FieldSearch, extract_field
from geofield.field.border import measure
from geofield.field.frame import Frame, covered
from geofield.field.learned import Learned, shipped
from geofield.field.likely import Candidate, evidence_of, likeliest
from geofield.field.network import BANDS, POINTS, SIDE_PX, normalised, points_maps
from geofield.field.ranking import Ranking, exact, log_odds, trained
from geofield.field.said import Said
from geofield.field.straight import ring
from geofield.learned import network
from geofield.learned.network import Step
from geofield.simulate import SimulationSettings, simulate_field

OUTLINES = (
    [(38, 42), (110, 36), (160, 50), (160, 118), (90, 126), (42, 119)],
    [(40, 40), (160, 40), (160, 120), (40, 120)],
    [(20, 30), (100, 20), (104, 26), (140, 90), (90, 94), (96, 140), (30, 120)],
)


@pytest.fixture(scope="module")
def several():
    """The figures of outlines that fit one border or another, or none."""
    rng = np.random.default_rng(4)
    stack = rng.normal(0, 0.5, (3, 160, 160)).astype(np.float32)
    stack[0, 40:120, 40:] += 9
    stack[1, 70:100, 60:110] += 3
    stack[2, 120:] += 5 * rng.random((40, 160), np.float32)
    layers = np.ascontiguousarray(np.moveaxis(stack, 0, -1))
    likely = np.clip(stack[0] / 9 + 0.1, 0.02, 0.97)
    outlines = [shapely.Polygon(corners) for corners in OUTLINES]
    masks = [covered(ring(one), likely.shape) for one in outlines]
    said = Said(likely, ((162.0, 44.0), (150.0, 5.0)), masks[1])
    return [
        {**(measure(layers, outline, Frame(likely.shape)) or {}), **said.figures(outline, mask)}
        for outline, mask in zip(outlines, masks, strict=True)
    ]


@pytest.fixture
def figures(several):
    return several[0]


def test_figures_of_what_points_say_are_as_they_are_defined():
    """The ranking learned them so: with other ones its answer is that to another question."""
    mask = np.zeros((20, 20), np.uint8)
    mask[:10, :10] = 1
    polygon = shapely.box(0, 0, 10, 10)
    said = Said(np.where(mask, 0.8, 0.2).astype(np.float32)).figures(polygon, mask)
    assert said["network_overlap"] == pytest.approx(0, abs=1e-5)  # 80 of 100 + 140 - 80
    assert said["network_missed"] == pytest.approx(60 / 140)
    assert said["network_fit_of_area"] == pytest.approx(np.log(0.02 - 4 * np.log(0.8)), abs=1e-5)
    # What is quite sure is sure to half a percent.
    sure = Said(mask.astype(np.float32)).figures(polygon, mask)
    assert sure["network_fit_of_area"] == pytest.approx(np.log(0.02 - 4 * np.log(0.995)), abs=1e-4)


def test_certainty_is_judged_by_the_beliefs_in_outlines_like_the_one_taken():
    one = Candidate(shapely.box(0, 0, 9, 9), np.zeros((1, 1), bool), {"kept": 1.0}, 0.0)
    belief, overlap = np.array([0.4, 0.3, 0.2, 0.1]), np.array([1.0, 0.96, 0.9, 0.8])
    evidence = evidence_of(one, 0.5, belief, overlap)
    expected = {"kept": 1.0, "expected_overlap": 0.0, "belief_alike": 0.9, "belief_same": 0.7}
    assert evidence == pytest.approx(expected)


def table(tmp_path, change):
    """The ranking of a table that was changed."""
    folder = files("geofield.learned")
    known = json.loads((folder / "outline_ranking.json").read_text("utf-8"))
    change(known)
    (tmp_path / "outline_ranking.json").write_text(json.dumps(known), "utf-8")
    return trained(folder=tmp_path)


def test_no_two_figures_can_be_taken_for_each_other(several):
    for one, other in itertools.combinations(several[0], 2):
        apart = max(abs(figures[one] - figures[other]) for figures in several)
        assert apart > 1e-6, (one, other)


def test_every_figure_of_the_ranking_is_measured_and_counts(figures):
    known = trained()
    assert set(known.names) <= set(figures)
    score = known.scores([figures])[0]
    for name in known.names:
        at = known.names.index(name)
        moved = {**figures, name: float(known.mean[at] + 2.5 * known.spread[at])}
        again = {**figures, name: float(known.mean[at] - 2.5 * known.spread[at])}
        assert len({float(known.scores([one])[0]) for one in (moved, again)} | {score}) >= 2, name


def test_two_names_swapped_in_the_table_are_noticed(several, tmp_path):
    names = trained().names
    scores = trained().scores(several)
    for one, other in zip(names, names[1:] + names[:1], strict=True):

        def swap(known, one=one, other=other):
            for row in known["figures"]:
                row["name"] = {one: other, other: one}.get(row["name"], row["name"])

        again = table(tmp_path, swap).scores(several)
        assert not np.array_equal(again, scores), (one, other)


def test_two_names_swapped_among_the_edges_are_noticed(several, tmp_path):
    """Where a field ends is decided by curves of their own, by name as well."""
    names = trained().names
    exactness = trained().exactness(several)
    assert not np.allclose(exactness, trained().scores(several))
    for one, other in zip(names, names[1:] + names[:1], strict=True):

        def swap(known, one=one, other=other):
            rows = {row["name"]: row for row in known["figures"]}
            first, second = rows[one], rows[other]
            first["edge"], second["edge"] = second["edge"], first["edge"]

        again = table(tmp_path, swap).exactness(several)
        assert not np.array_equal(again, exactness), (one, other)


def test_of_the_likeliest_ground_the_most_exact_outline_is_taken():
    # Two of one ground, and a rival that is more exact but holds other ground.
    overlap = np.array([[1.0, 0.95, 0.5], [0.95, 1.0, 0.5], [0.5, 0.5, 1.0]])
    expected = np.array([0.9, 0.88, 0.6])
    plain = [shapely.box(0, 0, 9, 9)] * 3
    assert exact(expected, overlap, np.array([0.1, 0.4, 9.0]), plain) == 1
    assert exact(expected, overlap, np.array([0.4, 0.1, 9.0]), plain) == 0
    # Nearly as exact: the one without the corner cut off.
    cut = shapely.Polygon([(0, 2), (2, 0), (9, 0), (9, 9), (0, 9)])
    assert exact(expected, overlap, np.array([0.42, 0.4, 9.0]), [cut, *plain[1:]]) == 1
    assert exact(expected, overlap, np.array([0.6, 0.4, 9.0]), [cut, *plain[1:]]) == 0


@pytest.mark.parametrize(("corrections", "taken"), [(0, "answered"), (1, "believed")])
def test_a_first_outline_agrees_with_the_network_one_after_points_with_beliefs(corrections, taken):
    outlines = {"believed": shapely.box(0, 0, 10, 10), "answered": shapely.box(20, 0, 30, 10)}
    answer = {"believed": 0.1, "answered": 0.9}
    score = {"believed": 0.5, "answered": 0.0}
    found = [
        Candidate(
            outline,
            np.zeros((1, 1), bool),
            {
                "network_overlap": float(log_odds(answer[name])),
                "corrections": float(corrections),
            },
            score[name],
        )
        for name, outline in outlines.items()
    ]
    ranking: Any = SimpleNamespace(
        exactness=lambda some: np.zeros(len(some)), certainty=lambda what, evidence: 0.5
    )
    first = likeliest(found, ranking)
    assert first.candidate.polygon == outlines[taken]


def test_two_names_swapped_in_the_calibration_are_noticed(figures, tmp_path):
    beliefs = {"expected_overlap": 1.3, "belief_alike": 0.6, "belief_same": 0.4}
    questions = [
        (kind, what, weights)
        for kind, of_kind in trained().calibration.items()
        for what, weights in of_kind.items()
    ]
    assert len(questions) == 6
    for kind, what, weights in questions:
        evidence = {**figures, **beliefs, "corrections": 2.0 * (kind == "corrected")}
        right = trained().certainty(what, evidence)
        for one, other in itertools.combinations(weights.keys() - {"constant"}, 2):

            def swap(known, kind=kind, what=what, one=one, other=other):
                told = known["calibration"][kind][what]
                told[one], told[other] = told[other], told[one]

            again = table(tmp_path, swap).certainty(what, evidence)
            assert abs(again - right) > 1e-6, (kind, what, one, other)


def of_parts(known):
    """As tables were when one held several rankings."""
    for row in known["figures"]:
        row["slopes"], row["edges"] = [row.pop("slope")], [row.pop("edge")]


@pytest.mark.parametrize(
    "change", [of_parts, lambda known: known.pop("calibration"), lambda known: known.clear()]
)
def test_a_table_of_another_version_is_refused(tmp_path, change):
    with pytest.raises(FieldError, match=r"outline_ranking\.json"):
        table(tmp_path, change)


@pytest.mark.parametrize("include", [(), ((320.5, 333.5),)])
@pytest.mark.parametrize("exclude", [(), ((12.5, 20.5),)])
def test_a_search_asks_what_it_was_given_and_nothing_else(include, exclude, monkeypatch):
    """Outlines are judged by models that have not seen their site: no other one may answer."""
    # Wider than the first view: the network is asked whether its ground goes on, too.
    truth = simulate_field(101, SimulationSettings(width_px=640, height_px=640))
    known = shipped()
    steps = tuple(replace(step) for step in known.network.steps)
    own = Learned(replace(known.network, steps=steps), replace(known.ranking))
    asked: dict[str, set[int]] = {}

    def watched(kind, name):
        original = getattr(kind, name)

        def call(self, *given):
            asked.setdefault(name, set()).add(id(self))
            return original(self, *given)

        monkeypatch.setattr(kind, name, call)

    watched(Step, "__call__")
    for name in ("scores", "exactness", "certainty"):
        watched(Ranking, name)

    def found(search):
        belong, apart = (
            [truth.scene.grid.to_lonlat(*at) for at in points] for points in (include, exclude)
        )
        asked.clear()
        field = extract_field(
            truth.scene,
            lat=truth.lat,
            lon=truth.lon,
            include=belong,
            exclude=apart,
            search=search,
        )
        assert asked.keys() == {"__call__", "scores", "exactness", "certainty"}
        rankings = asked["scores"] | asked["exactness"] | asked["certainty"]
        return field, asked["__call__"], rankings

    field, *answered = found(FieldSearch((truth.lon, truth.lat), own))
    assert answered == [{id(step) for step in own.network.steps}, {id(own.ranking)}]
    usual, *answered = found(None)
    assert answered == [{id(step) for step in known.network.steps}, {id(known.ranking)}]
    assert usual.polygon == field.polygon


def test_certainty_falls_with_what_is_expected(figures):
    for what in ("field", "ground", "border"):
        sure, fair, doubtful = (
            trained().certainty(
                what,
                {
                    **figures,
                    "expected_overlap": odds,
                    "belief_alike": share,
                    "belief_same": share,
                },
            )
            for odds, share in ((4.0, 0.95), (1.0, 0.6), (-1.0, 0.2))
        )
        assert sure > fair > doubtful


def test_the_network_takes_its_channels_in_their_order():
    assert network("outline").inputs == (*BANDS, *POINTS)
    rng = np.random.default_rng(0)
    rgb = rng.uniform(60, 160, (3, SIDE_PX, SIDE_PX)).astype(np.float32)
    rgb += np.array([0, 20, 40], np.float32)[:, None, None]
    nir = rgb[0] * 1.5 + 10
    valid = np.ones((SIDE_PX, SIDE_PX), bool)
    valid[:, -20:] = False
    named = dict(zip(BANDS, normalised(rgb, nir, valid), strict=True))
    inside = (slice(None), slice(0, -20))
    red, green, blue = (float(named[name][inside].mean()) for name in ("red", "green", "blue"))
    assert red < green < blue
    assert abs(float(named["nir"][inside].mean())) < 0.01
    assert named["vegetation"][inside].min() > 0
    assert np.array_equal(named["valid"] > 0, valid)
    assert not any(named[name][~valid].any() for name in BANDS)
    without = dict(zip(BANDS, normalised(rgb, None, valid), strict=True))
    assert not without["nir"].any()
    assert not without["vegetation"].any()
    maps = dict(zip(POINTS, points_maps([(40.0, 80.0)], [(200.0, 20.0)]), strict=True))
    places = {
        name: np.unravel_index(int(np.argmax(maps[name])), maps[name].shape) for name in POINTS
    }
    assert max(abs(a - b) for a, b in zip(places["belongs_at"], (20, 10), strict=True)) <= 1
    assert max(abs(a - b) for a, b in zip(places["apart_at"], (5, 50), strict=True)) <= 1
    assert maps["belongs_around"].mean() > maps["belongs_at"].mean()
    assert maps["apart_around"].mean() > maps["apart_at"].mean()
