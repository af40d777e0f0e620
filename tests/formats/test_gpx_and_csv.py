"""What phones and spreadsheets have: recorded lines and tables with positions, as a plan."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely
from formats_plan import make_dataset

from geofield.crs import LONLAT, reproject
from geofield.formats import read_dataset, write_dataset
from geofield_command import run_geofield as geofield

#: Round a field of about 143 x 111 m, from a corner to 11 m before it.
WALK = [(9.0, 50.0), (9.002, 50.0), (9.002, 50.001), (9.0, 50.001), (9.0, 50.0001)]


def gpx(path: Path, *tracks: list[tuple[float, float]], waypoints: str = "") -> Path:
    lines = "".join(
        "<trk>"
        + "".join(
            "<trkseg>"
            + "".join(f'<trkpt lat="{y}" lon="{x}"><ele>90</ele></trkpt>' for x, y in part)
            + "</trkseg>"
            for part in (track[:2], track[2:])
        )
        + "</trk>"
        for track in tracks
    )
    head = '<gpx version="1.1" creator="phone" xmlns="http://www.topografix.com/GPX/1/1">'
    path.write_text(f"{head}{waypoints}{lines}</gpx>")
    return path


def imported(folder: Path, *files: object) -> tuple[dict[str, int], str]:
    done = geofield("import", *files, "-o", folder / "plan.gpkg", "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["rows"], done.stderr


def test_a_recorded_boundary_and_a_table_of_trees_are_a_field(tmp_path: Path) -> None:
    mast = '<wpt lat="50.0005" lon="9.0006"><name>Mast</name></wpt>'
    walk = gpx(tmp_path / "walk.gpx", WALK, waypoints=mast)
    table = tmp_path / "trees.csv"
    table.write_text("name;Lat;Lon;Radius\nEiche;50,0003;9,001;3,5\nohne;;;2\n", encoding="utf-8")
    rows, said = imported(tmp_path, walk, table)
    assert rows == {"field": 1, "obstacles": 2}
    assert "1 line ends where it began: it is taken as an area" in said
    assert "walk: 1 polygon taken as the field, being the only one" in said
    assert "trees: 1 point taken as obstacles" in said
    assert "trees.csv: trees: 1 row has no shape and is left out" in said
    plan = read_dataset(tmp_path / "plan.gpkg")
    outline = shapely.Polygon(reproject(np.array([shapely.LineString(WALK)]), LONLAT, plan.crs)[0])
    assert plan.table("field").geometry.iloc[0].symmetric_difference(outline).area < 0.01
    assert plan.table("obstacles")["name"].tolist() == ["Mast", "Eiche"]
    assert plan.table("obstacles")["radius_m"].tolist() == [2.0, 3.5]
    done = geofield("tracks", tmp_path / "plan.gpkg", "--spacing", 6, "-o", tmp_path / "plan.gpkg")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("line", "rows"), [
    (WALK[:4], {"tracks": 2, "segments": 2}),  # the last side is missing
    ([WALK[0], (9.004, 50.0), (9.004, 50.00003), (9.0, 50.00003)], {"tracks": 2, "segments": 2}),
    (WALK, {"field": 1}),
    ([(x + 170.999, y) for x, y in WALK], {"field": 1}),
    ([((x + 350.999) % 360 - 180, y) for x, y in WALK], {"field": 1}),  # across 180
])  # fmt: skip
def test_a_line_that_goes_round_something_is_an_area(tmp_path, line, rows) -> None:
    """Not there and back, as two passes are."""
    assert imported(tmp_path, gpx(tmp_path / "a.gpx", line))[0] == rows
    if "field" in rows:
        area_ha = read_dataset(tmp_path / "plan.gpkg").table("field")["area_ha"].iloc[0]
        assert area_ha == pytest.approx(1.59, rel=0.02)


def test_our_own_come_back(tmp_path: Path) -> None:
    dataset = make_dataset()
    write_dataset(dataset, tmp_path, ["gpx", "csv"], tell_drops=False)
    kept = dataset.table("obstacles")
    round_ = kept["radius_m"].notna()
    columns = ["obstacle_no", "kind", "status", "radius_m", "buffer_m", "lat", "lon"]
    (tmp_path / "a").mkdir()
    rows, _ = imported(tmp_path / "a", tmp_path / "csv")
    assert rows == {"obstacles": len(kept), "track_points": len(dataset.table("track_points"))}
    back = read_dataset(tmp_path / "a" / "plan.gpkg")
    told = back.table("obstacles")[columns][round_.to_numpy()]
    for name in columns:
        assert told[name].tolist() == pytest.approx(kept[round_][name].tolist(), abs=6e-4), name
    shapes = back.table("obstacles").to_crs(dataset.crs).geometry[round_.to_numpy()]
    assert (
        shapes.symmetric_difference(kept.geometry[round_]).area < 0.05 * kept.area[round_]
    ).all()
    points = back.table("track_points")
    for name in ("point_no", "track_no", "segment_no", "lat", "lon"):
        assert np.allclose(points[name], dataset.table("track_points")[name], atol=1e-8), name
    (tmp_path / "b").mkdir()
    rows, _ = imported(tmp_path / "b", tmp_path / "field.gpx")
    assert rows["tracks"] == len(dataset.table("tracks"))
    assert rows["segments"] == len(dataset.table("segments"))
    back = read_dataset(tmp_path / "b" / "plan.gpkg")
    avoided = kept[~kept["status"].isin(["rejected", "possible"])]
    for name in ("obstacle_no", "kind", "buffer_m"):
        assert back.table("obstacles")[name].tolist() == pytest.approx(
            avoided[name].tolist(), abs=6e-3
        )
    for name in ("track_no", "segment_no"):
        assert back.table("segments")[name].tolist() == dataset.table("segments")[name].tolist()


def test_a_table_says_its_own_word(tmp_path: Path) -> None:
    utm = tmp_path / "utm.csv"
    utm.write_text("no,easting,northing\n7,500010,5538650\n")
    done = geofield("import", utm, "-o", tmp_path / "plan.gpkg")
    assert (done.returncode, "--crs EPSG:32633" in done.stderr) == (1, True)
    rows, _ = imported(tmp_path, utm, "--crs", "EPSG:32632")
    assert rows == {"obstacles": 1}
    assert read_dataset(tmp_path / "plan.gpkg").table("obstacles")["obstacle_no"].tolist() == [7]
    wkt = tmp_path / "field.csv"
    wkt.write_text('name,wkt\nHome,"POLYGON ((9 50, 9.002 50, 9.002 50.001, 9 50))"\n')
    done = geofield("info", wkt, "--json")
    assert json.loads(done.stdout)["rows"] == {"field": 1}
    empty = tmp_path / "empty.csv"
    empty.write_text("lat,lon\n")
    done = geofield("import", empty, "-o", tmp_path / "none.gpkg")
    assert (done.returncode, "holds no geometries" in done.stderr) == (1, True)


@pytest.mark.filterwarnings("ignore:.* no radius:geofield.errors.FormatWarning")
def test_points_in_our_own_columns_are_obstacles(tmp_path: Path) -> None:
    """They were left out, being no polygons."""
    dataset = make_dataset()
    kept = dataset.table("obstacles")
    points = kept.set_geometry(kept.centroid).to_crs(4326)
    points.to_file(tmp_path / "obstacles.geojson")
    found = read_dataset(tmp_path / "obstacles.geojson").table("obstacles")
    assert found["obstacle_no"].tolist() == kept["obstacle_no"].tolist()
    assert found["status"].tolist() == kept["status"].tolist()


def test_lines_beside_a_plans_own_tracks_are_told(tmp_path: Path) -> None:
    dataset = make_dataset()
    write_dataset(dataset, tmp_path, ["geojson"], tell_drops=False)
    line = gpd.GeoSeries([dataset.table("tracks").geometry.iloc[0]], crs=dataset.crs).to_crs(4326)
    line.to_file(tmp_path / "geojson" / "drawn.geojson")
    notes = read_dataset(tmp_path / "geojson").notes
    assert any("beside the plan's own tracks" in note for note in notes)


def test_a_boundary_is_found_among_empty_layers(tmp_path: Path) -> None:
    """Of a GPX the first one was taken, that of waypoints."""
    walk = gpx(tmp_path / "walk.gpx", [*WALK, WALK[0]])
    text = walk.read_text().replace("</trkseg><trkseg>", "")
    walk.write_text(text)
    picture = Path(__file__).parents[2] / "sample_data" / "field_1.tif"
    done = geofield("field", picture, "--boundary", walk, "-o", tmp_path / "a.gpkg")
    # It was read, and is another place than the picture's.
    assert "lies outside the picture" in done.stderr


def test_obstacles_of_unknown_size_are_not_driven_through(tmp_path: Path) -> None:
    """A GPX has their places alone: where they stand is no fault of its lines."""
    dataset = make_dataset()
    line = dataset.table("segments").geometry.iloc[0].centroid
    beside = shapely.box(line.x - 20, line.y + 0.3, line.x + 20, line.y + 0.6)
    fence = dataset.table("obstacles").iloc[:1].assign(radius_m=np.nan, status="confirmed")
    tables = {**dataset.tables, "obstacles": fence.set_geometry([beside], crs=dataset.crs)}
    write_dataset(replace(dataset, tables=tables), tmp_path, ["gpx"], tell_drops=False)
    done = geofield("validate", tmp_path / "field.gpx")
    assert (done.returncode, "runs through" in done.stdout) == (0, False), done.stdout


def test_a_walk_round_a_pond_is_what_stands_in_the_field(tmp_path: Path) -> None:
    pond = [(9.0005, 50.0005), (9.0007, 50.0005), (9.0007, 50.0006), (9.0005, 50.0006)]
    line = [(9.0001, 50.0002), (9.0019, 50.0002)]
    once = [(9.0001, 50.0002)]  # a recording that was stopped at once
    walks = gpx(tmp_path / "a.gpx", [*pond, pond[0]], [*WALK, WALK[0], (9.0001, 50.0)], line, once)
    rows, said = imported(tmp_path, walks)
    assert (rows["field"], rows["obstacles"], rows["tracks"]) == (1, 1, 1)
    assert "2 lines end where they began: they are taken as areas" in said
    assert "1 polygon inside it taken as obstacles" in said
