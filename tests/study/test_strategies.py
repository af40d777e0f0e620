"""The study's strategies: which setting wins, and what is told about it."""

import numpy as np
import pytest
from affine import Affine
from scipy import ndimage

import geofield as gf
from geofield.errors import ObstacleError
from geofield.model import Scene
from geofield.model.circles import Circles, disc_means, inside
from geofield.study.edges import EDGE_METHODS
from geofield.study.strategies import EdgeCircles, first_of_duplicates, run_strategy, thresholds

RANGE = (0.02, 0.2, 0.03)


@pytest.fixture(scope="module")
def grey():
    y, x = np.mgrid[:120, :130]
    out = np.full((120, 130), 0.7)
    for cx, cy, r in [(30, 30, 8), (80, 40, 10), (60, 90, 7)]:
        cover = np.clip(r + 0.5 - np.hypot(x - cx, y - cy), 0, 1)
        out -= 0.4 * cover
    noise = np.random.default_rng(5).normal(0, 0.01, out.shape)
    return ndimage.gaussian_filter(out, 0.6) + noise


@pytest.fixture(scope="module")
def region(grey):
    region = np.zeros(grey.shape, bool)
    region[5:-5, 5:-5] = True
    return region


HOW = EdgeCircles((5, 14))


@pytest.mark.parametrize("strategy", ["single", "t_range", "max_of_all", "dlc", "consensus"])
def test_every_strategy_finds_clear_discs(grey, region, strategy):
    result = run_strategy(grey, region, strategy, HOW, threshold_range=RANGE)
    for cx, cy in [(30, 30), (80, 40), (60, 90)]:
        assert np.hypot(result.circles.x_px - cx, result.circles.y_px - cy).min() < 2.5


def test_the_winner_has_the_most_detections_at_the_smallest_threshold(grey, region):
    result = run_strategy(grey, region, "dlc", HOW, threshold_range=RANGE)
    assert set(result.counts) == set(EDGE_METHODS)
    rows = [(method, t, n) for method, table in result.counts.items() for t, n in table]
    assert len(rows) == 4 * 7
    most = max(n for *_, n in rows)
    assert len(result.circles) == most
    assert (result.method, result.threshold) == next((m, t) for m, t, n in rows if n == most)


def test_max_of_all_takes_the_default_of_each_method(grey, region):
    result = run_strategy(grey, region, "max_of_all", HOW)
    assert [len(table) for table in result.counts.values()] == [1, 1, 1, 1]
    singles = {
        m: len(run_strategy(grey, region, "single", HOW, edge_method=m).circles)
        for m in EDGE_METHODS
    }
    assert len(result.circles) == max(singles.values())


def test_consensus_says_how_many_settings_agree(grey, region):
    result = run_strategy(grey, region, "consensus", HOW, threshold_range=RANGE, min_share=0.3)
    assert np.all((result.share >= 0.3) & (result.share <= 1))


def test_progress_is_told(grey, region):
    told = []
    run_strategy(grey, region, "max_of_all", HOW, progress=lambda *a: told.append(a[:2]))
    assert told == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_a_second_pass_adds_circles_once(grey, region):
    edges = EdgeCircles((5, 14), smoothed_radius_px=(5, 12))
    both = run_strategy(grey, region, "single", edges).circles
    assert first_of_duplicates(both).all()


@pytest.mark.parametrize("span", [(0, 1, 0), (0, 1, -0.1), (1, 0, 0.1), (0, np.nan, 0.1)])
def test_impossible_ranges_are_refused(span):
    with pytest.raises(ObstacleError, match="no range"):
        thresholds(span)


def test_a_range_includes_both_ends():
    assert thresholds((0, 0.3, 0.001)).size == 301


def test_bad_names_are_refused(grey, region):
    with pytest.raises(ObstacleError, match="strategy"):
        run_strategy(grey, region, "best", HOW)  # type: ignore[arg-type]
    with pytest.raises(ObstacleError, match="edge method"):
        run_strategy(grey, region, "single", HOW, edge_method="laplace")  # type: ignore[arg-type]


def test_checks_on_circles():
    x, y, radius = np.array([[10.5, 10.5, 3], [10.7, 10.5, 3], [30.5, 30.5, 2], [-5, 10, 3]]).T
    circles = Circles(x, y, radius, np.ones(4))
    assert first_of_duplicates(circles).tolist() == [True, False, True, True]
    region = np.zeros((40, 40), bool)
    region[:20] = True
    assert inside(circles, region).tolist() == [True, True, False, False]
    # The pixel in row 19 ends at 20, counted from the picture's corner.
    x, y, radius = np.array([[3.0, 19.9, 1], [3.0, 20.1, 1]]).T
    edge = Circles(x, y, radius, np.ones(2))
    assert inside(edge, region).tolist() == [True, False]
    grey = np.full((40, 40), 200.0)
    grey[25:36, 25:36] = 100.0
    means = disc_means(grey, circles)
    assert means[:3].tolist() == [200, 200, 100]
    assert np.isnan(means[3])


@pytest.mark.parametrize(
    ("check", "limit", "count"),
    [("none", None, 2), ("absolute", 127.37, 1), ("relative", None, 2), (50.0, 50.0, 0)],
)
def test_discs_above_a_grey_level_are_left_out(check, limit, count):
    y, x = np.mgrid[:90, :110]
    grey = np.full((90, 110), 220.0)
    grey[np.hypot(x - 30, y - 30) < 9] = 90
    grey[np.hypot(x - 75, y - 50) < 9] = 150
    grid = gf.Grid(110, 90, Affine(0.6, 0, 500000, 0, -0.6, 3900000), "EPSG:32636")
    scene = Scene(grid, grey[None].astype(np.uint8), ("grey",), np.ones(grey.shape, bool))
    found = gf.detect_obstacles(scene, strategy="study_listing", grey_check=check)
    assert len(found) == count
    told = found.attrs["detection"].get("grey_limit")
    assert told == (pytest.approx(grey.mean()) if check == "relative" else limit)
