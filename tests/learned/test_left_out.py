"""Models learned without a fold of sites each: figures are taken of sites they have not seen."""

import pickle
import re
import subprocess
import sys
from collections import Counter
from hashlib import sha256
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from geofield.field.learned import shipped
from geofield.field.network import ANSWER_PX, BANDS, POINTS, SIDE_PX
from geofield.field.ranking import trained
from geofield.learned import facts

sys.path.insert(0, str(Path(__file__).parents[2] / "tools"))
import outline_cases
from outline_cases import FOLDS, LEFT_OUT, ROOT, TABLES, fold_of, left_out, sites


def sites_of(fold):
    return set(facts(f"outline_{fold}", LEFT_OUT)["sites"])


@pytest.mark.parametrize("fold", range(FOLDS))
def test_a_network_has_seen_all_sites_but_those_of_its_fold(fold, shared):
    known = facts(f"outline_{fold}", LEFT_OUT)
    assert known["learned_with"]["without"] == [fold, FOLDS]
    assert sites_of(fold) == {site for site in sites() if fold_of(site) != fold}


def test_every_site_is_left_out_exactly_once():
    """Also where the pictures and one table are not beside the checkout."""
    seen = Counter(site for fold in range(FOLDS) for site in sites_of(fold))
    assert set(seen.values()) == {FOLDS - 1}
    for fold in range(FOLDS):
        assert {site for site in seen if site not in sites_of(fold)} == {
            site for site in seen if fold_of(site) == fold
        }


def test_what_is_shipped_has_learned_from_every_site(shared):
    known = facts("outline")
    assert known["learned_with"]["without"] == [None, FOLDS]
    assert set(known["sites"]) == sites()


def test_rankings_without_different_folds_are_different():
    tables = [trained(f"outline_ranking_{fold}", LEFT_OUT) for fold in range(FOLDS)]
    tables.append(trained())
    for number, one in enumerate(tables):
        for other in tables[:number]:
            assert one.names == other.names
            assert not np.array_equal(one.slope, other.slope)
            assert not np.array_equal(one.edge, other.edge)
            for kind, what in product(("first", "corrected"), ("field", "ground", "border")):
                assert one.calibration[kind][what] != other.calibration[kind][what]


def told(name, folder):
    return facts(name, folder)["learned_with"]["sha256"]


def digests(*names):
    """Of tables of outlines that lie here, and of networks."""
    here = [table for _, table, _ in TABLES if table.is_file()]
    here += [LEFT_OUT / name for name in names]
    return {file.name: sha256(file.read_bytes()).hexdigest() for file in here}


@pytest.mark.parametrize("fold", range(FOLDS))
def test_a_network_was_learned_from_the_tables_that_lie_here(fold):
    assert digests().items() <= told(f"outline_{fold}", LEFT_OUT).items()


@pytest.mark.parametrize("fold", [None, *range(FOLDS)])
def test_a_ranking_was_learned_behind_the_networks_of_its_folds(fold):
    """What is shipped behind all three, table K behind the two of the other folds."""
    others = [other for other in range(FOLDS) if other != fold]
    behind = [f"outline_{other}{step}.onnx" for other in others for step in ("", "_points")]
    known = (
        told("outline_ranking", None) if fold is None else told(f"outline_ranking_{fold}", LEFT_OUT)
    )
    assert {name for name in known if name.endswith(".onnx")} == set(behind)
    assert digests(*behind).items() <= known.items()


def test_a_missing_model_is_told_with_how_to_learn_it(tmp_path, monkeypatch):
    monkeypatch.setattr(outline_cases, "LEFT_OUT", tmp_path)
    with pytest.raises(FileNotFoundError, match=r"outline_1\.onnx.*train_outlines.py --without 1"):
        left_out.__wrapped__(1)


def test_a_network_that_has_seen_the_fold_judges_none_of_it(tmp_path, monkeypatch):
    """Whatever the file is called: outlines of the fold were learned from."""
    for file in (
        "outline_0.onnx",
        "outline_0_points.onnx",
        "outline_0.json",
        "outline_ranking_0.json",
    ):
        (tmp_path / file.replace("_0", "_1")).write_bytes((LEFT_OUT / file).read_bytes())
    monkeypatch.setattr(outline_cases, "LEFT_OUT", tmp_path)
    with pytest.raises(ValueError, match="learned from sites of fold 1"):
        left_out.__wrapped__(1)


ASKED = """
import pickle, sys
import numpy as np
known, bands, points, figures = pickle.load(sys.stdin.buffer)
sees, told = known.network.steps
ranking = known.ranking
again = told(*sees(bands), points)[0], ranking.scores(figures), ranking.exactness(figures)
pickle.dump((*again, ranking.calibration, known.network.folder), sys.stdout.buffer)
"""


@pytest.mark.parametrize("which", ["shipped", 0])
def test_what_was_learned_travels_to_other_processes(which):
    known = shipped() if which == "shipped" else left_out(which)
    rng = np.random.default_rng(2)
    bands = rng.normal(size=(1, len(BANDS), SIDE_PX, SIDE_PX)).astype(np.float32)
    points = rng.uniform(size=(1, len(POINTS), ANSWER_PX, ANSWER_PX)).astype(np.float32)
    names = known.ranking.names
    values = rng.normal(size=(3, len(names)))
    figures = [dict(zip(names, row, strict=True)) for row in values]
    answer = subprocess.run(
        [sys.executable, "-c", ASKED],
        input=pickle.dumps((known, bands, points, figures)),
        capture_output=True,
        check=True,
    ).stdout
    odds, scores, exactness, calibration, folder = pickle.loads(answer)
    sees, asked = known.network.steps
    assert np.array_equal(odds, asked(*sees(bands), points)[0])
    assert np.array_equal(scores, known.ranking.scores(figures))
    assert np.array_equal(exactness, known.ranking.exactness(figures))
    assert calibration == known.ranking.calibration
    assert folder == known.network.folder
    assert pickle.loads(pickle.dumps(known)).network is known.network


def test_nothing_that_is_installed_knows_the_left_out_models():
    """They lie in the repository only: whoever installs geofield has what is shipped."""
    place = re.compile(r"outline(_ranking)?_\{|tools[/\"', ]+left_out|outline_cases")
    for file in (ROOT / "src").rglob("*.py"):
        assert not place.search(file.read_text("utf-8")), file
    assert shipped().network.folder is None
    assert not [one for one in (ROOT / "src").rglob("outline_*") if re.search(r"_\d", one.name)]
