"""Evaluation: one-to-one matching and the figures that follow from it."""

import json

import geopandas as gpd
import numpy as np
import pytest
import rasterio
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image
from rasterio.transform import from_origin
from shapely import Point, box

import geofield as gf
from geofield.errors import CRSError, ObstacleError, ObstacleWarning
from geofield.evaluation import draw_matches, match_points, reliability
from geofield.evaluation.picture import FALSE, HIT

UTM = "EPSG:32636"


def table(points, radius=None, crs=UTM):
    radius = np.full(len(points), 3.0) if radius is None else np.asarray(radius, float)
    shapes = [Point(p).buffer(r + 1) for p, r in zip(points, radius, strict=True)]
    return gpd.GeoDataFrame({"radius_m": radius}, geometry=shapes, crs=crs)


def test_a_truth_is_matched_once():
    match = match_points([[0, 0], [1, 0]], [[0.4, 0]], 5)
    assert match.truth_index.tolist() == [0]
    assert match.detected_index.tolist() == [0]
    assert match.false_index.tolist() == [1]


@pytest.mark.parametrize("scale", [0.01, 1.0, 40.0])
def test_as_many_hits_as_possible_come_before_short_distances(scale):
    # The nearest pair (1, 0) would leave the other two apart.
    found, true = scale * np.array([[0.0, 0], [3.0, 0]]), scale * np.array([[2.0, 0], [6.0, 0]])
    match = match_points(found, true, 3.5 * scale)
    assert match.detected_index.tolist() == match.truth_index.tolist() == [0, 1]
    assert match.distance == pytest.approx([2 * scale, 3 * scale])


@given(
    arrays(float, st.tuples(st.integers(0, 12), st.just(2)), elements=st.floats(0, 40)),
    arrays(float, st.tuples(st.integers(0, 12), st.just(2)), elements=st.floats(0, 40)),
)
def test_matching_is_one_to_one_and_symmetric(a, b):
    match = match_points(a, b, 6)
    assert len(set(match.detected_index)) == len(match.detected_index)
    assert len(set(match.truth_index)) == len(match.truth_index)
    assert np.all(match.distance <= 6)
    assert len(match_points(b, a, 6).truth_index) == len(match.truth_index)
    assert (match.detected_count, match.truth_count) == (len(a), len(b))


def test_figures_of_a_hand_made_case():
    found = table([(0, 0), (20, 0), (40, 0)], [3.5, 2.5, 3])
    truth = table([(1, 0), (20, 2), (80, 0), (90, 0)], [3, 3, 3, 3])
    score = gf.evaluate(found, truth, distance_m=6).pooled
    assert (score.hits, score.detected, score.truth) == (2, 3, 4)
    assert score.precision == pytest.approx(2 / 3)
    assert score.recall == pytest.approx(0.5)
    assert score.f1 == pytest.approx(4 / 7)
    assert score.radius_bias == pytest.approx(0)
    assert score.radius_error == pytest.approx(0.5)
    # On the ground: 500 km off the zone's middle it draws a metre 0.27 % longer.
    assert score.distance == pytest.approx(1.5 / 1.0027, rel=1e-4)
    for name in ("precision", "recall", "f1"):
        low, high = score.interval[name]
        assert 0.0 <= low < getattr(score, name) < high <= 1.0
    assert score.interval["radius_bias"] == pytest.approx((-0.5, 0.5))


def test_truth_may_be_points_or_boxes_in_degrees():
    found = table([(500_000, 4_000_000), (500_050, 4_000_000)])
    points = gpd.GeoDataFrame(
        geometry=[Point(500_001, 4_000_000), Point(500_052, 4_000_000)], crs=UTM
    )
    boxes = gpd.GeoDataFrame(
        geometry=[box(499_997, 3_999_997, 500_003, 4_000_003)], crs=UTM
    ).to_crs(4326)
    by_points = gf.evaluate(found, points.to_crs(4326)).pooled
    assert by_points.f1 == 1
    assert np.isnan(by_points.radius_bias)
    by_boxes = gf.evaluate(found, boxes).pooled
    assert (by_boxes.hits, by_boxes.detected) == (1, 2)
    assert by_boxes.radius_bias == pytest.approx(3 - 6 / np.sqrt(np.pi), abs=0.05)


def test_rejected_rows_and_rows_outside_the_area_do_not_count():
    found = table([(0, 0), (20, 0), (200, 0)])
    found["status"] = ["detected", "rejected", "detected"]
    truth = table([(0, 0), (20, 0)])
    score = gf.evaluate(found, truth, area=box(-5, -5, 50, 5)).pooled
    assert (score.hits, score.detected, score.truth) == (1, 1, 2)


def test_several_pictures_are_pooled():
    found = {str(k): table([(0, 0), (30, 0)]) for k in range(6)}
    truth = {str(k): table([(0, 0)] * (k > 0)) for k in range(6)}
    result = gf.evaluate(found, truth)
    assert result.pooled.hits == 5
    assert result.images["0"].hits == 0
    assert np.isnan(result.images["0"].recall)
    assert result.pooled.as_dict()["detected"] == 12


def test_doubt_is_that_of_pictures_where_there_are_five():
    """One picture of many misses: whether it is among those drawn is all that counts."""
    there = [(30.0 * k, 0.0) for k in range(40)]
    truth = {str(k): table(there if k == 0 else there[:1]) for k in range(5)}
    found = {name: each[:1] for name, each in truth.items()}
    low, high = gf.evaluate(found, truth).pooled.interval["recall"]
    assert low < 0.06
    assert high == 1.0
    four = [{name: each[name] for name in "0123"} for each in (found, truth)]
    low, high = gf.evaluate(*four).pooled.interval["recall"]
    assert 0.0 < low < 4 / 43 < high < 0.3


def test_nothing_against_nothing():
    assert gf.evaluate({}, {}).pooled.truth == 0
    score = gf.evaluate(table([]), table([])).pooled
    assert score.detected == score.truth == 0
    assert score.as_dict()["f1"] is None


def test_bad_input_is_refused():
    with pytest.raises(ObstacleError, match="distance"):
        gf.evaluate(table([]), table([]), distance_m=0)
    with pytest.raises(CRSError, match="metric"):
        gf.evaluate(table([(1, 1)], crs=4326), table([(1, 1)]))
    with pytest.raises(CRSError, match="need a CRS"):
        gf.evaluate(table([], crs=None), table([]))
    with pytest.raises(ObstacleError, match="not both"):
        gf.evaluate({"a": table([])}, {"b": table([])})
    with pytest.raises(ObstacleError, match="`truth` must be a GeoDataFrame, not str"):
        gf.evaluate(table([]), "truth.gpkg")


def test_reliability_of_honest_and_boastful_confidences():
    rng = np.random.default_rng(3)
    p = rng.random(20_000)
    hit = rng.random(p.size) < p
    assert reliability(p, hit)[3] < 0.02
    assert reliability(np.sqrt(p), hit)[3] > 0.1
    mean, share, count, error = reliability([0.0, 1.0, 0.95], [False, True, True], bins=4)
    assert count.tolist() == [1, 0, 0, 2]
    assert mean[[0, 3]] == pytest.approx([0.0, 0.975])
    assert share[[0, 3]].tolist() == [0.0, 1.0]
    assert np.isnan(mean[1])
    assert error == pytest.approx(0.05 / 3)
    assert np.isnan(reliability([], [])[3])


def test_false_ones_that_are_no_trees_are_told(tmp_path, capsys):
    from geofield.cli import main

    base = (500_000, 4_000_000)
    places = [base, (base[0] + 40, base[1]), (base[0] + 80, base[1]), (base[0] + 120, base[1])]
    found = table(places).assign(kind=["tree", "tree", "other", "other"])
    truth = table([base, places[3]])
    assert gf.evaluate(found, truth).false_kinds == {"tree": 1, "other": 1}
    assert gf.evaluate(table(places), truth).false_kinds == {}
    found.to_file(tmp_path / "found.gpkg", layer="obstacles")
    truth.to_file(tmp_path / "truth.gpkg")
    with pytest.raises(SystemExit, match="0"):
        main(["evaluate", str(tmp_path / "found.gpkg"), str(tmp_path / "truth.gpkg")])
    assert "1 of 2 false ones of kind other" in capsys.readouterr().err
    found.iloc[[0, 2]].to_file(tmp_path / "one.gpkg", layer="obstacles")
    with pytest.raises(SystemExit, match="0"):
        main(["evaluate", str(tmp_path / "one.gpkg"), str(tmp_path / "truth.gpkg")])
    assert "1 of 1 false one of kind other" in capsys.readouterr().err


def test_a_reviewed_plan_is_a_truth(tmp_path, capsys):
    """Of its layers the obstacles are meant, and what a person rejected is none."""
    from geofield.cli import main

    plan = gf.read_plan("sample_data/field_1.gpkg")
    status = ["rejected", "possible", *["confirmed"] * (len(plan.obstacles) - 2)]
    file = tmp_path / "reviewed.gpkg"
    plan.to_dataset().tables["field"].to_file(file, layer="field")
    plan.obstacles.assign(status=status).to_file(file, layer="obstacles")
    with pytest.raises(SystemExit) as end:
        main(["evaluate", "sample_data/field_1.gpkg", str(file), "--json"])
    assert end.value.code == 0
    figures = json.loads(capsys.readouterr().out)
    count = len(plan.obstacles)
    assert (figures["hits"], figures["truth"], figures["detected"]) == (count - 2, count - 2, count)


def test_the_command_prints_figures_and_draws(tmp_path, capsys):
    from geofield.cli import main

    base = (500_000, 4_000_000)
    found = table([base, (base[0] + 40, base[1])])
    truth = table([base, (base[0], base[1] + 60)])
    found.to_file(tmp_path / "found.gpkg", layer="obstacles")
    truth.to_crs(4326).to_file(tmp_path / "truth.geojson")
    arguments = [str(tmp_path / "found.gpkg"), str(tmp_path / "truth.geojson")]
    with pytest.raises(SystemExit, match="0"):
        main(["evaluate", *arguments, "--json", "--draw", str(tmp_path / "hits.png")])
    out = capsys.readouterr().out
    assert '"hits": 1' in out
    with Image.open(tmp_path / "hits.png") as picture:
        colours = {c for _, c in picture.getcolors(10_000)}
    assert {(40, 200, 90), (60, 150, 255), (235, 60, 50)} <= colours
    # Neither a picture that is there is replaced unasked, nor ever the one that is drawn on.
    for place, more in (("hits.png", []), ("scene.png", ["--overwrite"])):
        (tmp_path / "scene.png").write_bytes(b"mine")
        scene = ["--scene", str(tmp_path / "scene.png"), "--draw", str(tmp_path / place)]
        with pytest.raises(SystemExit, match="1"):  # before the layer is looked for
            main(["evaluate", *arguments, *scene, *more, "--layer", "none"])
        assert ("is there already" if not more else "is an input") in capsys.readouterr().err
        assert (tmp_path / "scene.png").read_bytes() == b"mine"
    with pytest.raises(SystemExit, match="0"):
        main(["evaluate", *arguments, "--draw", str(tmp_path / "hits.png"), "--overwrite"])


def test_a_truth_in_a_table(tmp_path, capsys):
    """In longitude and latitude, or x and y of the plan; it was taken for a file of no layers."""
    from geofield.cli import main

    found = table([(500_000, 4_000_000), (500_040, 4_000_000)])
    found.to_file(tmp_path / "found.gpkg", layer="obstacles")
    for crs, names in ((4326, ("lon", "lat")), (found.crs, ("x", "y"))):
        places = found.geometry.centroid.to_crs(crs)
        (tmp_path / "truth.csv").write_text(
            "\n".join([",".join(names), *(f"{one.x!r},{one.y!r}" for one in places)])
        )
        with pytest.raises(SystemExit, match="0"):
            main(["evaluate", str(tmp_path / "found.gpkg"), str(tmp_path / "truth.csv"), "--json"])
        said = capsys.readouterr()
        assert '"hits": 2' in said.out
        assert ("taken as of found.gpkg" in said.err) == (crs == found.crs)
    with pytest.raises(SystemExit, match="1"):  # of what DETECTED has nobody knows the CRS
        main(["evaluate", str(tmp_path / "truth.csv"), str(tmp_path / "found.gpkg")])
    assert "truth.csv has no CRS" in capsys.readouterr().err


@pytest.mark.parametrize("rows", ["", '{"type": "Feature", "properties": {}, "geometry": null}'])
def test_a_file_in_degrees_in_which_nothing_lies_anywhere(tmp_path, capsys, rows):
    from geofield.cli import main

    none = tmp_path / "none.geojson"
    none.write_text(f'{{"type": "FeatureCollection", "features": [{rows}]}}')
    with pytest.raises(SystemExit, match="0"):
        main(["evaluate", str(none), "sample_data/field_1.gpkg", "--json"])
    figures = json.loads(capsys.readouterr().out)
    assert (figures["hits"], figures["detected"], figures["truth"]) == (0, 0, 21)
    assert figures["recall"] == 0.0


def test_a_truth_of_another_place_is_told():
    found = table([(500_000, 4_000_000)])
    turned = found.to_crs(4326).geometry.transform(lambda xy: xy[:, ::-1])
    with pytest.warns(ObstacleWarning, match=r"The truth lies [\d,]+ km from the obstacles"):
        result = gf.evaluate(found, gpd.GeoDataFrame(geometry=turned, crs=4326), bootstrap=0)
    assert result.pooled.hits == 0


@pytest.mark.parametrize("drawn", ["outside", "no shape", "nothing"])
def test_drawing_shows_the_rows_that_were_compared(tmp_path, drawn):
    found, area = table([(0, 0), (5000, 0)]), None
    if drawn == "outside":
        area = found.geometry.iloc[0].buffer(100)
    elif drawn == "no shape":
        found.loc[found.index[1], "geometry"] = None
    else:
        found = found[:0]
    truth = found[:1].set_geometry(found[:1].centroid)
    result = gf.evaluate(found, truth, area=area, bootstrap=0)
    draw_matches(found, truth, result, tmp_path / "hits.png", area=area)
    with Image.open(tmp_path / "hits.png") as picture:
        colours = {c for _, c in picture.getcolors(10_000)}
    assert colours == ({(255, 255, 255)} if drawn == "nothing" else {(255, 255, 255), HIT})


@pytest.mark.parametrize(("columns", "rows"), [(300, 200), (5000, 150)])
def test_drawing_on_a_picture_however_large(tmp_path, capsys, columns, rows):
    """Of one above 4096 px the command asked for a point, which it has no option for."""
    from geofield.cli import main

    x, y, size = 500_000.0, 5_500_000.0, 0.5
    scene = {"driver": "GTiff", "width": columns, "height": rows, "count": 3, "dtype": "uint8"}
    place = {"crs": UTM, "transform": from_origin(x, y, size, size)}
    with rasterio.open(tmp_path / "scene.tif", "w", **scene, **place) as file:
        file.write(np.full((3, rows, columns), 120, np.uint8))
    shares = np.array([[0.25, 0.4], [0.75, 0.6]])
    found = table(shares * [columns, -rows] * size + [x, y])
    found.to_file(tmp_path / "found.gpkg", layer="obstacles")
    found[:1].to_file(tmp_path / "truth.gpkg")
    files = [str(tmp_path / name) for name in ("found.gpkg", "truth.gpkg")]
    more = ["--scene", str(tmp_path / "scene.tif"), "--draw", str(tmp_path / "hits.png")]
    with pytest.raises(SystemExit, match="0"):
        main(["evaluate", *files, *more])
    assert "Drawn to" in capsys.readouterr().err
    with Image.open(tmp_path / "hits.png") as picture:
        drawn = np.asarray(picture.convert("RGB"))
    assert (drawn == 120).all(axis=2).any()
    for share, colour in zip(shares, (HIT, FALSE), strict=True):
        row, column = np.nonzero((drawn == colour).all(axis=2))
        middle = np.array([(column.min() + column.max()) / 2, (row.min() + row.max()) / 2])
        assert middle == pytest.approx(share * drawn.shape[1::-1], abs=2)


def test_drawing_shows_detections_that_are_points(tmp_path):
    found = table([(0, 0), (500, 0)])
    points = found.set_geometry(found.centroid)
    result = gf.evaluate(points, found[:0], bootstrap=0)
    draw_matches(points, found[:0], result, tmp_path / "hits.png")
    with Image.open(tmp_path / "hits.png") as picture:
        assert FALSE in {c for _, c in picture.getcolors(10_000)}


def test_distances_are_those_on_the_ground():
    # World Mercator at 60 degrees draws a metre twice as long.
    base = gpd.GeoSeries([Point(33.0, 60.0)], crs=4326).to_crs(UTM).iloc[0]
    found = table([(base.x, base.y)])
    truth = table([(base.x + 5, base.y)])
    for crs in (UTM, "EPSG:3395"):
        result = gf.evaluate(found.to_crs(crs), truth, distance_m=6, bootstrap=0)
        assert result.pooled.hits == 1
        assert result.pooled.distance == pytest.approx(5, abs=0.02)


@pytest.mark.parametrize("wrong", ["no shapes", "radius in words", "no folder", "no degrees"])
def test_the_command_says_what_is_wrong(tmp_path, capsys, wrong):
    import pandas as pd
    import pyogrio

    from geofield.cli import main

    found, file = table([(500_000, 4_000_000)]), tmp_path / "found.gpkg"
    arguments, words = [], "is a table without shapes"
    if wrong == "no shapes":
        pyogrio.write_dataframe(pd.DataFrame({"radius_m": [2.0]}), file, layer="obstacles")
    elif wrong == "radius in words":
        found.assign(radius_m="3 m").to_file(file, layer="obstacles")
        words = "holds words, as '3 m'"
    elif wrong == "no degrees":  # ended in a traceback of geopandas
        found.set_crs(4326, allow_override=True).to_file(file, layer="obstacles")
        words = "is not a place on earth"
    else:
        found.to_file(file, layer="obstacles")
        arguments, words = ["--draw", str(tmp_path / "none" / "hits.png")], "hits.png"
    with pytest.raises(SystemExit, match="1"):
        main(["evaluate", str(file), str(file), *arguments])
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said
