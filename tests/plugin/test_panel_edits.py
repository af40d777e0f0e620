"""The panel with what QGIS's own tools do to a plan: outlines, deletions, saved projects."""

from __future__ import annotations

from pathlib import Path

import pytest
from plugin_place import SAMPLE

from geofield.formats import read_dataset
from geofield.plan import read_plan


def test_tracks_follow_the_outline_too(panel, plan):
    seen = panel("outline", plan=plan)
    before, edited, saved, again, by_qgis = seen["found"]
    clean, starred = "Review of a field", "Review of a field *"
    assert [each[1] for each in (before, edited, saved, again)] == [clean, starred, clean, starred]
    assert len({each[0] for each in (before, edited, again)}) == 3
    # Saved by QGIS's own button, the plan is planned again as well.
    tracks = read_plan(Path(plan)).tracks
    assert by_qgis == [again[0], len(tracks.lines)]
    assert f"Tracks: {len(tracks.lines)}, segments: {len(tracks.segments)}" in by_qgis[0]
    assert read_plan(Path(plan)).field.method == "drawn"
    assert seen["said"] == []


def test_an_outline_that_is_not_one_polygon_is_told(panel, plan):
    seen = panel("outline_cut", plan=plan)
    assert seen["cut"] == seen["gone"] == ["geofield: The outline is not one polygon."]


def test_no_edit_is_taken_while_the_plan_is_written(panel, plan):
    seen = panel("while_written", plan=plan)
    assert seen["editing"] is False
    assert seen["opened"] == [False, True]
    assert seen["after"] == [True, "20 left to look at, 1 rejected", []]
    assert seen["unloaded"] == [f"{plan}|layername=obstacles", 21]


def test_keys_speak_of_what_was_drawn_and_of_nothing_that_is_gone(panel, plan):
    seen = panel("deleted_and_drawn", plan=plan)
    assert seen["deleted"] == [0, False]
    assert seen["larger"] == pytest.approx(3.25, abs=0.01)
    assert seen["drawn"] == ["added", None]
    assert seen["bare"] == [True, None]
    assert seen["said"] == []
    (drawn,) = read_dataset(Path(plan)).table("obstacles").query("status == 'added'").geometry
    assert (drawn.area / 3.1416) ** 0.5 == pytest.approx(3.25, abs=0.01)


def test_what_became_read_only_is_told(panel, plan):
    seen = panel("made_read_only", plan=plan)
    assert seen["steps"] == 0
    assert seen["said"] == ["geofield: The obstacles are read-only here: nothing can be decided."]


def test_a_key_means_the_obstacle_that_is_marked(panel, plan):
    """As `Find the obstacles` in the toolbox does with the plan that is open in the panel."""
    seen = panel("numbered_anew", plan=plan)
    assert seen["found"] == [[], [seen["was"]]]
    assert seen["said"] == ["geofield: The plan was changed outside of this panel: look again."]


def test_edits_that_the_panel_takes_over_are_sketched(panel, plan):
    assert panel("taken_over", plan=plan) == [False, True, False, True]


def test_the_outline_may_be_removed_from_the_project(panel, plan):
    count, said, title = panel("removed", plan=plan)
    assert count == "20 left to look at, 1 rejected"
    assert said == []
    assert title == "Choose a layer of a plan, then press the button."


def test_a_key_that_is_held_decides_once(panel, plan):
    assert panel("held", plan=plan) == {"rejected": 1, "stepped": True}


def test_a_project_saved_with_a_sketch_shows_the_tracks(panel, plan, tmp_path):
    before, sketched, saved, again = panel("project_with_sketch", plan=plan, home=str(tmp_path))
    assert before == again
    assert "Tracks" in before
    assert "Tracks" not in sketched
    assert sketched == saved


def test_several_fields_are_told_once_with_what_to_do(panel, geofield, tmp_path):
    places = tmp_path / "places.csv"
    places.write_text("name,lat,lon\na,35.075373,33.531142\nb,35.0765,33.5325\n")
    geofield("batch", places, SAMPLE, "--workers", 1, "--out", tmp_path / "farm")
    seen = panel("farm", plan=str(tmp_path / "farm" / "farm.gpkg"))
    (said,) = seen["said"]
    assert "this file has 2" in said
    assert "geofield farm put" in said
    assert "2 rejected" in seen["count"]
    told = geofield("farm", "put", tmp_path / "farm" / "farm.gpkg", tmp_path / "farm")
    assert "a of" in f"{told}"
    assert "is now as you left it" in f"{told}"


@pytest.mark.parametrize(
    ("gone", "back"),
    [
        (["field"], ["Field"]),
        (["obstacles", "tracks"], ["Obstacles"]),
        (["field", "obstacles"], ["Field", "Obstacles"]),
    ],
)
def test_a_plan_is_found_by_any_of_its_layers(panel, plan, gone, back):
    whole = panel("taken_out", plan=plan, gone=[])
    seen = panel("taken_out", plan=plan, gone=gone)
    assert seen["found"]
    assert seen["said"] == []
    assert seen["back"] == back
    assert seen["title"] == whole["title"]
    assert "2 rejected" in seen["count"]
    assert seen["groups"] == 1
    assert set(whole["order"]) - set(seen["order"]) == ({"Tracks"} if "tracks" in gone else set())


def test_a_plan_whose_file_is_away_is_told_and_opened_when_it_is_back(panel, plan, tmp_path):
    first, reopened = panel("away", plan=plan, home=str(tmp_path))
    for found, said, back, _ in (first, reopened):
        assert not found
        assert f"{plan} is not there" in said[0]
        assert back
    assert "1 rejected" in first[-1]
    assert "2 rejected" in reopened[-1]


def test_a_layer_of_a_moved_plan_goes_into_its_group(panel, plan, tmp_path):
    found, groups = panel("moved", plan=plan, home=str(tmp_path))
    assert found
    (group,) = groups
    assert "Field" in group


def test_the_wide_buttons_are_as_wide_as_the_panel(panel, plan):
    opens, saves = panel("laid_out", plan=plan)
    assert opens == saves
