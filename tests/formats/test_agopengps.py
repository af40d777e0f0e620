"""AgOpenGPS: read by a reader written from the format's description alone."""

from __future__ import annotations

import math
import shutil

import geopandas as gpd
import numpy as np
import pytest
import shapely
from formats_plan import NAME, ORIGIN, UTM, make_dataset
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod

import geofield as gf
from geofield.crs import ground_areas_m2, ground_scale
from geofield.errors import FormatError
from geofield.formats import format_named, read_dataset, validate_file, write_dataset
from geofield.formats.agopengps.plane import LocalPlane, densified, ring_headings
from geofield.formats.arrow import to_lonlat
from geofield.formats.export import dropped
from geofield.model.obstacles import circle_polygons

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("agopengps")
    write_dataset(make_dataset(), out, ["agopengps"])
    return out / "agopengps" / "Fields" / "Grosser_Acker_Nandu"


def lines(path):
    content = path.read_bytes().decode("utf-8")
    assert "\r\n" in content
    return content.split("\r\n")


def test_field_file(folder):
    content = lines(folder / "Field.txt")
    assert content[1:9] == [
        "$FieldDir",
        NAME,
        "$Offsets",
        "0,0",
        "Convergence",
        "0",
        "StartFix",
        content[8],
    ]
    lat, lon = map(float, content[8].split(","))
    assert 35.07 < lat < 35.072
    assert 33.53 < lon < 33.54


def rings_of(folder):
    content = lines(folder / "Boundary.txt")
    assert content[0] == "$Boundary"
    position, rings = 1, []
    while content[position]:
        assert content[position] == "False"
        count = int(content[position + 1])
        rows = content[position + 2 : position + 2 + count]
        rings.append(np.array([[float(v) for v in row.split(",")] for row in rows]))
        position += 2 + count
    return rings


def test_rings_headings_and_spacing(folder):
    outer, *inner = rings_of(folder)
    assert len(inner) == 4  # the field's hole and three obstacles; the rejected one is not there
    for ring, step in [(outer, 1.1), *((each, 0.55) for each in inner)]:
        polygon = shapely.Polygon(ring[:, :2])
        assert polygon.is_valid
        assert not np.allclose(ring[0, :2], ring[-1, :2])
        sides = np.hypot(*(np.roll(ring[:, :2], -1, axis=0) - ring[:, :2]).T)
        assert sides.max() <= step + 0.003
        for i, (_, _, heading) in enumerate(ring):
            before, after = ring[i - 1], ring[(i + 1) % len(ring)]
            expected = math.atan2(after[0] - before[0], after[1] - before[1]) % (2 * math.pi)
            assert abs((heading - expected + math.pi) % (2 * math.pi) - math.pi) < 1e-4
        assert ((ring[:, 2] >= 0) & (ring[:, 2] <= 2 * math.pi)).all()
    assert not shapely.is_ccw(shapely.LinearRing(outer[:, :2]))
    field = make_dataset().table("field").geometry.iloc[0]
    # The plane is not UTM: its lengths are true, UTM's shortened by 0.04 % here.
    assert abs(shapely.Polygon(outer[:, :2]).area / shapely.Polygon(field.exterior).area - 1) < 2e-3


def test_track_lines(folder):
    content = lines(folder / "TrackLines.txt")
    assert content[0] == "$TrackLines"
    tracks = [content[i : i + 8] for i in range(1, len(content) - 1, 8)]
    assert len(tracks) == 12
    for number, (name, heading, a, b, nudge, mode, visible, count) in enumerate(tracks, start=1):
        assert name == f"Track {number}"
        (ea, na), (eb, nb) = (map(float, end.split(",")) for end in (a, b))
        assert abs(math.atan2(eb - ea, nb - na) % (2 * math.pi) - float(heading)) < 1e-4
        assert (nudge, mode, visible, count) == ("0", "2", "True", "0")


def test_flags(folder):
    content = lines(folder / "Flags.txt")
    assert content[:2] == ["$Flags", "4"]
    assert content[5].endswith(",4,Hole 1")
    lat, lon, _, _, heading, colour, number, note = content[2].split(",")
    dataset = make_dataset()
    row = dataset.table("obstacles").iloc[0]
    assert abs(float(lat) - row["lat"]) < 1e-8
    assert abs(float(lon) - row["lon"]) < 1e-8
    assert (heading, colour, number) == ("0", "0", "1")
    assert note == "Obstacle 1 radius 2.50 m"


def test_flags_stand_on_the_plane_around_the_start_as_it_is_written(folder):
    lat0, lon0 = map(float, lines(folder / "Field.txt")[8].split(","))
    f0 = math.radians(lat0)
    for row in lines(folder / "Flags.txt")[2:-1]:
        lat, lon, east, north = map(float, row.split(",")[:4])
        f = math.radians(lat)
        per_lat = 111132.92 - 559.82 * math.cos(2 * f0) + 1.175 * math.cos(4 * f0)
        per_lat -= 0.0023 * math.cos(6 * f0)
        per_lon = 111412.84 * math.cos(f) - 93.5 * math.cos(3 * f) + 0.118 * math.cos(5 * f)
        assert north == pytest.approx((lat - lat0) * per_lat, abs=6e-4)
        assert east == pytest.approx((lon - lon0) * per_lon, abs=6e-4)


@pytest.mark.parametrize(("side_m", "step"), [(448, 1.1), (449, 2.2), (633, 2.2), (634, 3.3)])
def test_vertices_are_as_far_apart_as_the_area_allows(tmp_path, side_m, step):
    """Up to 20 and 40 hectares; half as far around holes, the outer ring the other way round."""
    x, y = 500_000.0, 5_540_000.0
    side = side_m * float(ground_scale(UTM, x, y))
    hole = shapely.box(x + 50, y + 50, x + 80, y + 80)
    outline = shapely.Polygon(shapely.box(x, y, x + side, y + side).exterior, [hole.exterior])
    gf.Plan(gf.Field(outline, UTM)).write(tmp_path, formats=["agopengps"])
    (folder,) = (tmp_path / "agopengps" / "Fields").iterdir()
    for ring, most, turned in zip(rings_of(folder), (step, step / 2), (False, True), strict=True):
        sides = np.hypot(*(np.roll(ring[:, :2], -1, axis=0) - ring[:, :2]).T)
        assert most * 0.9 < sides.max() <= most + 0.003
        assert shapely.is_ccw(shapely.LinearRing(ring[:, :2])) == turned


def test_no_fault_by_the_rules(folder):
    assert [each for each in validate_file(folder) if each.level == "error"] == []


def test_wrong_headings_are_found(folder, tmp_path):
    broken = tmp_path / "Field"
    shutil.copytree(folder, broken)
    content = lines(broken / "Boundary.txt")
    east, north, heading = content[10].split(",")
    content[10] = f"{east},{north},{float(heading) + 0.5:.5f}"
    (broken / "Boundary.txt").write_bytes("\r\n".join(content).encode())
    assert any("1 heading does not fit" in each.message for each in validate_file(broken))
    for damaged in (content[:30], [*content[:12], "100", *content[13:]], content[:10]):
        (broken / "Boundary.txt").write_bytes("\r\n".join(damaged).encode())
        with pytest.raises(FormatError, match="ring 1"):
            read_dataset(broken)
        (found,) = (each for each in validate_file(broken) if each.level == "error")
        assert found.where == "Boundary.txt, ring 1"
        assert found.message == "it breaks off or is damaged"
    (broken / "Boundary.txt").write_bytes("\r\n".join(["$BoundaryX", *content[1:]]).encode())
    assert any("not $Boundary" in each.message for each in validate_file(broken))


def test_a_folder_without_the_file_says_so(tmp_path):
    (tmp_path / "Boundary.txt").write_text("$Boundary\n")
    with pytest.raises(FormatError, match="0 AgOpenGPS fields"):
        read_dataset(tmp_path)


def test_what_the_program_itself_writes(folder, tmp_path):
    """Its fields were all called FieldNew, its curves along borders were straight lines."""
    there = tmp_path / "North 40"
    shutil.copytree(folder, there)
    field = (there / "Field.txt").read_text().replace(NAME, "FieldNew")
    (there / "Field.txt").write_text(field)
    ring = ["-20,-20,0", "-20,20,0", "20,20,0"]
    tracks = [
        *("Straight", "0", "0,-50", "0,50", "0.3", "2", "True", "0"),
        *("Border", "0", "-20,-20", "20,20", "0", "8", "True", str(len(ring)), *ring),
        *("Pivot", "0", "5,5", "0,0", "0", "64", "True", "0"),
    ]
    (there / "TrackLines.txt").write_text("\r\n".join(["$TrackLines", *tracks]))
    back = read_dataset(there)
    assert back.name == back.table("field")["name"].iloc[0] == "North 40"
    assert back.table("tracks")["length_m"].tolist() == pytest.approx([100.0, 80.0], abs=0.1)
    told = "; ".join(back.notes)
    assert "'Straight' taken where it was drawn, not nudged 0.3 m" in told
    assert "'Pivot' left out: it goes around a pivot" in told


@pytest.mark.parametrize("flags", [None, ["$Flags", "1", "35.07,33.53,0,0,0,0,1,Gate"]])
def test_inner_rings_of_the_program_are_obstacles(folder, tmp_path, flags):
    there = tmp_path / "North 40"
    shutil.copytree(folder, there)
    (there / "Flags.txt").unlink()
    if flags:
        (there / "Flags.txt").write_text("\r\n".join(flags))
    back = read_dataset(there)
    assert len(back.table("field").geometry.iloc[0].interiors) == 0
    rings = [shapely.Polygon(ring[:, :2]).area for ring in rings_of(folder)[1:]]
    found = ground_areas_m2(back.table("obstacles").geometry.to_numpy(), back.crs)
    assert sorted(found) == pytest.approx(sorted(rings), rel=2e-3)


def test_a_count_below_zero_is_refused(folder, tmp_path):
    broken = tmp_path / "Field"
    shutil.copytree(folder, broken)
    track = ["A", "0", "0,0", "0,10", "0", "2", "True", "-8"]
    (broken / "TrackLines.txt").write_text("\r\n".join(["$TrackLines", *track]))
    with pytest.raises(FormatError, match="track 1"):
        read_dataset(broken)


@pytest.mark.parametrize(("name", "line", "words"), [
    ("Field.txt", 8, "has no StartFix"),
    ("Boundary.txt", 7, "is damaged in ring 1"),
    ("TrackLines.txt", 3, "is damaged in track 1"),
    ("TrackLines.txt", 5, "is damaged in track 1"),
    ("Flags.txt", 2, "is no flag"),
])  # fmt: skip
@pytest.mark.parametrize("figure", ["nan", "inf"])
def test_figures_that_are_none(folder, tmp_path, name, line, words, figure):
    """They ended in tracebacks of GEOS; an obstacle whose flag had one was a hole."""
    broken = tmp_path / "Field"
    shutil.copytree(folder, broken)
    content = lines(broken / name)
    content[line] = ",".join([figure, *content[line].split(",")[1:]])
    (broken / name).write_bytes("\r\n".join(content).encode())
    with pytest.raises(FormatError, match=words):
        read_dataset(broken)
    assert any(each.level == "error" for each in validate_file(broken))


@given(st.floats(-70, 70), st.floats(-179, 179), st.floats(-3000, 3000), st.floats(-3000, 3000))
def test_plane_there_and_back(lat, lon, east, north):
    plane = LocalPlane(lat, lon)
    ((back_lon, back_lat),) = plane.to_lonlat([east], [north])
    ((e, n),) = plane.to_plane([back_lon], [back_lat])
    assert abs(e - east) < 1e-5
    assert abs(n - north) < 1e-5
    _, _, metres = Geod(ellps="WGS84").inv(lon, lat, back_lon, back_lat)
    # The series is good to a few millimetres per kilometre near the start point.
    assert abs(metres - math.hypot(east, north)) < 0.002 * math.hypot(east, north) + 0.01


@given(st.integers(3, 40), st.floats(0.3, 5.0), st.floats(3, 200))
def test_densified_rings_keep_their_corners(corners, step, radius):
    angle = 2 * np.pi * np.arange(corners) / corners
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    dense = densified(ring, step)
    sides = np.hypot(*(np.roll(dense, -1, axis=0) - dense).T)
    assert sides.max() <= step * (1 + 1e-6) or len(dense) == corners
    assert abs(shapely.Polygon(dense).area - shapely.Polygon(ring).area) < 1e-6 * radius**2
    headings = ring_headings(dense)
    assert ((headings >= 0) & (headings <= 2 * np.pi)).all()


def test_positions_are_those_of_the_plan(folder):
    back = read_dataset(folder)
    ours = make_dataset()
    a = to_lonlat(ours.table("field").geometry.to_numpy(), ours.crs)[0]
    b = to_lonlat(back.table("field").geometry.to_numpy(), back.crs)[0]
    assert shapely.hausdorff_distance(a, b) < 5e-8


def test_a_crown_that_leans_in_from_outside_is_an_obstacle_again(tmp_path):
    """Its ring ends at the border, its centre lies beyond: without a flag it was a hole."""
    dataset = make_dataset()
    table = dataset.table("obstacles")
    west = dataset.table("field").total_bounds[0]
    leaning = circle_polygons(
        np.array([west - 1.0]), np.array([table.geometry.centroid.y[0]]), 3.0, UTM
    )
    shapes = [*leaning, *table.geometry.to_numpy()[1:]]
    dataset.tables["obstacles"] = table.set_geometry(gpd.GeoSeries(shapes, crs=UTM))
    write_dataset(dataset, tmp_path, ["agopengps"])
    back = read_dataset(tmp_path / "agopengps")
    assert back.table("field").geometry.is_valid.all()
    first = back.table("obstacles").set_index("obstacle_no").geometry[1]
    assert first.area > 5
    assert back.table("field").geometry.iloc[0].buffer(0.05).covers(first)


@pytest.mark.parametrize(("box", "parts"), [
    ((8, 6, 16, 8), 2), ((13, 6, 16, 8), 1), ((11, 6, 13, 8), 0), (None, 0),
])  # fmt: skip
def test_a_hole_stays_one_and_so_does_each_part_of_an_obstacle_at_it(tmp_path, box, parts):
    dataset = make_dataset()
    field = dataset.table("field").geometry.iloc[0]
    there = [] if box is None else [shapely.transform(shapely.box(*box), lambda c: c + ORIGIN)]
    table = dataset.table("obstacles").iloc[: len(there)]
    dataset.tables["obstacles"] = table.set_geometry(there, crs=UTM)
    told = " ".join(dropped(dataset, format_named("agopengps")))
    assert ("obstacles that stand in holes" in told) == (len(there) > parts)
    write_dataset(dataset, tmp_path, ["agopengps"])
    back = read_dataset(tmp_path / "agopengps")
    assert len(back.table("obstacles")) == parts
    inside = shapely.intersection(shapely.union_all(there), field)
    found = shapely.union_all(back.table("obstacles").geometry.to_numpy())
    assert shapely.symmetric_difference(found, inside).area < 0.1
    theirs = back.table("field").geometry.iloc[0]
    assert shapely.symmetric_difference(theirs, field).area < 1
