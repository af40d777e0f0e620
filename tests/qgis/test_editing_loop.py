"""A person edits the plan in QGIS; planning again keeps every word of theirs."""

from __future__ import annotations

import sqlite3
from contextlib import closing

import pytest
import shapely
from click.testing import CliRunner
from formats_plan import ORIGIN, make_dataset

from geofield.cli.tracks import tracks
from geofield.errors import FormatWarning, TrackWarning
from geofield.formats import read_dataset, write_dataset
from geofield.model import Field, Provenance
from geofield.model.evidence import outline_record
from geofield.notes import listening


def placed(*xy):
    """WKT of a polygon in metres from the field's corner."""
    return shapely.to_wkt(shapely.Polygon([(x + ORIGIN[0], y + ORIGIN[1]) for x, y in xy]))


def plan_again(path):
    """As a person does it: `geofield tracks field.gpkg --spacing 5 -o field.gpkg`."""
    words = [str(path), "--spacing", "5", "-o", str(path)]
    with listening(TrackWarning):  # a segment lies in an obstacle's hole
        done = CliRunner().invoke(tracks, words, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return read_dataset(path)


@pytest.fixture
def plan_file(tmp_path):
    dataset = make_dataset(points=False)
    # A real plan: with what stage 2 records of an outline, not the test data's own evidence.
    outline = Field(dataset.table("field").geometry.iloc[0], dataset.crs)
    write_dataset(
        type(dataset)(
            {name: dataset.tables[name] for name in ("field", "obstacles")},
            dataset.crs,
            dataset.name,
            Provenance(evidence={"field": {"outline": outline_record(outline.polygon)}}),
            dataset.grid,
        ),
        tmp_path,
        ["gpkg"],
    )
    path = tmp_path / "field.gpkg"
    plan_again(path)
    return path


def crossing(dataset, shape):
    return int(shapely.intersects(dataset.table("segments").geometry.to_numpy(), shape).sum())


def test_status_from_the_list(plan_file, qgis):
    before = read_dataset(plan_file).table("obstacles")
    first = before.geometry.iloc[0].buffer(-0.1)
    assert crossing(read_dataset(plan_file), first) == 0
    done = qgis(
        "edit",
        path=str(plan_file),
        changes=[
            {"layer": "obstacles", "where": "obstacle_no = 1", "values": {"status": "rejected"}},
            {"layer": "obstacles", "where": "obstacle_no = 3", "values": {"status": "confirmed"}},
        ],
    )
    assert done == {"done": 2}
    after = plan_again(plan_file)
    table = after.table("obstacles").set_index("obstacle_no")
    assert table.loc[1, "status"] == "rejected"
    assert table.loc[3, "status"] == "confirmed"
    assert crossing(after, first) > 0  # tracks run where the rejected tree was
    assert crossing(after, table.geometry.loc[3].buffer(-0.1)) == 0


def test_shapes_sizes_and_deletions(plan_file, qgis):
    before = read_dataset(plan_file).table("obstacles").set_index("obstacle_no")
    larger = shapely.to_wkt(before.geometry[1].buffer(3), rounding_precision=-1)
    done = qgis(
        "edit",
        path=str(plan_file),
        changes=[
            {"layer": "obstacles", "where": "obstacle_no = 1", "wkt": larger},
            {"layer": "obstacles", "where": "obstacle_no = 2", "values": {"buffer_m": 5.0}},
            {"layer": "obstacles", "where": "obstacle_no = 4", "delete": True},
        ],
    )
    assert done == {"done": 3}
    for _ in range(2):
        after = plan_again(plan_file)
        table = after.table("obstacles").set_index("obstacle_no")
        assert list(table.index) == [1, 2, 3]
        assert table.geometry.area[1] == pytest.approx(before.geometry[1].buffer(3).area, rel=1e-6)
        assert table["status"][1] == "confirmed"
        assert table["buffer_m"][2] == 5.0
        assert table.geometry.area[2] > before.geometry.area[2] * 1.2
        assert crossing(after, table.geometry[1].buffer(-0.1)) == 0
        assert table.geometry[3].equals(before.geometry[3])


def test_a_drawn_obstacle_is_avoided_and_numbered(plan_file, qgis):
    drawn = placed((20, 28), (26, 28), (26, 33), (20, 33))
    done = qgis("edit", path=str(plan_file), changes=[{"layer": "obstacles", "wkt": drawn}])
    assert done == {"done": 1}
    after = plan_again(plan_file)
    table = after.table("obstacles")
    (new,) = table[~table["obstacle_no"].isin([1, 2, 3, 4])].to_dict("records")
    assert new["status"] == "added"
    assert new["obstacle_no"] == 5
    assert crossing(after, shapely.from_wkt(drawn).buffer(-0.1)) == 0
    # And a second round changes nothing.
    again = plan_again(plan_file)
    assert list(again.table("obstacles")["status"]) == list(table["status"])
    assert again.table("segments").equals(after.table("segments"))


def test_a_moved_outline_is_kept(plan_file, qgis):
    moved = placed((0, 0), (60, 0), (60, 38), (0, 38))
    done = qgis(
        "edit", path=str(plan_file), changes=[{"layer": "field", "where": "TRUE", "wkt": moved}]
    )
    assert done == {"done": 1}
    after = plan_again(plan_file)
    outline = after.table("field").geometry.iloc[0]
    assert outline.equals(shapely.from_wkt(moved))
    assert after.table("field")["method"].iloc[0] == "drawn"
    assert shapely.covered_by(
        after.table("segments").geometry.to_numpy(), outline.buffer(0.01)
    ).all()


def test_tracks_that_are_deleted_and_drawn(plan_file, qgis):
    before = read_dataset(plan_file)
    drawn = shapely.LineString([(ORIGIN[0] + x, ORIGIN[1] + y) for x, y in ((8, 3), (30, 30))])
    changes = [
        {"layer": "tracks", "where": "track_no = 2", "delete": True},
        {"layer": "segments", "where": "track_no = 3", "delete": True},
        {"layer": "tracks", "wkt": shapely.to_wkt(shapely.MultiLineString([drawn]))},
    ]
    assert qgis("edit", path=str(plan_file), changes=changes) == {"done": 3}
    for _ in range(2):
        after = plan_again(plan_file)
        numbers = set(before.table("tracks")["track_no"])
        new = set(after.table("tracks")["track_no"]) - numbers
        assert numbers - set(after.table("tracks")["track_no"]) == {2, 3}
        assert set(after.table("segments")["track_no"]) == (numbers | new) - {2, 3}
        (own,) = (after.table("segments").query("track_no == @each") for each in new)
        assert drawn.buffer(0.01).covers(shapely.union_all(own.geometry.to_numpy()))
        obstacles = after.table("obstacles")
        for obstacle in obstacles[obstacles["status"] != "rejected"].geometry:
            assert crossing(after, obstacle.buffer(-0.1)) == 0


def test_a_column_that_a_person_added_survives(plan_file, qgis):
    import pyogrio

    frame = pyogrio.read_dataframe(plan_file, layer="obstacles")
    frame["note"] = ["ask Anna", None, None, "old shed"]
    pyogrio.write_dataframe(
        frame, plan_file, layer="obstacles", driver="GPKG", append=False, geometry_type="Polygon"
    )
    assert read_dataset(plan_file).table("obstacles")["note"].iloc[0] == "ask Anna"
    after = plan_again(plan_file)
    assert "note" in after.table("obstacles").columns
    assert after.table("obstacles")["note"].iloc[3] == "old shed"


def test_the_styles_are_still_there_after_planning_again(plan_file, qgis):
    plan_again(plan_file)
    opened = qgis("project", uri=str(plan_file.with_suffix(".qgz")))
    assert opened["bad"] == []
    assert opened["layers"]["geofield_tracks"]["renderer"] == "RuleRenderer"


def test_a_project_and_a_style_that_were_saved_in_qgis_stay(plan_file, qgis):
    project = plan_file.with_suffix(".qgz")
    first = project.read_bytes()
    plan_again(plan_file)
    assert project.read_bytes() == first  # nobody's but geofield's: written anew, and the same
    for uri in (str(project), f"geopackage:{plan_file}?projectName=field"):
        assert qgis("save_project", uri=uri, title="Mine")
    own = "UPDATE layer_styles SET styleQML = '<qgis/>' WHERE f_table_name = 'obstacles'"
    read = (
        "SELECT content FROM qgis_projects UNION ALL "
        "SELECT styleQML FROM layer_styles WHERE useAsDefault AND f_table_name = 'obstacles'"
    )
    with closing(sqlite3.connect(plan_file)) as file, file:
        file.execute(own)
        kept = file.execute(read).fetchall()
    saved = project.read_bytes()
    assert saved != first
    with pytest.warns(FormatWarning, match="as it was saved in QGIS"):
        plan_again(plan_file)
    assert project.read_bytes() == saved
    with closing(sqlite3.connect(plan_file)) as file:
        assert file.execute(read).fetchall() == kept
    project.rename(project.with_stem("mine"))
    plan_again(plan_file)
    assert project.read_bytes() == first
