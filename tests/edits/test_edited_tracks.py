"""Tracks that a person took away, shortened, moved or drew: in files, exports, later runs."""

from __future__ import annotations

import json
import re
import sqlite3
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from changed_plans import Frame, geofield, plan_in, rewritten, rows, run
from pyproj import CRS
from shapely import LineString, MultiLineString
from shapely.affinity import translate

from geofield import schema
from geofield.formats import validate_file
from geofield.model.lost_numbers import known_by_shape
from geofield.model.segment_values import SegmentValues, values_in, with_values
from geofield.model.track_edits import TrackEdit, TrackEdits
from geofield.model.tracks import Tracks
from geofield.model.tracks_written import TracksWritten
from geofield.plan import Plan, read_plan
from geofield.review.session import Session
from geofield.simulate import SimulatedField
from geofield.tracks import plan_route, plan_tracks
from geofield_command import run_geofield

KEPT = "tracks of yours kept: "


def tracks_in(folder: Path) -> Tracks:
    tracks = plan_in(folder).tracks
    assert tracks is not None
    return tracks


def without(number: int) -> Callable[[Frame], Frame]:
    return lambda table: table[table["track_no"] != number]


def exported(folder: Path, file: Path) -> dict[str, set[int]]:
    """Of which tracks each layer of GeoJSON tells."""
    geofield("export", file, "--format", "geojson", "--out", folder / "x", "--overwrite")
    found = {}
    for layer in ("tracks", "segments", "gaps", "track_points"):
        text = (folder / f"x/geojson/{layer}.geojson").read_text()
        found[layer] = {each["properties"]["track_no"] for each in json.loads(text)["features"]}
    return found


def guidance(folder: Path, file: Path) -> int:
    """How many lines a terminal gets."""
    geofield("export", file, "--format", "isoxml", "--out", folder / "x", "--overwrite")
    text = next((folder / "x").rglob("TASKDATA.XML")).read_text()
    return len(re.findall(r"<LSG\b[^>]*\bA=\"5\"", text))


def whole(tracks: Tracks) -> None:
    """All layers tell the same."""
    lengths = tracks.segments.groupby("track_no")["length_m"].sum()
    assert tracks.lines["track_no"].tolist() == lengths.index.tolist()
    assert tracks.lines["length_m"].to_numpy() == pytest.approx(lengths.to_numpy())
    counts = tracks.segments.groupby("track_no").size()
    assert tracks.lines["segment_count"].tolist() == counts.tolist()
    for number, line in zip(tracks.lines["track_no"], tracks.lines.geometry, strict=True):
        own = tracks.segments[tracks.segments["track_no"] == number]
        assert own["segment_no"].tolist() == list(range(1, len(own) + 1))
        assert shapely.equals_exact(line, MultiLineString(list(own.geometry)), tolerance=1e-6)
        assert (tracks.gaps["track_no"] == number).sum() == len(own) - 1
    points = tracks.points.groupby("track_no").size()
    assert tracks.lines["point_count"].tolist() == points.tolist()


def is_free(plan: Plan) -> None:
    """No segment leaves the field or enters what stands there."""
    assert plan.tracks is not None
    lines = plan.tracks.segments.geometry.to_numpy()
    outside = shapely.length(shapely.difference(lines, plan.field.polygon))
    assert outside.max() < 0.002
    for buffer in rows(plan).geometry.buffer(-0.01):
        assert not shapely.intersects(lines, buffer).any()


@pytest.mark.parametrize("layer", ["tracks", "segments"])
def test_the_last_track_may_be_exchanged_for_a_drawn_one(
    folder: Path, made: SimulatedField, layer: str
) -> None:
    """There are as many rows as before then, one of them without a number."""
    file, middle = folder / "out/field.gpkg", plan_in(folder).field.polygon.centroid
    last = int(tracks_in(folder).lines["track_no"].max())
    way = [(middle.x - 30, middle.y - 33), (middle.x + 31, middle.y + 29)]

    def exchanged(table: Frame) -> Frame:
        gone = table["track_no"] == last
        shape = MultiLineString([way]) if layer == "tracks" else LineString(way)
        drawn = gpd.GeoDataFrame(geometry=[shape], crs=table.crs)
        more = [drawn] * int(gone.sum() if layer == "segments" else 1)
        return pd.concat([table[~gone], *more], ignore_index=True)

    rewritten(file, layer, exchanged)
    told = geofield("tracks", file, "-o", file)
    assert f"{last} taken away" in told
    assert "drawn" in told
    assert tracks_in(folder).lines["track_no"].max() > last
    whole(tracks_in(folder))


@pytest.mark.parametrize("layer", ["tracks", "segments"])
def test_a_track_taken_away_is_driven_by_nobody(
    folder: Path, made: SimulatedField, layer: str
) -> None:
    file = folder / "out/field.gpkg"
    before = tracks_in(folder)
    lines = guidance(folder, file)
    rewritten(file, layer, without(5))
    where, why = ("segments", "is not in") if layer == "tracks" else ("tracks", "has no segments")
    (finding,) = validate_file(file)
    assert finding.where == where
    assert why in finding.message
    found = exported(folder, file)
    assert all(5 not in numbers for numbers in found.values())
    assert found["tracks"] == found["segments"] == found["track_points"]
    assert guidance(folder, file) == lines - (before.segments["track_no"] == 5).sum()

    again = folder / "again.gpkg"
    for told in (
        geofield("tracks", file, "-o", file),
        run(folder, made, "--overwrite"),
        geofield("obstacles", folder / "picture.tif", file, "-o", again)
        + geofield("tracks", again, "-o", file, "--overwrite"),
    ):
        assert "tracks of yours kept: 5 taken away" in told
        after = tracks_in(folder)
        assert set(after.lines["track_no"]) == set(before.lines["track_no"]) - {5}
        whole(after)
        assert after.statistics.blocked_count == before.statistics.blocked_count
        others = after.segments[after.segments["track_no"] != 5]
        kept = before.segments[before.segments["track_no"] != 5]
        assert shapely.equals_exact(
            others.geometry.to_numpy(), kept.geometry.to_numpy(), tolerance=1e-6
        ).all()
    told = geofield("tracks", file, "-o", file, "--fresh")
    assert "of yours" not in told
    assert len(tracks_in(folder).lines) == len(before.lines)
    assert not plan_in(folder).track_edits


@pytest.mark.parametrize("layer", ["tracks", "segments"])
def test_a_piece_taken_away_stays_away_when_an_obstacle_beside_it_goes(
    folder: Path, layer: str
) -> None:
    file = folder / "out/field.gpkg"
    before = tracks_in(folder)
    gap = before.gaps[before.gaps["obstacle_no"].notna()].iloc[0]
    number = int(gap["track_no"])
    own = before.segments[before.segments["track_no"] == number]
    away = own[own["segment_no"] == gap["gap_no"]].geometry.iloc[0]

    def shortened(table: Frame) -> Frame:
        if layer == "segments":
            return table[~((table["track_no"] == number) & (table.geometry.distance(away) < 0.01))]
        parts = [
            MultiLineString([one for one in line.geoms if one.distance(away) > 0.01])
            for line in table.geometry
        ]
        return table.set_geometry(parts, crs=table.crs)

    rewritten(file, layer, shortened)
    rejected = int(gap["obstacle_no"])
    rewritten(
        file,
        "obstacles",
        lambda table: table.assign(
            status=table["status"].mask(table["obstacle_no"] == rejected, "rejected")
        ),
    )
    told = geofield("tracks", file, "-o", file)
    assert f"tracks of yours kept: {number} shortened" in told
    after = tracks_in(folder)
    whole(after)
    lines = after.segments[after.segments["track_no"] == number].geometry.to_numpy()
    assert shapely.union_all(shapely.buffer(lines, 0.02)).intersection(away).length < 0.1
    # Where the obstacle was, there is track again.
    driven = shapely.union_all(shapely.buffer(lines, 0.02))
    assert shapely.length(shapely.intersection(driven, gap.geometry)) > gap["length_m"] - 0.1
    if gap["gap_no"] > 1:
        assert "by hand" in after.gaps[after.gaps["track_no"] == number]["cause"].tolist()


def test_what_is_drawn_through_an_obstacle_is_cut_there(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    plan = plan_in(folder)
    before = tracks_in(folder)
    tree = rows(plan).iloc[0]
    through = LineString(
        [tree.geometry.centroid.coords[0], plan.field.polygon.representative_point().coords[0]]
    )
    long = shapely.LineString([through.interpolate(-30), *through.coords])
    drawn = gpd.GeoDataFrame({"track_no": [None]}, geometry=[MultiLineString([long])])
    rewritten(file, "tracks", lambda t: pd.concat([t, drawn.set_crs(t.crs)]))
    # As it is, it is exported as it was drawn; what is planned goes around.
    number = len(before.lines) + before.blocked_count + 1
    assert number in exported(folder, file)["segments"]
    told = geofield("tracks", file, "-o", file)
    assert f"tracks of yours kept: {number} drawn" in told
    after = plan_in(folder)
    is_free(after)
    assert after.tracks is not None
    whole(after.tracks)
    mine = after.tracks.segments[after.tracks.segments["track_no"] == number]
    assert mine["length_m"].sum() > 5.0
    line = after.tracks.lines.set_index("track_no").loc[number]
    assert line["heading_deg"] != pytest.approx(after.tracks.heading_deg, abs=0.01)
    # The tree is rejected: the line as it was drawn, not as it was cut.
    length = mine["length_m"].sum()
    rewritten(file, "obstacles", lambda t: t.assign(status="rejected"))
    geofield("tracks", file, "-o", file)
    mine = tracks_in(folder).segments.query(f"track_no == {number}")
    assert mine["length_m"].sum() > length + tree["radius_m"]
    # Taken away again, it is gone for good.
    rewritten(file, "tracks", without(number))
    assert "of yours" not in geofield("tracks", file, "-o", file)
    assert not plan_in(folder).track_edits


def test_a_moved_track_stands_for_the_one_that_was_there(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    before = tracks_in(folder)

    def moved(table: Frame) -> Frame:
        mine = table["track_no"] == 4
        shapes = table.geometry.where(~mine, table.geometry.translate(0.8, 0.3))
        return table.set_geometry(shapes)

    rewritten(file, "segments", moved)
    geofield("tracks", file, "-o", file)
    after = plan_in(folder)
    is_free(after)
    assert after.tracks is not None
    whole(after.tracks)
    assert set(after.tracks.lines["track_no"]) == set(before.lines["track_no"])
    old, new = (
        shapely.union_all(one.segments[one.segments["track_no"] == 4].geometry.to_numpy())
        for one in (before, after.tracks)
    )
    assert translate(old, 0.8, 0.3).buffer(0.01).covers(new)


def test_edits_wait_for_their_layout(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    rewritten(file, "tracks", without(5))
    told = geofield("tracks", file, "--spacing", 5, "-o", file)
    assert "1 track that you edited is of another layout" in told
    assert "of yours kept" not in told
    assert 5 in set(tracks_in(folder).lines["track_no"])
    assert "5 taken away" in geofield("tracks", file, "--spacing", 6, "-o", file)
    assert 5 not in set(tracks_in(folder).lines["track_no"])


def test_copied_rows_and_rows_without_number_are_tracks_of_their_own(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    before = tracks_in(folder)

    def copied(table: Frame) -> Frame:
        copy = table[table["track_no"] == 3]
        aside = copy.set_geometry(copy.geometry.translate(1.5, 0), crs=table.crs)
        return pd.concat([aside, table])

    rewritten(file, "tracks", copied)
    line = translate(before.segments.geometry.iloc[20], 0.0, 1.2)
    loose = gpd.GeoDataFrame({"track_no": [None]}, geometry=[line])
    rewritten(file, "segments", lambda t: pd.concat([t, loose.set_crs(t.crs)]))
    told = geofield("tracks", file, "-o", file)
    first = len(before.lines) + before.blocked_count + 1
    assert f"{first}, {first + 1} drawn" in told
    after = tracks_in(folder)
    whole(after)
    assert set(after.lines["track_no"]) == {*before.lines["track_no"], first, first + 1}
    third = after.segments[after.segments["track_no"] == 3].geometry.to_numpy()
    old = before.segments[before.segments["track_no"] == 3].geometry.to_numpy()
    assert shapely.equals_exact(third, old, tolerance=1e-6).all()


def test_emptied_layers_are_no_word_on_any_track(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    before = len(tracks_in(folder).lines)
    rewritten(file, "tracks", lambda table: table.iloc[:0])
    told = geofield("tracks", file, "-o", file)
    assert "of yours" not in told
    assert "no planned track was left in `tracks`" in told
    assert len(tracks_in(folder).lines) == before


def test_what_is_drawn_in_an_emptied_layer_or_changed_beside_it_counts(folder: Path) -> None:
    plan, before = plan_in(folder), tracks_in(folder)
    middle = plan.field.polygon.centroid
    way = translate(LineString([(-30, -15), (30, 20)]), middle.x, middle.y)
    shape = MultiLineString([way])
    drawn = gpd.GeoDataFrame(geometry=[shape], crs=plan.field.crs)
    own = pd.concat([before.lines.iloc[:0], drawn])
    without_5 = before.segments[before.segments["track_no"] != 5]
    nothing = before.segments.iloc[:0]
    number = max(before.written.segments) + 1
    for lines, segments, words in (
        (own, before.segments, f"{number} drawn"),
        (pd.concat([before.lines, drawn]), nothing, f"{number} drawn"),
        (before.lines, pd.concat([nothing, drawn.explode()]), f"{number} drawn"),
        (own, nothing, f"{number} drawn"),
        (own, without_5, f"5 taken away, {number} drawn"),
        (before.lines.iloc[:0], nothing, ""),
    ):
        edited = replace(before, lines=lines, segments=segments)
        assert edited.edits_since(TrackEdits()).in_words().removeprefix(KEPT) == words
    # So does what was changed beside a layer that is gone.
    file = folder / "out/field.gpkg"
    rewritten(file, "tracks", without(5))
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("DROP TABLE segments")
        for table in ("gpkg_contents", "gpkg_geometry_columns"):
            connection.execute(f"DELETE FROM {table} WHERE table_name = 'segments'")
    assert "5 taken away" in geofield("tracks", file, "-o", file)


def test_a_run_for_another_field_does_not_forget_them(folder: Path, made: SimulatedField) -> None:
    file = folder / "out/field.gpkg"
    rewritten(file, "tracks", without(5))
    rewritten(file, "field", lambda table: table.assign(name="Mine", crop="rye"))
    written = file.read_bytes()
    picture = gpd.GeoSeries([plan_in(folder).field.polygon], crs=plan_in(folder).field.crs)
    west, south, *_ = picture.to_crs(4326).total_bounds
    done = run_geofield(
        "field", folder / "picture.tif", "--overwrite", "--lat", south, "--lon", west, "-o", file
    )
    assert done.returncode == 1
    assert "holds 1 edited track, a name, columns of your own" in done.stderr
    assert "--fresh" in done.stderr
    assert file.read_bytes() == written


def test_a_track_changed_in_both_layers_is_told(folder: Path) -> None:
    file = folder / "out/field.gpkg"

    def moved(table: Frame) -> Frame:
        mine = table["track_no"].isin([4, 6])
        return table.set_geometry(table.geometry.where(~mine, table.geometry.translate(0.8, 0.3)))

    rewritten(file, "tracks", lambda table: without(5)(moved(table)))
    # Track 5 is gone and 6 moved in both: that is one word.
    rewritten(file, "segments", lambda table: without(4)(without(5)(moved(table))))
    told = geofield("tracks", file, "-o", file)
    assert "`segments`, in each another way: track 4. What" in told
    assert "4, 5 taken away, 6 drawn" in told


def test_the_review_page_goes_on_with_what_was_changed_elsewhere(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    rewritten(file, "tracks", without(5))
    session = Session(plan_in(folder))
    assert session.outdated
    number = int(rows(session.plan).index[0])
    for _ in range(2):
        tracks = session.plan.tracks
        assert tracks is not None
        assert 5 not in set(tracks.lines["track_no"])
        assert "tracks of yours kept: 5 taken away" in session.step.notes
        whole(tracks)
        session.do({"do": "status", "no": number, "status": "rejected"})


def test_reading_and_writing_is_no_edit(folder: Path) -> None:
    plan = plan_in(folder)
    assert not plan.track_edits
    plan.write(folder / "copy", formats=["gpkg", "rdf"])
    assert not read_plan(folder / "copy/field.gpkg").track_edits
    rewritten(folder / "out/field.gpkg", "segments", lambda table: table.iloc[::-1])
    assert not plan_in(folder).track_edits
    # What is written beside segments is kept, and changes no track.
    rewritten(folder / "out/field.gpkg", "segments", lambda table: table.assign(note="mine"))
    kept = plan_in(folder).track_edits
    assert not kept.edits
    assert {one.own["note"] for one in kept.beside} == {"mine"}
    rewritten(folder / "out/field.gpkg", "tracks", without(5))
    edited = plan_in(folder)
    # Written as it is, it is still known to be edited.
    edited.write(folder / "kept", formats=["gpkg"])
    assert read_plan(folder / "kept/field.gpkg").track_edits == edited.track_edits


def test_layers_that_were_saved_in_another_crs_and_back_are_no_edit(tmp_path: Path) -> None:
    """There and back moves all by 11 mm there: every track was one that a person drew."""
    parcel, file = tmp_path / "parcel.gpkg", tmp_path / "plan.gpkg"
    square = shapely.box(450000, 4950000, 450200, 4950100)
    gpd.GeoDataFrame(geometry=[square], crs=32634).to_file(parcel)
    geofield("tracks", parcel, "--spacing", 6, "--direction", 30, "-o", file)
    for layer in ("tracks", "segments"):
        rewritten(file, layer, lambda table: table.to_crs("EPSG:8678").to_crs(table.crs))
    assert not read_plan(file).track_edits
    assert "edited" not in geofield("tracks", file, "--direction", 60, "-o", file)


def test_a_route_drives_along_a_bent_track() -> None:
    crs: Any = "+proj=tmerc +lon_0=15 +k=1 +x_0=500000 +datum=WGS84 +units=m"
    field = shapely.box(500000, 5600000, 500200, 5600100)
    planned = plan_tracks(field, [], crs=crs, spacing_m=10.0, direction=90)
    record = TracksWritten.from_json(planned.evidence()["written"])
    bent = LineString([(500010, 5600020), (500100, 5600030), (500190, 5600020)])
    segments = planned.segments.copy()
    segments.loc[segments["track_no"] == 3, "geometry"] = bent
    edits = replace(planned, segments=segments, written=record).edits_since(TrackEdits())
    tracks = plan_tracks(field, [], crs=crs, spacing_m=10.0, direction=90, edits=edits)
    whole(tracks)
    for radius_m in (None, 4.0):
        routed = plan_route(tracks, turning_radius_m=radius_m, margin_m=20)
        assert routed.route is not None
        lines = routed.route.geometry.to_numpy()
        ends = shapely.get_coordinates(shapely.get_point(lines, -1))
        starts = shapely.get_coordinates(shapely.get_point(lines, 0))
        assert np.abs(ends[:-1] - starts[1:]).max() < 1e-5
        work = routed.route[routed.route["kind"] == "work"]
        mine = work[work["track_no"] == 3].geometry.iloc[0]
        assert shapely.equals_exact(
            shapely.normalize(mine), shapely.normalize(bent), tolerance=1e-6
        )
        if radius_m:
            # The way out of the bent track goes on in the direction of its last leg.
            at = int(np.flatnonzero(routed.route["track_no"].fillna(0) == 3)[0])
            leg, turn = (shapely.get_coordinates(lines[k]) for k in (at, at + 1))
            one, other = leg[-1] - leg[-2], turn[1] - turn[0]
            angle = np.degrees(np.arctan2(*one) - np.arctan2(*other))
            assert abs((angle + 180) % 360 - 180) < 6.0


def test_what_is_known_of_a_blocked_track_waits_for_it(folder: Path) -> None:
    """An obstacle that leaves nothing of a track takes its row, not a person's word on it."""
    tracks = tracks_in(folder)
    assert tracks.written is not None
    place = tracks.written.place(3)
    known = TrackEdits(
        (
            TrackEdit(3, place=place, own={"note": "wet"}),
            TrackEdit(98, place=place, own={"note": "steep"}),
            TrackEdit(99, drawn="MULTILINESTRING ((0 0, 1 1))"),
        )
    )
    # The row of track 3 has no such column any more; the others have no row.
    assert tracks.edits_since(known).edits == known.edits[1:]


def test_edits_are_the_same_in_another_zone(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    rewritten(file, "tracks", without(5))
    line = tracks_in(folder).lines.geometry.iloc[2]
    drawn = gpd.GeoDataFrame({"track_no": [None]}, geometry=[translate(line, 1, 0)])
    rewritten(file, "tracks", lambda t: pd.concat([t, drawn.set_crs(t.crs)]))
    plan = plan_in(folder)
    edits, here = plan.track_edits, plan.field.crs
    assert TrackEdits.from_json(json.loads(json.dumps(edits.to_json()))) == edits
    there = edits.reprojected(here, CRS("EPSG:3857"))
    assert there != edits
    back = there.reprojected(CRS("EPSG:3857"), here)
    for one, other in zip(edits.edits, back.edits, strict=True):
        assert one.track_no == other.track_no
        if one.place is not None and other.place is not None:
            assert one.place == pytest.approx(other.place, abs=0.01)


def test_what_is_written_beside_a_track_that_one_drew_stays(
    folder: Path, made: SimulatedField
) -> None:
    """A copied row keeps its number, and a drawn one has none: both are tracks of their own."""
    file = folder / "out/field.gpkg"

    def drawn(table: Frame) -> Frame:
        some = table.iloc[[2, 4]].copy()
        some["geometry"] = some.geometry.translate(1.5, 0.5)
        some["track_no"] = some["track_no"].where(some["track_no"] == table["track_no"].iloc[2])
        some["note"] = ["copied", "drawn"]
        return gpd.GeoDataFrame(pd.concat([some, table]), crs=table.crs)

    rewritten(file, "tracks", drawn)
    before = set(tracks_in(folder).lines["track_no"].dropna())
    for _ in range(2):
        run(folder, made, "--overwrite")
        notes = tracks_in(folder).lines.set_index("track_no")["note"].dropna()
        assert sorted(notes) == ["copied", "drawn"]
        assert not before & set(notes.index)


def test_columns_of_ones_own_stay_with_their_tracks(folder: Path, made: SimulatedField) -> None:
    file = folder / "out/field.gpkg"

    def noted(table: Frame) -> Frame:
        table["note"] = table["track_no"].map({3: "wet", 4: "done"})
        table["rate"] = table["track_no"].map({3: 2.5, 6: 7.0})
        return table[table["track_no"] != 5]

    rewritten(file, "tracks", noted)
    # What was only written beside a track leaves it in every layer.
    found = exported(folder, file)
    assert {3, 4, 6} <= found["tracks"]
    assert found["tracks"] == found["segments"] == found["track_points"]
    assert 5 not in found["tracks"]
    for again in (
        lambda: run(folder, made, "--overwrite"),
        lambda: geofield("tracks", file, "-o", file),
        lambda: geofield("tracks", file, "--spacing", 5, "-o", file),
        lambda: geofield("tracks", file, "--spacing", 6, "-o", file),
    ):
        again()
        table = tracks_in(folder).lines.set_index("track_no")
        if tracks_in(folder).spacing_m == 6:
            assert table["note"].dropna().to_dict() == {3: "wet", 4: "done"}
            assert table["rate"].dropna().to_dict() == {3: 2.5, 6: 7.0}
            assert 5 not in table.index
        else:
            assert "note" not in table
    rewritten(file, "tracks", lambda table: table.drop(columns=["note", "rate"]))
    geofield("tracks", file, "-o", file)
    assert "note" not in tracks_in(folder).lines
    assert 5 not in set(tracks_in(folder).lines["track_no"])


def test_columns_of_ones_own_stay_with_their_segments(folder: Path, made: SimulatedField) -> None:
    """A value stands beside a piece of ground: planning may cut the tracks anew."""
    file = folder / "out/field.gpkg"
    before = tracks_in(folder).segments
    cut = before[before["segment_no"] == 2]["track_no"].iloc[0]

    def noted(table: Frame) -> Frame:
        said = {(cut, 1): "wet", (cut, 2): "stones", (6, 1): "sown"}
        keys = zip(table["track_no"], table["segment_no"], strict=True)
        table["note"] = [said.get(key) for key in keys]
        table["rate"] = table["track_no"].map({6: 7.5})
        return table

    def told() -> dict[tuple[int, int], str]:
        table = tracks_in(folder).segments
        if "note" not in table:
            return {}
        rows = table[table["note"].notna()]
        keys = zip(rows["track_no"], rows["segment_no"], strict=True)
        return dict(zip(keys, rows["note"], strict=True))

    rewritten(file, "segments", noted)
    said = {(cut, 1): "wet", (cut, 2): "stones", (6, 1): "sown"}
    assert told() == said
    for again, found in (
        (lambda: run(folder, made, "--overwrite"), said),
        (lambda: geofield("tracks", file, "-o", file), said),
        # Another layout has none of these pieces: what was written waits.
        (lambda: geofield("tracks", file, "--direction", "0", "-o", file), {}),
        (lambda: geofield("tracks", file, "--direction", "dominant", "-o", file), said),
    ):
        again()
        assert told() == found
        table = tracks_in(folder).segments
        if found:
            assert table.loc[table["rate"].notna(), "rate"].tolist() == [7.5]
        plan = read_plan(file)
        assert len(plan.track_edits.beside) == 3
        # Nothing was edited since.
        assert plan.track_edits == plan.evidence.track_edits
    # A track is taken away in the other layer: its segments' values go on elsewhere only.
    rewritten(file, "tracks", lambda table: table[table["track_no"] != 6])
    geofield("tracks", file, "-o", file)
    assert told() == {key: note for key, note in said.items() if key[0] != 6}
    # An emptied cell is a word, too.
    rewritten(file, "segments", lambda table: table.assign(note=None))
    geofield("tracks", file, "-o", file)
    assert not told()


def test_a_segment_that_is_cut_in_two_has_its_values_twice(folder: Path) -> None:
    file = folder / "out/field.gpkg"
    plan = read_plan(file)
    tracks = plan.tracks
    assert tracks is not None
    longest = tracks.segments.loc[tracks.segments["length_m"].idxmax()]
    number = longest["track_no"]

    def noted(table: Frame) -> Frame:
        here = (table["track_no"] == number) & (table["segment_no"] == longest["segment_no"])
        table["note"] = ["here" if one else None for one in here]
        return table

    rewritten(file, "segments", noted)
    middle = longest.geometry.interpolate(0.5, normalized=True)

    def stands_there(table: Frame) -> Frame:
        post = gpd.GeoDataFrame(geometry=[middle.buffer(2.0)], crs=tracks.crs).to_crs(table.crs)
        return pd.concat([table, post], ignore_index=True)

    rewritten(file, "obstacles", stands_there)
    geofield("tracks", file, "-o", file)
    table = tracks_in(folder).segments
    both = table[table["note"].notna()]
    assert len(both) == 2
    assert set(both["track_no"]) == {number}


def test_a_segment_that_is_joined_gives_its_values_to_no_other_ground() -> None:
    """What stood beside one side of a tree is not said of the other while the tree is away."""

    def noted(*lines: LineString) -> Frame:
        table = gpd.GeoDataFrame(
            {"track_no": 1, "segment_no": range(1, len(lines) + 1), "length_m": 1.0},
            geometry=list(lines),
            crs=32633,
        )
        return with_values(table, beside, 6.0)

    sides = LineString([(0, 0), (24, 0)]), LineString([(33, 0), (39, 0)])
    beside: tuple[SegmentValues, ...] = (SegmentValues(sides[0].wkt, {"note": "wet"}),)
    joined = noted(LineString([(0, 0), (39, 0)]))
    assert joined["note"].tolist() == ["wet"]
    assert values_in(joined, beside, 6.0) == beside
    beside = values_in(joined, beside, 6.0)
    assert noted(*sides)["note"].isna().tolist() == [False, True]
    # Another word is one of all that it stands beside.
    (changed,) = values_in(joined.assign(note="sown"), beside, 6.0)
    assert shapely.from_wkt(changed.line).length == 39


def test_values_beside_lines_of_several_parts_and_none_at_all() -> None:
    """Editors write lines of parts, rows without a shape, and lines that have come apart."""
    lines = [
        MultiLineString([[(0, 0), (40, 0)]]),
        MultiLineString([[(0, 6), (20, 6)], [(24, 6), (40, 6)]]),
        LineString(),
        None,
        LineString([(0, 12), (40, 12)]),
        LineString([(20, -3), (20, 3)]),  # across the first one
    ]
    table = gpd.GeoDataFrame(
        {"track_no": range(1, 7), "segment_no": 1, "length_m": 1.0, "note": [*"abcde", None]},
        geometry=lines,
        crs=32633,
    ).set_geometry(gpd.GeoSeries(lines, crs=32633).translate(500_000, 5_300_000))
    known = values_in(table, (), 6.0)
    assert sorted(one.own["note"] for one in known) == ["a", "b", "e"]
    again = with_values(table.drop(columns="note"), known, 6.0).set_index("track_no")["note"]
    assert again.dropna().to_dict() == {1: "a", 2: "b", 5: "e"}
    assert values_in(table, known, 6.0) == known
    # In another zone and back; with what an earlier version wrote, which had none of it.
    edits = TrackEdits(beside=known)
    zones = CRS(32633), CRS(32634)
    there = edits.reprojected(*zones)
    assert "note" not in with_values(table.drop(columns="note"), there.beside, 6.0)
    back = there.reprojected(*zones[::-1]).beside
    again = with_values(table.drop(columns="note"), back, 6.0).set_index("track_no")["note"]
    assert again.dropna().to_dict() == {1: "a", 2: "b", 5: "e"}
    assert TrackEdits.from_json(json.loads(json.dumps(edits.to_json()))) == edits
    assert TrackEdits.from_json({"edits": [], "apart": []}) == TrackEdits()


def other_program(kind: str, table: Frame) -> Frame:
    """A layer as programs write it that do not know what its columns are for."""
    if kind == "reversed":
        return table.iloc[::-1][["geometry"]]
    if kind == "renamed":
        return table.rename(columns={name: f"{name}_1" for name in table if name != "geometry"})
    if kind == "with heights":
        return table.set_geometry(shapely.force_3d(table.geometry, 2.0))[["geometry"]]
    if kind == "dissolved":
        return table.dissolve().reset_index(drop=True)
    if kind == "turned and dissolved":
        return table.set_geometry(shapely.reverse(table.geometry)).dissolve()[["geometry"]]
    lost = {"bare": [name for name in table if name != "geometry"]}.get(kind, [kind])
    return table.drop(columns=lost)


LOSSES = ("bare", "track_no", "segment_no", "reversed", "renamed", "with heights")
DISSOLVED = ("dissolved", "turned and dissolved")


@pytest.mark.filterwarnings("ignore:field.gpkg. layer:geofield.errors.FormatWarning")
@pytest.mark.parametrize("kind", [*LOSSES, *DISSOLVED])
def test_segments_that_lost_their_numbers_are_known_by_their_shapes(
    folder: Path, kind: str
) -> None:
    """All counted as drawn by a person, and the planned ones came back beside them."""
    file = folder / "out/field.gpkg"
    before = tracks_in(folder)
    rewritten(file, "segments", lambda table: other_program(kind, without(5)(table)))
    assert [one.track_no for one in plan_in(folder).track_edits.edits if one.away] == [5]
    left = set(before.lines["track_no"]) - {5}
    assert exported(folder, file)["segments"] == left
    told = geofield("tracks", file, "-o", file)
    assert KEPT + "5 taken away" in told
    assert "layer 'segments'" in told
    after = tracks_in(folder)
    whole(after)
    assert set(after.lines["track_no"]) == left
    assert len(after.segments) == (before.segments["track_no"] != 5).sum()


@pytest.mark.filterwarnings("ignore:field.gpkg. layer:geofield.errors.FormatWarning")
@pytest.mark.parametrize("kind", ["bare", "dissolved"])
def test_tracks_that_lost_their_numbers_are_known_by_their_shapes(folder: Path, kind: str) -> None:
    file = folder / "out/field.gpkg"
    before = tracks_in(folder)
    rewritten(file, "tracks", lambda table: other_program(kind, table))
    assert not plan_in(folder).track_edits.edits
    assert exported(folder, file)["tracks"] == set(before.lines["track_no"])


@pytest.mark.filterwarnings("ignore:field.gpkg. layer:geofield.errors.FormatWarning")
def test_a_moved_track_without_its_number_stands_for_the_one_that_was_there(folder: Path) -> None:
    file = folder / "out/field.gpkg"

    def moved(table: Frame) -> Frame:
        shapes = table.geometry.where(table["track_no"] != 6, table.translate(0.8, 0.8))
        return gpd.GeoDataFrame(geometry=shapes, crs=table.crs)

    rewritten(file, "segments", moved)
    edits = plan_in(folder).track_edits
    assert [one.track_no for one in edits.edits if one.drawn] == [6]


@pytest.mark.filterwarnings("ignore:field.gpkg. layer:geofield.errors.FormatWarning")
@pytest.mark.parametrize("layer", ["tracks", "segments"])
@pytest.mark.parametrize("numbered", [True, False])
def test_a_drawn_track_that_crossed_others_when_they_were_dissolved(
    folder: Path, layer: str, numbered: bool
) -> None:
    """A dissolve cuts lines where they cross: the others counted as shortened or taken away."""
    file = folder / "out/field.gpkg"
    middle = plan_in(folder).field.polygon.representative_point()
    drawn = shapely.LineString([(middle.x - 40, middle.y - 20), (middle.x + 40, middle.y + 20)])

    def dissolved(table: Frame) -> Frame:
        many = table.geom_type.iloc[0] == "MultiLineString"
        shape = shapely.MultiLineString([drawn]) if many else drawn
        more = gpd.GeoDataFrame(geometry=[shape], crs=table.crs)
        whole = pd.concat([table, more]).dissolve().reset_index(drop=True)
        return whole if numbered else whole[["geometry"]]

    rewritten(file, layer, dissolved)
    edits = plan_in(folder).track_edits.edits
    assert [one.track_no for one in edits if one.away] == []
    said = [one for one in edits if one.drawn]
    assert len(said) == len(edits) == 1
    lines = shapely.get_parts(shapely.from_wkt(said[0].drawn))
    assert min(shapely.hausdorff_distance(lines, drawn)) < 0.01


@pytest.mark.parametrize("layer", ["tracks", "segments"])
def test_rows_copied_in_place_are_driven_once(folder: Path, layer: str) -> None:
    """As of two people's copies in one layer: each track was driven twice."""
    file = folder / "out/field.gpkg"
    before = tracks_in(folder)
    rewritten(file, layer, lambda table: pd.concat([table, table]))
    told = geofield("tracks", file, "-o", file)
    count = len(before.lines if layer == "tracks" else before.segments)
    assert f"Layer {layer!r}: {count} rows are copied in place and count once" in told
    after = tracks_in(folder)
    assert not plan_in(folder).track_edits.edits
    assert len(after.segments) == len(before.segments)


def test_areas_among_the_tracks_are_refused(folder: Path) -> None:
    """Their borders were driven."""
    file = folder / "out/field.gpkg"
    rewritten(file, "tracks", lambda table: table.set_geometry(table.buffer(2.0), crs=table.crs))
    done = run_geofield("tracks", file, "-o", file)
    assert done.returncode == 1
    assert "layer 'tracks' holds MultiPolygon shapes; tracks are lines" in done.stderr


def test_a_copy_without_settings_tells_which_spacing_it_gets(folder: Path) -> None:
    """Tracks of 6 m came back at 2 m."""
    file = folder / "out/field.gpkg"
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("DELETE FROM gpkg_metadata_reference")
        connection.execute("DELETE FROM gpkg_metadata")
    copy = folder / "copy.gpkg"
    told = geofield("tracks", file, "-o", copy)
    assert "Its settings are lost, too: the spacing is 2 m now, where --spacing says no" in told
    assert "settings are lost" not in geofield(
        "tracks", file, "--spacing", 6, "-o", copy, "--overwrite"
    )


@pytest.mark.parametrize("merged", ["dissolved", "collected"])
def test_a_track_that_was_shortened_before_its_layer_was_merged_stays_so(merged: str) -> None:
    """It is cut where a line that was drawn crosses it, and whole again as far as it was left."""
    lines = [LineString([(0, y), (100, y)]) for y in (0, 6, 12)]
    # The middle of what was drawn lies on the track that is known by nothing but its place.
    drawn = LineString([(20, -4), (40, 16)])
    left = [drawn, lines[0], LineString([(0, 6), (60, 6)]), lines[2]]
    shape = shapely.union_all(left) if merged == "dissolved" else shapely.multilinestrings(left)
    layer = schema.table(schema.SEGMENTS, {}, [shape], CRS(32633))
    written = TracksWritten.of([1, 2, 3], lines, heading_deg=90.0, spacing_m=6.0, middle=(0.0, 0.0))
    found = known_by_shape(schema.SEGMENTS, layer, written)
    of_two = found[found["track_no"] == 2].length
    assert of_two.tolist() == pytest.approx([60.0])
    assert found[found["track_no"].isna()].length.tolist() == pytest.approx([drawn.length])
