"""What a terminal makes of task data and field folders: areas, holes, headland, repeated lines."""

from __future__ import annotations

import dataclasses
import json
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pandas as pd
import pytest
import shapely
from formats_plan import make_dataset
from pyproj import CRS, Geod, Transformer

import geofield as gf
from geofield import schema
from geofield.crs import ground_areas_m2, transformer, utm_crs
from geofield.formats import read_dataset, validate_file, write_dataset
from geofield.formats.agopengps.plane import LocalPlane
from geofield.formats.export import dropped
from geofield.formats.registry import format_named
from geofield.formats.terminal import main_field
from geofield.model import Dataset, Field, Provenance
from geofield.model.obstacles import circle_polygons
from geofield_command import run_geofield

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")
GEOD = Geod(ellps="WGS84")


def crowded():
    """The test plan with trees that overlap each other, and one across the border."""
    dataset = make_dataset(points=False, optional=True)
    table = dataset.tables["obstacles"]
    x, y = np.array([[100.0, 12.0], [105.0, 12.0], [119.0, 30.0]]).T
    origin = dataset.tables["field"].total_bounds[:2]
    more = schema.table(
        schema.OBSTACLES,
        {
            "obstacle_no": [7, 9, 11], "kind": ["tree"] * 3, "status": ["detected"] * 3,
            "radius_m": [3.0, 3.5, 3.0], "buffer_m": [0.5] * 3,
        },
        circle_polygons(x + origin[0], y + origin[1], np.array([3.5, 4.0, 3.5]), dataset.crs),
        dataset.crs,
    )  # fmt: skip
    table = pd.concat([table, more], ignore_index=True)
    return dataclasses.replace(dataset, tables={**dataset.tables, "obstacles": table})


def rings(element):
    return {
        line.get("A"): [(float(p.get("D")), float(p.get("C"))) for p in line.findall("PNT")]
        for line in element.findall("LSG")
    }


def polygons(root, kind):
    """Name and shape of the polygons of a type, as a reader that knows holes has them."""
    found = []
    for element in root.iter("PLN"):
        if element.get("A") == kind:
            holes = [
                [(float(p.get("D")), float(p.get("C"))) for p in line.findall("PNT")]
                for line in element.findall("LSG") if line.get("A") == "2"
            ]  # fmt: skip
            found.append((element.get("B"), shapely.Polygon(rings(element)["1"], holes)))
    return found


def in_metres(shape, crs):
    to = transformer(CRS.from_epsg(4326), crs)
    return shapely.transform(shape, lambda c: np.column_stack(to.transform(c[:, 0], c[:, 1])))


@pytest.mark.parametrize(("name", "version"), [("isoxml", 4), ("isoxml-v3", 3)])
def test_obstacles_are_joined_and_inside_the_field(tmp_path, name, version):
    dataset = crowded()
    write_dataset(dataset, tmp_path, [name])
    root = ET.parse(tmp_path / name / "TASKDATA" / "TASKDATA.XML").getroot()
    field = dataset.table("field").geometry.iloc[0]
    named = {n: in_metres(shape, dataset.crs) for n, shape in polygons(root, "6")}
    assert list(named) == ["Obstacle 1", "Obstacle 2", "Obstacle 4", "Obstacle 7+9",
                           "Obstacle 11", "Hole 1"]  # fmt: skip
    standing = [shape for n, shape in named.items() if n != "Hole 1"]
    assert all(shapely.difference(shape, field).area < 1e-3 for shape in standing)
    # What a terminal has left when it subtracts one after the other is what there is.
    kept = dataset.table("obstacles")
    kept = kept[kept["status"] != "rejected"]
    truth = field.difference(shapely.union_all(kept.geometry.to_numpy())).area
    assert field.area - sum(shape.area for shape in standing) == pytest.approx(truth, abs=0.01)
    points = [p.get("B") for p in root.iter("PNT") if p.get("A") == "5"]
    # The centre of 11 lies in the field, too.
    wanted = ["Obstacle 1", "Obstacle 2", "Obstacle 7", "Obstacle 9", "Obstacle 11"]
    assert points == (wanted if version == 4 else [])
    back = read_dataset(tmp_path / name).table("obstacles")
    assert sorted(back["obstacle_no"]) == [1, 2, 4, 7, 11]
    # The tracks were planned before the last three stood there.
    wrong = [each.message for each in validate_file(tmp_path / name) if each.level == "error"]
    assert all("runs through obstacle" in message for message in wrong)


@pytest.mark.parametrize("name", ["isoxml", "isoxml-v3", "agopengps"])
def test_a_post_is_an_obstacle_however_thin(tmp_path, name):
    dataset = make_dataset(points=False)
    obstacles = dataset.tables["obstacles"].iloc[:1].assign(radius_m=0.05, buffer_m=0.0)
    x, y = (np.array([v]) for v in obstacles.geometry.iloc[0].centroid.coords[0])
    obstacles = obstacles.set_geometry(circle_polygons(x, y, np.array([0.05]), dataset.crs))
    tables = {**dataset.tables, "obstacles": obstacles.set_crs(dataset.crs)}
    write_dataset(dataclasses.replace(dataset, tables=tables), tmp_path, [name])
    (found,) = read_dataset(tmp_path / name).table("obstacles").geometry
    assert found.hausdorff_distance(obstacles.geometry.iloc[0]) < 0.005


def test_agopengps_reads_holes_and_headland_of_isoxml(tmp_path):
    """It takes the first exterior ring of a boundary and of a headland, and no interior ones."""
    dataset = crowded()
    write_dataset(dataset, tmp_path, ["isoxml"])
    root = ET.parse(tmp_path / "isoxml" / "TASKDATA" / "TASKDATA.XML").getroot()
    field = dataset.table("field").geometry.iloc[0]
    inner = [
        in_metres(shapely.Polygon(rings(e)["1"]), dataset.crs)
        for e in root.iter("PLN") if e.get("A") in ("3", "4", "6")
    ]  # fmt: skip
    hole = shapely.Polygon(field.interiors[0])
    assert min(shape.symmetric_difference(hole).area for shape in inner) < 0.01
    (headland,) = [e for e in root.iter("PLN") if e.get("A") == "10"][:1]
    line = in_metres(shapely.Polygon(rings(headland)["1"]), dataset.crs)
    strip = dataset.table("headland").geometry.iloc[0]
    # The line at which machines turn is the inner edge, 4 m from the border.
    edge = field.buffer(-4.0, join_style="mitre").exterior
    assert shapely.hausdorff_distance(line.exterior, edge) < 1e-3
    write_dataset(dataset, tmp_path / "area", ["isoxml"], options={"headland": "strip"})
    root = ET.parse(tmp_path / "area" / "isoxml" / "TASKDATA" / "TASKDATA.XML").getroot()
    areas = [in_metres(shape, dataset.crs) for _, shape in polygons(root, "10")]
    assert sum(each.area for each in areas) == pytest.approx(strip.area, rel=1e-4)
    # Read back, the hole is no obstacle.
    back = read_dataset(tmp_path / "isoxml")
    assert len(back.table("field").geometry.iloc[0].interiors) == 1
    assert len(back.table("obstacles")) == 5


def test_headland_of_agopengps(tmp_path):
    dataset = crowded()
    write_dataset(dataset, tmp_path, ["agopengps"])
    (folder,) = (tmp_path / "agopengps" / "Fields").iterdir()
    boundary = (folder / "Boundary.txt").read_text().split()
    count = boundary.count("False")
    header, *lines = (folder / "Headland.txt").read_text().split()
    assert header == "$Headland"
    plane = LocalPlane(*map(float, (folder / "Field.txt").read_text().split()[-1].split(",")))
    found = []
    while lines:
        points = [tuple(map(float, line.split(","))) for line in lines[1 : 1 + int(lines[0])]]
        found.append(points)
        lines = lines[1 + int(lines[0]) :]
    # One line for each ring of the boundary, of as many points as it says.
    assert len(found) == count == 7
    edge = np.array(found[0])
    placed = in_metres(shapely.LineString(plane.to_lonlat(edge[:, 0], edge[:, 1])), dataset.crs)
    field = dataset.table("field").geometry.iloc[0]
    wanted = field.buffer(-4.0, join_style="mitre").exterior
    assert shapely.hausdorff_distance(shapely.LinearRing(placed.coords), wanted) < 0.005
    ahead = np.roll(edge, -1, axis=0) - np.roll(edge, 1, axis=0)
    turned = np.arctan2(ahead[:, 0], ahead[:, 1]) - edge[:, 2]
    assert np.abs((turned + np.pi) % (2 * np.pi) - np.pi).max() < 0.01
    # Without a headland there is none.
    write_dataset(make_dataset(points=False), tmp_path / "bare", ["agopengps"])
    (file,) = (tmp_path / "bare").rglob("Headland.txt")
    assert file.read_text().split() == ["$Headland"]


@pytest.mark.parametrize("turned_deg", [0, 17])
@pytest.mark.parametrize("around", [False, True])
def test_agopengps_turns_at_a_hole_where_a_headland_is_around_it(tmp_path, turned_deg, around):
    """Without one, the edge of a hole on whole metres was the line of its headland."""
    hole = shapely.box(500_090, 5_600_050, 500_110, 5_600_070)
    plain = shapely.box(500_000, 5_600_000, 500_200, 5_600_120) - hole
    crs = CRS.from_epsg(32632)
    outline: Any = shapely.affinity.rotate(plain, turned_deg)
    tracks = gf.plan_tracks(outline, crs=crs, spacing_m=6, headland_m=12, headland_holes=around)
    gf.Plan(Field(outline, crs), tracks=tracks).write(tmp_path, formats=["agopengps"])
    (file,) = tmp_path.rglob("Headland.txt")
    _, outer, *rows = file.read_text().split()
    count, *rows = rows[int(outer) :]
    assert len(rows) == int(count)
    if not around:
        assert count == "0"
        return
    edge = np.array([row.split(",") for row in rows], dtype=float)[:, :2]
    line = shapely.LinearRing(edge)
    assert shapely.is_ccw(line)
    assert np.hypot(*(np.roll(edge, -1, axis=0) - edge).T).max() <= 0.55 + 0.003
    plane = LocalPlane(*map(float, (file.parent / "Field.txt").read_text().split()[-1].split(",")))
    placed = in_metres(shapely.Polygon(plane.to_lonlat(*edge.T)), crs)
    ring = shapely.Polygon(outline.interiors[0])
    assert shapely.distance(placed.exterior, ring) == pytest.approx(12.0, abs=0.01)
    assert placed.covers(ring)


def test_the_headland_and_its_line_have_no_spikes_along_a_hole():
    corner = np.array([500_000.0, 5_600_000.0])
    plain, hole = shapely.box(0, 0, 200, 100), shapely.box(85, 3, 95, 50)
    for turned_deg in range(0, 90, 3):
        pierced = plain - shapely.affinity.rotate(hole, 7)
        turned = shapely.affinity.rotate(pierced, turned_deg, origin=(100, 50))
        field: Any = shapely.transform(turned, lambda c: c + corner)
        tracks = gf.plan_tracks(field, crs=32632, spacing_m=6, headland_m=6)
        border = shapely.Polygon(field.exterior).exterior
        strip = shapely.points(shapely.get_coordinates(tracks.headland.geometry))
        assert shapely.distance(strip, border).max() < 6.01
        dataset = Dataset({"headland": tracks.headland}, tracks.crs, "", Provenance())
        # A hole reaches through the headland: the field's edge along it is the main area's, too.
        (main,) = main_field(dataset, field)
        assert main.distance(border) > 5.99


def test_a_headland_around_several_parts_is_told_of_agopengps(tmp_path):
    dataset = crowded()
    told = "the headland's line around all but the field's largest part"
    assert told not in dropped(dataset, format_named("agopengps"))
    strip = dataset.table("headland")
    x = strip.geometry.iloc[0].centroid.x
    across = shapely.box(x - 5, strip.total_bounds[1], x + 5, strip.total_bounds[3])
    parted = strip.set_geometry(strip.union(across).intersection(dataset.table("field").geometry))
    dataset = dataclasses.replace(dataset, tables=dataset.tables | {"headland": parted})
    assert told in dropped(dataset, format_named("agopengps"))
    assert told not in dropped(dataset, format_named("isoxml"))


@pytest.mark.parametrize(("lon", "lat"), [(11.98, 50.0), (15.0, 70.0), (-70.0, -54.0)])
def test_the_repeated_reference_line_lies_on_the_explicit_ones(tmp_path, lon, lat):
    """At a zone's edge, far north and far south: 249 lines from the first, to a centimetre."""
    crs = utm_crs(lon, lat)
    x, y = transformer(CRS.from_epsg(4326), crs).transform(lon, lat)
    outline = shapely.affinity.rotate(shapely.box(x, y, x + 1000, y + 600), 20)
    plan = gf.Plan(Field(outline, crs), tracks=gf.plan_tracks(outline, crs=crs, spacing_m=4.0))
    plan.write(tmp_path, formats=["isoxml"])
    data = ET.parse(tmp_path / "isoxml" / "TASKDATA" / "TASKDATA.XML").getroot()
    reference, *explicit = list(data.iter("GPN"))
    line = reference.find("LSG")
    assert line.get("C") == "4000"
    (a, b) = [(float(p.get("D")), float(p.get("C"))) for p in line.findall("PNT")]
    azimuth, _, length = GEOD.inv(*a, *b)
    middle = GEOD.fwd(*a, azimuth, length / 2)[:2]
    flat = Transformer.from_crs(
        4326, CRS.from_proj4(f"+proj=aeqd +lat_0={middle[1]} +lon_0={middle[0]} +ellps=WGS84"),
        always_xy=True,
    )  # fmt: skip
    start, end = np.array(flat.transform([a[0], b[0]], [a[1], b[1]])).T
    along = (end - start) / np.hypot(*(end - start))
    worst, count = 0.0, 0
    for pattern in explicit:
        lonlat = np.array([[float(p.get("D")), float(p.get("C"))] for p in pattern.iter("PNT")])
        xy = np.column_stack(flat.transform(*lonlat.T))
        off = (xy - start) @ np.array([along[1], -along[0]])
        worst = max(worst, float(np.abs(off - 4.0 * np.round(off / 4.0)).max()))
        count = max(count, int(np.abs(np.round(off / 4.0)).max()))
    assert count >= 140
    assert worst < 0.01
    repeats = int(reference.get("N")) + int(reference.get("O"))
    assert repeats == len(plan.tracks.lines) - 1


FOREIGN = """<ISO11783_TaskData VersionMajor="4" VersionMinor="3" DataTransferOrigin="1">
<PFD A="PFD1" C="Nordfeld" D="20000"><PLN A="1"><LSG A="1">{field}</LSG></PLN>
<PLN A="3" B="Teich"><LSG A="1">{pond}</LSG></PLN><PLN A="4" B="Halle"><LSG A="1">{hall}</LSG></PLN>
<PLN A="5" B="Weg"><LSG A="1">{road}</LSG></PLN><PLN A="2"><LSG A="1">{road}</LSG></PLN>
<GGP A="GGP1"><GPN A="GPN1" B="A plus" C="2" G="90"><LSG A="5"><PNT A="6" C="50.0005" D="10.001"/>
</LSG></GPN></GGP>
<GGP A="GGP2"><GPN A="GPN2" B="Kreis" C="4" D="{turn}" {radius}><LSG A="5">
<PNT A="8" C="50.0005" D="10.001"/>{ends}</LSG></GPN></GGP></PFD></ISO11783_TaskData>"""


def box(west, south, east, north):
    corners = [(west, south), (east, south), (east, north), (west, north), (west, south)]
    return "".join(f'<PNT A="2" C="{y}" D="{x}"/>' for x, y in corners)


@pytest.mark.parametrize(("turn", "radius", "share"), [
    ("3", 'H="30000"', 1.0), ("1", "", 0.25), ("2", 'H="30000"', 0.75),
])  # fmt: skip
def test_water_buildings_roads_headings_and_pivots_of_other_programs(tmp_path, turn, radius, share):
    east = GEOD.fwd(10.001, 50.0005, 90.0, 30.0)
    north = GEOD.fwd(10.001, 50.0005, 0.0, 30.0)
    ends = f'<PNT A="6" C="{north[1]:.9f}" D="{north[0]:.9f}"/>'
    ends += f'<PNT A="7" C="{east[1]:.9f}" D="{east[0]:.9f}"/>'
    text = FOREIGN.format(
        field=box(10, 50, 10.002, 50.001), pond=box(10.0001, 50.0001, 10.0002, 50.0002),
        hall=box(10.0004, 50.0001, 10.0005, 50.0002), road=box(10.0007, 50.0001, 10.0008, 50.0002),
        turn=turn, radius=radius, ends=ends,
    )  # fmt: skip
    (tmp_path / "TASKDATA.XML").write_text(text, encoding="utf-8")
    done = run_geofield("import", tmp_path, "-o", tmp_path / "x.gpkg", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["rows"] == {"field": 1, "obstacles": 3, "tracks": 2, "segments": 2}
    for words in (
        "1 polygon of type water",
        "1 polygon of type building",
        "1 polygon of type road",
        "1 polygon left out: treatment zone",
        "an A+ line",
        "a pivot of 30.0 m",
    ):
        assert words in done.stderr  # fmt: skip
    back = read_dataset(tmp_path / "x.gpkg")
    assert ground_areas_m2(back.table("obstacles").geometry.to_numpy(), back.crs).min() > 70
    through, arc = back.table("segments").to_crs(4326).geometry
    assert GEOD.geometry_length(arc) == pytest.approx(2 * np.pi * 30 * share, rel=2e-3)
    assert through.bounds[::2] == pytest.approx((10, 10.002), abs=1e-8)
    azimuth, _, _ = GEOD.inv(*through.coords[0], *through.coords[-1])
    assert azimuth == pytest.approx(90, abs=0.01)
