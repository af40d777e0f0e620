"""True metres: what a tape on the ground measures, by geodesics, wherever the field lies."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely
from pyproj import CRS, Geod, Transformer

from geofield.crs import ground_areas_m2, ground_scale, metric_crs
from geofield.errors import CRSError
from geofield.tracks import plan_tracks
from geofield_command import run_geofield

GEOD = Geod(ellps="WGS84")
MM = 1e-3
PLACES = {
    "the equator at a zone's edge": (17.998, 0.1),
    "the middle of a zone": (15.0, 35.0),
    "a zone's western edge": (12.004, 48.0),
    "70 degrees north": (23.98, 70.0),
    "the far south": (-72.01, -54.0),
    "the wide zone of Norway": (3.01, 60.5),
}


def away(lon: float, lat: float, azimuth: float, metres: float) -> tuple[float, float]:
    x, y, _ = GEOD.fwd(lon, lat, azimuth, metres)
    return x, y


def parcel(place: tuple[float, float], width_m: float, height_m: float) -> shapely.Polygon:
    """A rectangle of geodesics, its long side 20 degrees from east."""
    corner, ring = place, [place]
    for azimuth, length in ((70.0, width_m), (340.0, height_m), (250.0, width_m)):
        corner = away(*corner, azimuth, length)
        ring.append(corner)
    return shapely.Polygon(ring)


def geofield(*arguments: str | Path) -> str:
    done = run_geofield(*arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def plane_at(lonlat: tuple[float, float], crs: CRS) -> Transformer:
    """From a CRS to a plane in which distances from one place are exact."""
    plane = f"+proj=aeqd +lon_0={lonlat[0]} +lat_0={lonlat[1]} +datum=WGS84"
    return Transformer.from_crs(crs, plane, always_xy=True)


def distance_m(line: shapely.LineString, other: shapely.LineString, crs: CRS) -> float:
    """From the middle of one line to another line, metres on the ground."""
    x, y = line.interpolate(0.5, normalized=True).coords[0]
    middle = Transformer.from_crs(crs, 4326, always_xy=True).transform(x, y)
    project = plane_at(middle, crs)
    # A straight line of the map is bent a little in the plane: take many places of it.
    places = shapely.get_coordinates(shapely.segmentize(other, 20.0))
    flat = shapely.LineString(np.column_stack(project.transform(*places.T)))
    return float(shapely.distance(shapely.Point(0, 0), flat))


@pytest.fixture(scope="module", params=PLACES, ids=lambda name: name.replace(" ", "-"))
def planned(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("ground")
    place = PLACES[request.param]
    field = parcel(place, 500.0, 400.0)
    gpd.GeoDataFrame({"name": ["far"]}, geometry=[field], crs=4326).to_file(
        folder / "far.geojson", driver="GeoJSON"
    )
    tree = away(*away(*place, 70.0, 250.0), 340.0, 200.0)
    gpd.GeoDataFrame({"radius_m": [9.0]}, geometry=[shapely.Point(tree)], crs=4326).to_file(
        folder / "tree.geojson", driver="GeoJSON"
    )
    report = geofield(
        "tracks", folder / "far.geojson", "--obstacles", folder / "tree.geojson", "--clearance",
        "1", "--spacing", "4", "--headland", "24", "--route", "boustrophedon",
        "--turning-radius", "6", "--direction", "160", "-o", folder / "far.gpkg", "--json",
    )  # fmt: skip
    geofield(
        "export", folder / "far.gpkg", "--format", "isoxml", "--format", "csv", "--out", folder,
    )  # fmt: skip
    layers = {
        name: pyogrio.read_dataframe(folder / "far.gpkg", layer=name)
        for name in ("field", "obstacles", "segments", "headland", "headland_tracks", "turns")
    }
    return folder, field, tree, json.loads(report)["fields"][0], layers


def test_neighbouring_tracks_and_all_of_them_are_spaced_as_asked(planned):
    _, _, _, row, layers = planned
    segments = layers["segments"]
    whole = segments[segments["length_m"] > 300].sort_values("track_no")
    numbers, lines = whole["track_no"].to_list(), whole.geometry.to_list()
    crs = CRS(segments.crs)
    assert row["track_count"] > 100
    for a, b, first, second in list(
        zip(numbers, numbers[1:], *zip(*pairwise(lines), strict=True), strict=False)
    )[::20]:
        assert distance_m(first, second, crs) == pytest.approx(4.0 * (b - a), abs=MM)
    across = 4.0 * (numbers[-1] - numbers[0])
    assert across > 440
    assert distance_m(lines[0], lines[-1], crs) == pytest.approx(across, abs=MM)


def test_lengths_and_areas_are_those_on_the_ground(planned):
    folder, field, _, row, layers = planned
    segments = layers["segments"]
    for line, told in list(zip(segments.to_crs(4326).geometry, segments["length_m"], strict=True))[
        ::15
    ]:
        assert GEOD.geometry_length(line) == pytest.approx(told, abs=MM)
    true_m2, around_m = GEOD.geometry_area_perimeter(shapely.orient_polygons(field))
    # A square metre: the sides are straight on the map, not on the ellipsoid.
    assert row["area_ha"] * 1e4 == pytest.approx(true_m2, abs=1.0)
    assert layers["field"]["area_ha"].iloc[0] == row["area_ha"]
    assert layers["field"]["perimeter_m"].iloc[0] == pytest.approx(around_m, abs=MM)
    strip = layers["headland"]
    by_shape = ground_areas_m2(strip.geometry.to_numpy(), CRS(strip.crs))[0]
    assert strip["area_ha"].iloc[0] * 1e4 == pytest.approx(by_shape, abs=0.01)
    geofield("validate", folder / "far.gpkg")


def test_circles_headland_and_turns_have_the_size_asked_for(planned):
    _, _, tree, _, layers = planned
    segments = layers["segments"]
    crs = CRS(segments.crs)
    to_tree = plane_at(tree, crs)

    def flat(shape: shapely.Geometry, project: Transformer = to_tree) -> shapely.Geometry:
        return shapely.transform(shape, lambda c: np.column_stack(project.transform(*c.T)))

    corners = shapely.get_coordinates(flat(layers["obstacles"].geometry.iloc[0]))
    assert np.hypot(*corners.T) == pytest.approx(9.0, abs=MM)
    ends = np.hypot(*shapely.get_coordinates([flat(s) for s in segments.geometry]).T)
    near = np.sort(ends)[:4]
    # The ends of the gaps lie on the circle of 9 m and the clearance of 1 m.
    assert near == pytest.approx(10.0, abs=MM)

    ring = layers["headland_tracks"]
    first = ring[ring["pass_no"] == 1].geometry.iloc[0]
    border = shapely.LineString(shapely.get_coordinates(layers["field"].geometry.iloc[0]))
    side = shapely.LineString(shapely.get_coordinates(first)[:2])
    assert distance_m(side, border, crs) == pytest.approx(2.0, abs=MM)

    arcs = layers["turns"]
    arcs = arcs[arcs["kind"] == "dubins"]
    assert len(arcs) > 100
    place = shapely.get_coordinates(arcs.geometry.iloc[0])[3:6]
    middle = Transformer.from_crs(crs, 4326, always_xy=True).transform(*place[1])
    a, b, c = np.column_stack(plane_at(middle, crs).transform(*place.T))
    sides = [np.hypot(*(p - q)) for p, q in ((a, b), (b, c), (c, a))]
    twice = abs((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])
    assert np.prod(sides) / (2.0 * twice) == pytest.approx(6.0, abs=MM)


def test_the_terminal_repeats_the_tracks_that_are_there(planned):
    """ISOXML: the spacing of the reference line is that of the lines beside it."""
    folder, _, _, row, _ = planned
    root = ET.parse(folder / "isoxml" / "TASKDATA" / "TASKDATA.XML").getroot()
    assert {line.get("C") for line in root.iter("LSG") if line.get("A") == "5"} == {"4000"}
    part = root.find("PFD")
    assert part is not None
    assert int(part.get("D", "0")) == round(row["area_ha"] * 1e4)


def test_points_are_a_true_step_apart(planned):
    folder = planned[0]
    (table,) = folder.rglob("*track_points*.csv")
    rows = np.genfromtxt(table, delimiter=",", names=True, max_rows=200, encoding="utf-8")
    one = rows[rows["track_no"] == rows["track_no"][0]]
    _, _, steps = GEOD.inv(one["lon"][:-1], one["lat"][:-1], one["lon"][1:], one["lat"][1:])
    assert np.asarray(steps)[:100] == pytest.approx(1.0, abs=MM)


@pytest.mark.parametrize("place", PLACES.values(), ids=[n.replace(" ", "-") for n in PLACES])
def test_no_error_adds_up_over_250_tracks(place):
    crs = metric_crs(*place)
    project = Transformer.from_crs(4326, crs, always_xy=True)
    field = shapely.transform(
        parcel(place, 1000.0, 400.0), lambda c: np.column_stack(project.transform(*c.T))
    )
    segments = plan_tracks(field, crs=crs, spacing_m=3.75, direction=160.0).segments
    lines = segments.geometry.to_list()
    assert len(lines) > 250
    steps = segments["track_no"].iloc[-1] - segments["track_no"].iloc[0]
    assert distance_m(lines[0], lines[-1], crs) == pytest.approx(3.75 * steps, abs=MM)


@pytest.mark.parametrize("place", PLACES.values(), ids=[n.replace(" ", "-") for n in PLACES])
def test_the_scale_is_that_of_short_geodesics(place):
    crs = metric_crs(*place)
    to_crs = Transformer.from_crs(4326, crs, always_xy=True)
    x, y = to_crs.transform(*place)
    for azimuth in (10.0, 100.0):
        ends = [away(place[0], place[1], azimuth + turn, 5.0) for turn in (0.0, 180.0)]
        (x0, y0), (x1, y1) = (to_crs.transform(*end) for end in ends)
        assert np.hypot(x1 - x0, y1 - y0) / 10.0 == pytest.approx(ground_scale(crs, x, y), rel=2e-9)


def test_a_national_grid_of_another_datum_counts_as_well():
    """The British grid is 20 parts in a million off besides its own scale."""
    crs = CRS.from_epsg(27700)
    lon, lat = 0.5, 52.0
    to_crs = Transformer.from_crs(4326, crs, always_xy=True)
    (x0, y0), (x1, y1) = (to_crs.transform(*away(lon, lat, turn, 500.0)) for turn in (30.0, 210.0))
    x, y = to_crs.transform(lon, lat)
    apart = np.hypot(x1 - x0, y1 - y0) / ground_scale(crs, x, y)
    assert apart == pytest.approx(1000.0, abs=MM)


@pytest.mark.parametrize(
    ("code", "place"),
    [
        (5070, (-120.0, 47.0)),
        (3035, (-8.0, 39.0)),
        (3035, (13.0, 52.0)),  # by 0.03 %
        (4087, (10.0, 60.0)),
    ],
)
def test_a_grid_that_has_no_one_scale_is_refused(code, place):
    """In Portugal passes in that of Europe ran at 44.2 degrees for 45, 5.93 m apart for 6."""
    x, y = Transformer.from_crs(4326, code, always_xy=True).transform(*place)
    with pytest.raises(CRSError, match=f"EPSG:{code} stretches .*\n?.*UTM"):
        plan_tracks(shapely.box(x, y, x + 300, y + 300), crs=code, spacing_m=6.0, direction=45.0)


@pytest.mark.parametrize("clearance_m", [18.0, 50.0])
def test_a_clearance_is_kept_around_corners_and_ends_too(clearance_m: float) -> None:
    """Machines of 36 m keep half their width: chords cut corners by 2 cm, and by 6 cm at 50 m."""
    middle = shapely.Point(500100, 5600100)
    field = shapely.box(500000, 5600000, 500200, 5600200)
    pole = shapely.box(500099, 5600098, 500101, 5600102)
    fence = shapely.LineString([(500090, 5600095), middle.coords[0]])
    for obstacle in (pole, fence):
        tracks = plan_tracks(
            field, [obstacle], crs="EPSG:32632", spacing_m=1, direction=31, clearance_m=clearance_m
        )
        assert len(tracks.gaps) > 30
        near_m = tracks.segments.distance(obstacle).min() / tracks.ground_scale
        assert near_m == pytest.approx(clearance_m, abs=0.0011)
