"""The panel and the clicks, with layers that are edited, doubled, filtered or read-only."""

from __future__ import annotations

from pathlib import Path

import pytest
from plugin_place import SAMPLE

from geofield.formats import read_dataset
from geofield.plan import read_plan


def test_saving_takes_no_edits_of_another_layer(panel, plan):
    seen = panel("saved_with_edits", plan=plan)
    assert "Segments has edits that are not saved" in seen["said"][-1]
    assert seen["still_edited"]
    # Once those are gone, the plan is written, and a doubled layer shows the new one, too.
    rows = len(read_dataset(Path(plan)).table("segments"))
    assert seen["shown"] == [rows, rows]
    assert rows < seen["before"]
    assert "1 rejected" in seen["rejected"]


def test_obstacles_that_a_filter_hides_are_driven_around(panel, plan):
    seen = panel("filtered", plan=plan)
    assert seen["count"] == "3 left to look at"
    assert seen["figures"][0] == seen["figures"][1]


def test_what_cannot_be_edited_is_told_as_it_is_written(panel, plan):
    said = "".join(panel("read_only", plan=plan))
    assert "read-only" in said
    assert "The layer <b>A & B</b> is edited" in said


def test_a_radius_of_nothing_is_none(panel, plan):
    assert panel("without_radius", plan=plan) == [None, pytest.approx(1.0)]


def test_a_project_saved_while_a_plan_is_written_has_its_layers(panel, plan, tmp_path):
    seen = panel("project_saved_meanwhile", plan=plan, home=str(tmp_path))
    assert seen["after"] == seen["before"]
    assert {"field", "obstacles", "segments", "tracks"} <= set(seen["after"])
    assert seen["alias"] == "Course"
    assert seen["coloured"] == "QgsRuleBasedRenderer"


def test_a_project_closed_after_saving_and_editing_again(panel, plan):
    seen = panel("discarded", plan=plan)
    assert seen == {"edited": 1, "troubles": [], "title": "Review of a field"}


def test_the_map_is_given_back_to_the_tool_of_before(panel, plan):
    assert panel("tools", plan=plan) == {
        "escaped": True, "slips": 0, "drawn": 1, "given_back": True,
    }  # fmt: skip


def test_keys_are_the_panels_on_the_map_and_in_the_panel(panel, plan):
    seen = panel("keys", plan=plan)
    assert seen == {"larger_m": pytest.approx(0.5), "rejected": "rejected", "others": 0}


def test_undo_knows_what_it_took_back(panel, plan):
    seen = panel("undone", plan=plan)
    one, other, gone = seen["ids"]
    assert seen["found"] == [[], [gone], [other], [one], []]
    (drawn,) = seen["again"][3]
    assert seen["again"] == [[one], [other], [], [drawn], []]
    assert seen["looked"] == 0


def test_what_was_taken_back_is_made_again_by_the_key_of_qgis(panel, plan):
    seen = panel("redone", plan=plan)
    status, before, *_ = seen["opened"]
    after = seen["rejected"][1]
    assert before != after
    assert seen["rejected"] == ["rejected", after, True, False]
    # Ctrl+Shift+Z is QGIS's own, where the active layer is in editing.
    assert seen["undone"] == seen["of_another"] == [status, before, False, True]
    assert seen["redone"] == ["rejected", after, True, False]
    assert seen["at"] in ([True, "Redo  (Ctrl+Shift+Z)"], [True, "Redo  (Ctrl+Y)"])


def test_the_route_before_the_edits_is_not_shown_until_they_are_saved(panel, plan, geofield):
    words = ("--headland", 8, "--route", "boustrophedon", "--turning-radius", 3)
    geofield("tracks", plan, *words, "-o", plan, "--overwrite")
    around_m = read_dataset(Path(plan)).table("headland_tracks").length.sum()
    seen = panel("routed", plan=plan)
    waits = "The route is planned anew when the edits are saved."
    assert waits not in seen["opened"]
    said, shown = seen["edited"]
    assert waits in said
    assert shown == [False, False, False]
    assert seen["around_m"] == pytest.approx(around_m, rel=0.05)
    said, shown = seen["saved"]
    assert waits not in said
    assert shown == [True, True, True]


def test_doubts_notes_and_legend_are_german_in_a_german_qgis(panel, plan, geofield):
    geofield("tracks", plan, "--spacing", 6, "--width", 4, "-o", plan, "--overwrite")
    doubts = "it is only 9.5 m wide (a way?); much of its course is crooked"
    seen = panel("in_german", plan=plan, doubts=doubts)
    assert seen["doubts"].split("; ") == [
        "es ist nur 9,5 m breit (ein Weg, ein Streifen?)", "vieles an seinem Verlauf ist krumm",
    ]  # fmt: skip
    figures, *notes = seen["figures"].splitlines()
    assert figures.startswith("Spuren: ")
    assert notes[0].startswith("Zwischen den Spuren bleiben 2,00 m unbearbeitet: ")
    # The legend, too; in the file it is as others open it.
    assert {"Feld", "Hindernisse", "Fahrspuren", "Bild"} <= set(seen["layers"])
    assert seen["legend"][:2] == ["Bestätigt", "Gefunden"]
    assert seen["styled"]
    assert seen["in_file"][:2] == ["Confirmed", "Detected"]


def test_clicks_go_on_whatever_becomes_of_message_and_map(panel, tmp_path):
    # What is in the way of a folder beside the project: nothing can be written there.
    (tmp_path / "geofield").write_text("")
    seen = panel("clicks", picture=str(SAMPLE), lon=33.531142, lat=35.075373, home=str(tmp_path))
    one, again = seen["plans"]
    assert one == again
    assert not Path(one).is_relative_to(tmp_path)
    (place,) = read_plan(Path(one)).settings.field.include
    assert place == pytest.approx((33.531442, 35.075673), abs=1e-7)
    assert {"Field", "Obstacles", "Tracks"} <= set(seen["first"])
    assert seen["gone"] == ["picture"]
    assert "Field" in seen["stopped"]
