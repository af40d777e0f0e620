"""Other outlines that are offered: which they are, and that to ask for them changes nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely

from geofield.field import extract_field
from geofield.field.answer import doubtful
from geofield.field.likely import Candidate, Likely, likeliest, other_outlines
from geofield.field.ranking import trained
from geofield.field.search import WindowSearch, search_field
from geofield.simulate import SimulationSettings, simulate_field


def candidate(polygon: shapely.Polygon, score: float) -> Candidate:
    return Candidate(polygon, np.zeros((1, 1), bool), {}, score)


def taken(one: Candidate, certainty: float = 0.6) -> Likely:
    return Likely(one, certainty, certainty + 0.1, certainty - 0.1)


def test_most_doubt_adds_up_where_a_wide_piece_is_doubtful():
    likely = np.full((120, 160), 0.02, np.float32)
    likely[20:100, 20:120] = 0.98
    # A narrow strip that is doubted more than a wide piece, on either side of the border.
    likely[20:100, 20:23], likely[40:80, 80:120] = 0.55, 0.7
    likely[10:13, 20:120], likely[60:100, 120:150] = 0.45, 0.3
    (inside, belongs), (outside, belong_too) = doubtful(likely, likely > 0.5)
    assert (belongs, belong_too) == (False, True)
    assert shapely.box(80, 40, 120, 80).contains(shapely.Point(inside))
    assert shapely.box(120, 60, 150, 100).contains(shapely.Point(outside))


def test_ground_that_fills_the_picture_is_doubted_inside_alone():
    likely = np.full((60, 60), 0.9, np.float32)
    likely[:20] = 0.6
    ((x, y), belongs), *others = doubtful(likely, likely > 0.5)
    assert not belongs
    assert not others
    assert 0 < x < 60
    assert 0 < y < 20


def test_what_is_offered_covers_what_may_be_meant_and_not_twice_the_same():
    own = candidate(shapely.box(0, 0, 100, 100), 2.0)
    # Half of it is believed in most, in two outlines alike; least in a scrap.
    half, alike = (candidate(shapely.box(0, 0, 50 + more, 100), 1.0) for more in (0, 2))
    wide = candidate(shapely.box(0, 0, 160, 100), 0.0)
    scrap = candidate(shapely.box(0, 0, 100, 20), -4.0)
    same = candidate(shapely.box(0, 0, 98, 100), 1.9)
    others = other_outlines(taken(own), [own, same, half, alike, wide, scrap])
    grounds = [one.candidate for one in others]
    assert grounds[0] in (half, alike)
    assert grounds[1:] == [wide]
    sure = [one.certainty for one in others]
    assert sure == sorted(sure, reverse=True)
    # Both are dealt from what the taken one leaves; the scrap keeps the rest of it.
    assert 0.39 < sum(sure) < 0.4


def test_one_other_ground_is_offered_once():
    own = candidate(shapely.box(0, 0, 100, 100), 2.0)
    half = candidate(shapely.box(0, 0, 50, 100), 1.0)
    assert [one.candidate for one in other_outlines(taken(own), [own, half])] == [half]


def test_nothing_offered_is_surer_than_what_is_taken():
    own = candidate(shapely.box(0, 0, 100, 100), 2.0)
    half = candidate(shapely.box(0, 0, 50, 100), 1.0)
    (other,) = other_outlines(taken(own, certainty=0.2), [own, half])
    assert (other.certainty, other.ground) == pytest.approx((0.2, 0.3))


def test_what_is_nearly_offered_gives_way_to_other_ground():
    own = candidate(shapely.box(0, 0, 100, 100), 2.0)
    half, nearly = (candidate(shapely.box(0, 0, x, 100), 1.5) for x in (50, 59))
    wide = candidate(shapely.box(0, 0, 160, 100), 1.0)
    first, second = other_outlines(taken(own), [own, nearly, half, wide])
    assert first.candidate in (half, nearly)
    assert second.candidate is wide


def test_no_outline_is_told_as_quite_certain():
    """Whatever its figures say: a picture cannot show whose field it is."""
    ranking = trained()
    figures = {**dict.fromkeys(ranking.names, 0.0), "network_overlap": 9.0, "corrections": 0.0}
    sure = {what: {"constant": 50.0} for what in ("field", "ground", "border")}
    all_sure = replace(ranking, calibration={"first": sure})
    own = replace(candidate(shapely.box(0, 0, 100, 100), 2.0), figures=figures)
    told = likeliest([own], all_sure)
    assert told.candidate is own
    assert (told.certainty, told.ground, told.border) == (0.99, 0.99, 0.99)


def test_the_same_ground_is_no_alternative():
    own = candidate(shapely.box(0, 0, 100, 100), 0.0)
    same = candidate(shapely.box(0, 0, 95, 100), 0.0)
    assert other_outlines(taken(own), [own, same]) == []


@pytest.mark.parametrize("seed", [3, 11])
def test_imagined_outlines_hold_the_point_and_change_nothing_that_is_found_later(seed: int):
    one = simulate_field(seed, SimulationSettings(width_px=256, height_px=256))
    at = one.scene.pixel_of(lat=one.lat, lon=one.lon)
    asked, unasked = search_field(one.scene, *at), search_field(one.scene, *at)
    first, _ = asked.answer()
    imagined = asked.imagined()
    assert imagined
    for each in imagined:
        assert each.polygon.contains(shapely.Point(asked.seed_px))
        assert each.figures["corrections"] == 0
    # Some of them are none that were found.
    assert {each.polygon for each in imagined} - {each.polygon for each in first}
    beside = ((asked.seed_px[0] + 9.0, asked.seed_px[1] + 5.0),)
    later, _ = asked.answer((), beside)
    assert [each.polygon for each in later] == [
        each.polygon for each in unasked.answer((), beside)[0]
    ]


@pytest.mark.filterwarnings("ignore::geofield.errors.FieldWarning")
def test_other_ground_is_asked_for_where_the_outline_is_doubtful_and_is_offered(monkeypatch):
    plain = simulate_field(11, SimulationSettings(width_px=256, height_px=256))
    hazy = np.rint(0.02 * plain.scene.bands + 120).astype(np.uint8)
    doubtful_scene = replace(plain.scene, bands=hazy)
    at: Any = {"lat": plain.lat, "lon": plain.lon}
    asked: list[list[Candidate]] = []
    ask = WindowSearch.imagined

    def recorded(search: WindowSearch) -> list[Candidate]:
        asked.append(ask(search))
        return asked[-1]

    monkeypatch.setattr(WindowSearch, "imagined", recorded)
    assert len(extract_field(plain.scene, **at).alternatives) == 1
    assert not asked, "it is rather certain"
    offered = extract_field(doubtful_scene, **at).alternatives
    assert len(asked) == 1
    extract_field(doubtful_scene, **at, include=[(plain.lon + 1e-5, plain.lat)])
    assert len(asked) == 1, "who gives further points is not asked"
    monkeypatch.setattr(WindowSearch, "imagined", lambda search: [])
    unasked = extract_field(doubtful_scene, **at).alternatives
    assert offered[0] == unasked[0], "the outline taken is the same"
    assert {one.polygon for one in offered} - {one.polygon for one in unasked}
