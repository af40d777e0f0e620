"""Networks of the package: loaded once, named channels, any thread, other processes."""

import itertools
import pickle
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from hashlib import sha256
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from geofield.errors import GeofieldError
from geofield.field.looks import seen
from geofield.field.network import BANDS, POINTS, features, points_maps
from geofield.learned import facts, network
from geofield.obstacles.crowns import (
    CELL_PX,
    OVERLAP_PX,
    REACH_CELLS,
    SPREAD_CELLS,
    answers,
    centres,
)


@pytest.fixture(scope="module")
def crowns():
    return network("crowns")


CORNER_PX, SIDE_PX = 80, 156
"""Of a part that is 208 px wide as the network sees it: it halves that four times."""


@pytest.fixture(scope="module")
def factor(simulated):
    """Pixels of the simulated field along one that the network sees."""
    from geofield.obstacles.picture import working_factor

    return working_factor(simulated.scene.grid.ground_resolution_m)


@pytest.fixture(scope="module")
def picture(simulated, factor):
    """A part of a simulated field with trees, normalised, as the network sees it."""
    from geofield.obstacles.picture import tone_of, working_bands

    part = simulated.scene.crop(CORNER_PX, CORNER_PX, SIDE_PX, SIDE_PX)
    return working_bands(part, tone_of(simulated.scene), factor)


@pytest.fixture(scope="module")
def trees(simulated, factor):
    """x, y and radius of the trees in that part, not on its border, pixels that are seen."""
    every = simulated.obstacles[["x_px", "y_px", "radius_px"]].to_numpy()
    every = every - [CORNER_PX, CORNER_PX, 0]
    inner = (every[:, :2] > 8) & (every[:, :2] < SIDE_PX - 8)
    assert inner.all(axis=1).sum() >= 2
    return every[inner.all(axis=1)] / factor


def test_every_channel_of_the_network_has_a_part(crowns, picture):
    """Two inputs swapped change the answer, whichever they are."""
    right = crowns(crowns.stacked(**picture))
    names = list(crowns.inputs)
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            swapped = picture | {one: picture[other], other: picture[one]}
            change = np.abs(crowns(crowns.stacked(**swapped)) - right).max()
            assert change > 0.05, (one, other)


def test_outputs_are_what_their_names_say(crowns, picture, trees):
    named = crowns.named(crowns.stacked(**picture))
    assert tuple(named) == crowns.outputs
    for x, y, radius in trees:
        at = int(y // 2), int(x // 2)
        near = np.s_[at[0] - 2 : at[0] + 3, at[1] - 2 : at[1] + 3]
        assert named["centre"][near].max() > named["centre"].mean() + 3
        assert named["cover"][at] > 0
        assert np.exp(named["log_radius"][at]) == pytest.approx(radius, rel=0.35)


def noticed(named, trees):
    """How far from the truth answers are: votes missing, places, radii, cover and other things."""
    found = centres(named)
    far = np.hypot(found.x_px[:, None] - trees[:, 0], found.y_px[:, None] - trees[:, 1])
    nearest = far.argmin(axis=0)
    row, column = (trees[:, 1] // 2).astype(int), (trees[:, 0] // 2).astype(int)
    return np.array(
        [
            far.min(axis=0),
            np.log(found.radius_px[nearest] / trees[:, 2]),
            np.log(found.strength[nearest]),
            named["cover"][row, column],
            named["other"][row, column],
        ]
    )


def test_every_output_of_the_network_has_a_part(crowns, picture, trees, monkeypatch):
    """Two outputs swapped in the model's description change what is found, whichever they are."""
    right = noticed(answers(picture), trees)
    assert (right[0] < 3).all()
    assert (np.abs(right[1]) < 0.35).all()
    assert (right[3] > 0.5).all()
    assert (right[4] < 0.5).all()
    for one, other in itertools.combinations(crowns.outputs, 2):
        order = [{one: other, other: one}.get(name, name) for name in crowns.outputs]
        model = replace(crowns, outputs=tuple(order))
        monkeypatch.setattr("geofield.obstacles.crowns.network", lambda _, model=model: model)
        try:
            change = np.abs(noticed(answers(picture), trees) - right)
        except (ValueError, IndexError):
            continue  # nothing is found any more
        assert not change.max() < 0.1, (one, other)


def test_every_channel_of_the_outlines_network_has_a_part(simulated):
    """Two inputs swapped change the answer, whichever they are."""
    outlines = network("outline")
    assert outlines.inputs == (*BANDS, *POINTS)
    picture = seen(simulated.scene, outlines)
    bands = picture.bands(picture.whole)
    maps = points_maps([(128.5, 120.5), (90.5, 150.5)], [(10.5, 20.5)])

    def answer(bands, maps):
        return outlines.steps[1](*features(outlines, bands), maps[None])[0]

    right = answer(bands, maps)
    for i, j in itertools.combinations(range(len(BANDS)), 2):
        assert np.abs(answer(swapped(bands, i, j), maps) - right).max() > 0.05, (BANDS[i], BANDS[j])
    for i, j in itertools.combinations(range(len(POINTS)), 2):
        change = np.abs(answer(bands, swapped(maps, i, j)) - right).max()
        assert change > 0.05, (POINTS[i], POINTS[j])


def swapped(channels, i, j):
    order = np.arange(len(channels))
    order[[i, j]] = j, i
    return channels[order]


def test_every_feature_that_one_step_hands_to_the_next_has_a_part(simulated):
    outlines = network("outline")
    picture = seen(simulated.scene, outlines)
    known = features(outlines, picture.bands(picture.whole))
    assert outlines.steps[0].gives == outlines.steps[1].takes[:-1]
    maps = points_maps([(128.5, 120.5)], [])[None]
    (right,) = outlines.steps[1](*known, maps)
    for number, name in enumerate(outlines.steps[0].gives):
        other = [one[:, ::-1] if k == number else one for k, one in enumerate(known)]
        assert np.abs(outlines.steps[1](*other, maps)[0] - right).max() > 0.05, name


def test_threads_and_pickles_get_the_same_answer(crowns, picture):
    batch = crowns.stacked(**picture)
    right = crowns(batch)
    again = pickle.loads(pickle.dumps(crowns))
    assert again is crowns
    with ThreadPoolExecutor(4) as pool:
        for other in pool.map(crowns, [batch] * 8):
            assert np.array_equal(other, right)


def test_wrong_channels_are_refused(crowns, picture):
    with pytest.raises(ValueError, match="takes"):
        crowns(np.zeros((1, 3, 32, 32), np.float32))
    with pytest.raises(ValueError, match="takes"):
        crowns.stacked(red=0.0)
    with pytest.raises(ValueError, match="zip"):
        network("outline").steps[1](np.zeros((1, 24, 64, 64), np.float32))


def test_an_unknown_network_is_told(tmp_path):
    with pytest.raises(GeofieldError, match=r"oaks.*this installation"):
        network("oaks")
    with pytest.raises(GeofieldError, match=r"outline.*" + re.escape(str(tmp_path))):
        network("outline", tmp_path)


def test_a_network_of_another_folder_is_told_from_that_of_the_package(tmp_path):
    package = files("geofield.learned")
    for file in ("outline.json", "outline.onnx", "outline_points.onnx"):
        (tmp_path / file).write_bytes((package / file).read_bytes())
    other, own = network("outline", tmp_path), network("outline")
    assert other is not own
    assert (other.folder, own.folder) == (tmp_path, None)
    assert pickle.loads(pickle.dumps(other)) is other
    assert pickle.loads(pickle.dumps(own)) is own


def test_the_model_files_stay_small_and_honest():
    known = facts("crowns")
    assert len((files("geofield.learned") / "crowns.onnx").read_bytes()) < 1.5e6
    for kind in ("nir", "rgb", "grey"):
        curve = known["calibration"][kind]
        assert np.all(np.diff(curve["answer"]) > 0)
        assert np.all(np.diff(curve["probability"]) >= 0)
        # On sites that the curve itself was not fitted to.
        assert known["left_out"][kind]["calibration_error"] <= 0.04


@pytest.mark.parametrize(("name", "files_here"), [("outline", 4), ("crowns", 1)])
def test_a_model_was_learned_from_what_lies_here(name, files_here):
    """A table that grew, or another network before this one, asks for learning again."""
    known = facts(name)["learned_with"]["sha256"]
    root = Path(__file__).parents[2]
    here = [*root.glob("benchmarks/field_labels*.csv"), *root.glob("src/geofield/learned/*.onnx")]
    learned = {file.name: sha256(file.read_bytes()).hexdigest() for file in here}
    told = {file: digest for file, digest in known.items() if file in learned}
    assert len(told) == files_here
    assert told == {file: learned[file] for file in told}


def test_windows_overlap_by_what_the_network_sees(crowns):
    """Cells answer by what lies around them; their votes then reach and spread a little farther."""
    reach_px = int(OVERLAP_PX - CELL_PX * (REACH_CELLS + 4 * SPREAD_CELLS + 2))
    side, middle = 512, 256
    rng = np.random.default_rng(0)
    near, far = rng.normal(size=(2, len(crowns.inputs), side, side)).astype(np.float32).clip(-1, 1)
    away = np.abs(np.arange(side) + 0.5 - middle) > reach_px
    cells = slice((middle - CELL_PX) // CELL_PX, (middle + CELL_PX) // CELL_PX)

    def middle_cells(columns, rows):
        other = near.copy()
        other[:, rows], other[:, :, columns] = far[:, rows], far[:, :, columns]
        seen = answers(dict(zip(crowns.inputs, other, strict=True)))
        return np.stack([each[cells, cells] for each in seen.values()])

    nothing, something = (
        np.zeros(side, bool),
        np.abs(np.arange(side) + 0.5 - middle) > reach_px // 2,
    )
    assert np.array_equal(middle_cells(away, away), middle_cells(nothing, nothing))
    assert not np.array_equal(middle_cells(something, nothing), middle_cells(nothing, nothing))
