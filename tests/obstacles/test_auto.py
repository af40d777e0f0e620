"""The default detector on simulated fields with known truth, and on bad input."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
import shapely
from affine import Affine

import geofield as gf
from geofield import schema
from geofield.errors import FieldError, ObstacleError, ObstacleWarning
from geofield.model.circles import Circles
from geofield.model.obstacles import active
from geofield.model.scene import Scene
from geofield.obstacles.costs import thresholds
from geofield.obstacles.crowns import ALIGN_PX, CELL_PX
from geofield.obstacles.detect import STRATEGIES
from geofield.obstacles.picture import WHOLE_PX, WORKING_RESOLUTION_M, working_factor
from geofield.obstacles.standing import StandingMap
from geofield.simulate import SimulationSettings, simulate_field


@pytest.fixture(scope="module")
def detected(simulated):
    return gf.detect_obstacles(simulated.scene, simulated.field)


def without(scene, *roles):
    """The same picture with fewer bands."""
    keep = [i for i, role in enumerate(scene.roles) if role not in roles]
    return Scene(scene.grid, scene.bands[keep], tuple(scene.roles[i] for i in keep), scene.valid)


def test_the_trees_of_a_field_are_found(simulated, detected):
    score = gf.evaluate(detected, simulated.obstacles, distance_m=3.6).pooled
    assert score.f1 > 0.9
    assert abs(score.radius_bias) < 0.3


def test_the_table_is_complete(simulated, detected):
    assert list(detected.columns) == [*schema.OBSTACLES.column_names, "geometry"]
    assert detected.crs == simulated.field.crs
    trees = detected[detected["kind"] == "tree"]
    assert detected["obstacle_no"].tolist() == list(range(1, len(detected) + 1))
    assert trees["confidence"].between(0, 1).all()
    assert trees["radius_m"].between(1, 15).all()
    sure = detected["confidence"] >= detected.attrs["detection"]["threshold"]
    assert detected["status"].tolist() == ["detected" if s else "possible" for s in sure]
    order = trees[["y_px", "x_px"]].to_numpy()
    assert order.tolist() == sorted(order.tolist())
    area = shapely.area(trees.geometry.to_numpy())
    full = np.pi * (trees["radius_m"] + trees["buffer_m"]).to_numpy() ** 2
    assert area == pytest.approx(full, rel=0.01)
    told = detected.attrs["detection"]
    assert told["strategy"] == "auto"
    assert told["method"] == "network_nir"


@pytest.mark.parametrize("missing", [("nir",), ("nir", "red", "blue")])
def test_fewer_bands_still_find_trees(simulated, missing):
    scene = without(simulated.scene, *missing)
    found = gf.detect_obstacles(scene, simulated.field)
    assert gf.evaluate(found, simulated.obstacles, distance_m=3.6).pooled.recall > 0.7


def test_a_hole_in_the_outline_is_searched_too(simulated):
    tree = simulated.obstacles.geometry.iloc[0].buffer(2)
    cut = gf.Field(simulated.field.polygon.difference(tree), simulated.field.crs)
    found = gf.detect_obstacles(simulated.scene, cut)
    assert found.geometry.intersects(tree.centroid).any()


def test_a_crown_that_leans_in_from_outside_is_driven_around(simulated):
    field = simulated.field
    tree = simulated.obstacles.sort_values("radius_m").iloc[-1]
    x, y = (float(v) for v in tree.geometry.centroid.coords[0])
    # The field ends half a radius before the trunk.
    _, low, right, high = field.polygon.bounds
    border = x + 0.5 * tree["radius_m"]
    cut = gf.Field(field.polygon.intersection(shapely.box(border, low, right, high)), field.crs)
    assert not cut.polygon.contains(shapely.Point(x, y))
    found = gf.detect_obstacles(simulated.scene, cut)
    leaning = active(found)[active(found).geometry.contains(shapely.Point(x, y))]
    assert len(leaning) == 1
    # Whatever counts reaches over the outline without its margin.
    trees = found[found["kind"] == "tree"]
    away = shapely.distance(cut.polygon, shapely.centroid(trees.geometry.to_numpy()))
    assert (away <= trees["radius_m"].to_numpy(float) + 0.01).all()
    tracks = gf.plan_tracks(cut.polygon, found, crs=field.crs, spacing_m=1.0)
    crown = shapely.Point(x, y).buffer(0.9 * tree["radius_m"])
    assert not tracks.segments.geometry.intersects(crown).any()
    assert tracks.segments.geometry.length.sum() > 0


@pytest.mark.parametrize("resolution_m", [0.17, 0.3, 0.6, 0.9, 1.3, 3.0])
def test_results_do_not_depend_on_the_window(resolution_m, monkeypatch):
    """Windows start on whole pixels of the picture and of the working grid."""
    size = max(round(200 / resolution_m), 110)
    settings = SimulationSettings(width_px=size, height_px=size, resolution_m=resolution_m)
    made = simulate_field(3, settings)
    radius_m = (max(1.0, 1.65 * resolution_m), 15.0)
    whole = gf.detect_obstacles(made.scene, made.field, radius_m=radius_m)
    for core_px in (96, 160):
        monkeypatch.setattr("geofield.obstacles.default.CORE_PX", core_px)
        parts = gf.detect_obstacles(made.scene, made.field, radius_m=radius_m)
        assert len(whole) == len(parts) > 5
        for column in ("x_px", "y_px", "radius_px", "confidence"):
            assert parts[column].to_numpy() == pytest.approx(
                whole[column].to_numpy(), abs=1e-6, nan_ok=True
            )


@pytest.mark.parametrize("resolution_m", [0.036, 0.1, 0.25, 0.3, 0.45, 0.5, 0.6, 1, 1.7, 3, 6, 10])
def test_the_working_grid_is_near_what_the_network_learned(resolution_m):
    factor = working_factor(resolution_m)
    assert 0.87 <= WORKING_RESOLUTION_M / (resolution_m * factor) <= 1.15
    assert (WHOLE_PX * factor).is_integer()
    assert WHOLE_PX % ALIGN_PX == 0


@pytest.mark.parametrize("core_px", [1024, 96])
def test_ground_that_the_picture_does_not_show_is_told(simulated, monkeypatch, core_px):
    monkeypatch.setattr("geofield.obstacles.default.CORE_PX", core_px)
    scene, field = simulated.scene, simulated.field
    whole = gf.detect_obstacles(scene, field)
    assert not any("does not show" in doubt for doubt in whole.attrs["detection"]["doubts"])
    middle = int(field.polygon_px(scene.grid).centroid.x)
    cut = scene.crop(0, 0, middle, scene.grid.height_px)
    valid = scene.valid.copy()
    valid[:, middle:] = False
    for half in (cut, replace(scene, valid=valid)):
        with pytest.warns(ObstacleWarning, match=r"does not show (4|5)\d% of the field"):
            found = gf.detect_obstacles(half, field)
        assert any("does not show" in doubt for doubt in found.attrs["detection"]["doubts"])


def test_a_finer_picture_gives_the_same_trees():
    base = SimulationSettings(width_px=300, height_px=300, obstacles=6, climate="temperate")
    fine = SimulationSettings(
        width_px=600, height_px=600, resolution_m=0.3, obstacles=6, climate="temperate"
    )
    for settings in (base, fine):
        field = simulate_field(5, settings)
        found = gf.detect_obstacles(field.scene, field.field)
        score = gf.evaluate(found, field.obstacles, distance_m=3.6).pooled
        assert score.recall >= 0.8
    assert "Resampled" in found.attrs["detection"]["notes"][0]


def test_a_field_without_trees_gives_an_empty_table():
    field = simulate_field(21, SimulationSettings(width_px=256, height_px=256, obstacles=0))
    found = gf.detect_obstacles(field.scene, field.field)
    assert len(found) <= 1
    assert list(found.columns) == [*schema.OBSTACLES.column_names, "geometry"]


def blank(simulated, value=120, size=64, valid=True):
    grid = simulated.scene.grid.crop(0, 0, size, size)
    bands = np.full((4, size, size), value, np.uint8)
    mask = np.full((size, size), valid)
    return Scene(grid, bands, simulated.scene.roles, mask)


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize(("size", "valid"), [(64, True), (3, True), (1, True), (40, False)])
def test_pictures_without_content_give_no_circle(simulated, strategy, size, valid):
    scene = blank(simulated, size=size, valid=valid)
    found = gf.detect_obstacles(scene, strategy=strategy, threshold_range=(0.0, 0.1, 0.05))
    assert len(found) == 0
    assert found["obstacle_no"].dtype == "Int64"


def test_holes_without_data_add_nothing(simulated):
    scene = simulated.scene
    valid = scene.valid.copy()
    valid[100:160, 100:160] = False
    bands = scene.bands.copy()
    bands[:, ~valid] = 0
    holed = Scene(scene.grid, bands, scene.roles, valid)
    with pytest.warns(ObstacleWarning, match="does not show 14% of the field"):
        found = gf.detect_obstacles(holed, simulated.field)
    rows, cols = found["y_px"].to_numpy().astype(int), found["x_px"].to_numpy().astype(int)
    assert valid[rows, cols].all()


@pytest.mark.parametrize(("side_px", "told"), [(12, "52 m2"), (6, None), (2, None)])
def test_a_gap_that_hides_a_tree_is_told_however_large_the_field(simulated, side_px, told):
    scene, field = simulated.scene, simulated.field
    middle = field.polygon_px(scene.grid).representative_point()
    row, column = int(middle.y), int(middle.x)
    valid = scene.valid.copy()
    valid[row : row + side_px, column : column + side_px] = False
    assert side_px**2 < 0.006 * field.polygon_px(scene.grid).area
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ObstacleWarning)
        found = gf.detect_obstacles(replace(scene, valid=valid), field)
    doubts = [each for each in found.attrs["detection"]["doubts"] if "does not show" in each]
    assert [f"does not show {told} of the field" in each for each in doubts] == [True] * bool(told)


def test_parts_of_a_16_bit_picture_show_near_infrared_alike(tmp_path):
    import rasterio

    from geofield.imagery.reader import SceneReader
    from geofield.obstacles.picture import part_of, tone_of

    rows = np.linspace(900, 30_000, 64)[:, None].astype(np.uint16)
    values = np.broadcast_to(rows * np.array([1, 1, 1, 2])[:, None, None], (4, 64, 64))
    path = tmp_path / "picture.tif"
    size = {"width": 64, "height": 64, "count": 4, "dtype": "uint16", "crs": "EPSG:32636"}
    place = Affine(0.5, 0, 548_000, 0, -0.5, 3_881_000)
    with rasterio.open(path, "w", transform=place, photometric="MINISBLACK", **size) as file:
        file.write(values.astype(np.uint16))
    reader = SceneReader.open(str(path))
    tone = tone_of(reader)
    parts = [part_of(reader, (0, top, 64, 32), tone).nir for top in (0, 32)]
    assert np.array_equal(np.concatenate(parts), part_of(reader, (0, 0, 64, 64), tone).nir)


def test_a_reader_gives_the_same_as_its_scene(simulated, simulated_tif):
    from geofield.imagery.reader import SceneReader

    reader = SceneReader.open(str(simulated_tif))
    found = gf.detect_obstacles(reader, simulated.field)
    whole = gf.detect_obstacles(simulated.scene, simulated.field)
    assert found["x_px"].to_numpy() == pytest.approx(whole["x_px"].to_numpy(), abs=1e-6)


def test_windows_of_a_very_fine_picture_fit_into_memory():
    class Reader:
        grid = gf.Grid(
            200_000, 200_000, Affine(0.02, 0, 548_000, 0, -0.02, 3_881_000), "EPSG:32636"
        )

        def read(self, window=None, *, shape_px=None, scaling=None, nir_scaling=None):
            if shape_px is None:
                raise InterruptedError(window)
            rows, columns = shape_px
            bands = np.random.default_rng(0).integers(0, 255, (3, rows, columns), dtype=np.uint8)
            grid = self.grid.resized(columns, rows)
            return Scene(grid, bands, ("red", "green", "blue"), np.ones((rows, columns), bool))

    with pytest.raises(InterruptedError) as asked:
        gf.detect_obstacles(Reader())
    _, _, width_px, height_px = asked.value.args[0]
    # Of 31 000 px without its overlap it had more than 3 GB in three bands.
    assert 8_000 < width_px == height_px < 14_000


def test_a_coarse_picture_warns(simulated):
    scene = simulated.scene
    grid = scene.grid.resized(scene.grid.width_px // 4, scene.grid.height_px // 4)
    coarse = Scene(grid, scene.bands[:, ::4, ::4], scene.roles, scene.valid[::4, ::4])
    with pytest.warns(ObstacleWarning, match="coarse"):
        found = gf.detect_obstacles(coarse)
    assert "coarse" in found.attrs["detection"]["doubts"][0]


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"radius_m": (9, 2)}, "radius range"),
        ({"radius_m": (0, 2)}, "radius range"),
        ({"radius_m": (2, 1e30)}, "largest radius"),
        ({"radius_m": (2, 1001), "strategy": "consensus"}, "largest radius"),
        ({"strategy": "best"}, "strategy"),
        ({"buffer_m": -1}, "margin"),
        ({"buffer_m": 1e30}, "margin"),
        ({"polarity": "grey"}, "polarity"),
        ({"min_confidence": 2}, "confidence"),
        ({"cost_missed": 0}, "cost"),
        ({"strategy": "single", "edge_method": "laplace"}, "edge method"),
        ({"strategy": "single", "grey_check": "bright"}, "grey check"),
    ],
)
def test_bad_arguments_are_refused(simulated, arguments, match):
    with pytest.raises(ObstacleError, match=match):
        gf.detect_obstacles(simulated.scene, **arguments)


def test_polarity_chooses(simulated):
    dark = gf.detect_obstacles(simulated.scene, simulated.field, polarity="dark", others=False)
    bright = gf.detect_obstacles(simulated.scene, simulated.field, polarity="bright", others=False)
    both = gf.detect_obstacles(simulated.scene, simulated.field, others=False)
    assert len(dark) + len(bright) == len(both)
    assert len(dark) > len(bright)


@pytest.mark.parametrize(
    "half_px", [(14, 6), (23, 10), (33, 13)], ids=["17x7m", "28x12m", "40x16m"]
)
@pytest.mark.parametrize("colour", [(40, 60, 90, 15), (15, 25, 25, 8)], ids=["dark", "black"])
def test_a_pond_becomes_a_polygon(half_px, colour):
    field = simulate_field(
        33, SimulationSettings(width_px=360, height_px=360, obstacles=3, climate="temperate")
    )
    scene = field.scene
    x, y = (float(v) for v in scene.grid.from_lonlat(field.lon, field.lat))
    yy, xx = np.mgrid[:360, :360]
    wide, high = half_px
    pond = (np.abs(xx - x) < wide) & (np.abs(yy - y) < high)
    bands = scene.bands.copy()
    bands[:, pond] = np.array(colour, np.uint8)[:, None]
    found = gf.detect_obstacles(
        Scene(scene.grid, bands, scene.roles, scene.valid), field.field, buffer_m=0
    )
    found = active(found)
    other = found[found["kind"] == "other"]
    assert len(other) == 1
    assert other["confidence"].iloc[0] > 0.5
    box = shapely.box(x - wide, y - high, x + wide, y + high)
    truth = shapely.transform(box, scene.grid.to_metric_array)
    shape = other.geometry.iloc[0]
    assert shape.intersection(truth).area / shape.union(truth).area > 0.7
    assert np.isnan(other["radius_m"].iloc[0])


def painted(field, *things):
    """The field's picture with boxes (x, y, half width, half height, grey level) and shadows."""
    bands = field.scene.bands.copy()
    yy, xx = np.mgrid[: bands.shape[1], : bands.shape[2]]
    for x, y, wide, high, grey in things:
        shadow = (np.abs(xx - x - 4) <= wide + 2) & (np.abs(yy - y) <= high)
        bands[:, shadow] = (bands[:, shadow] * 0.45).astype(np.uint8)
        bands[:, (np.abs(xx - x) <= wide) & (np.abs(yy - y) <= high)] = grey
    return Scene(field.scene.grid, bands, field.scene.roles, field.scene.valid)


def test_what_stands_there_is_found_with_a_probability_and_the_border_is_none():
    settings = SimulationSettings(width_px=400, height_px=400, obstacles=0, climate="temperate")
    field = simulate_field(12, settings)
    grid = field.scene.grid
    x, y = (float(v) for v in grid.from_lonlat(field.lon, field.lat))
    edge = field.field.polygon.exterior.interpolate(0.3, normalized=True)
    u, v = (float(w) for w in grid.from_crs(edge.x, edge.y, field.field.crs))
    # A hut and a truck in the field, a hut on its border.
    scene = painted(field, (x, y, 5, 4, 210), (x + 30, y + 12, 6, 2, 235), (u, v, 2, 2, 220))
    found = gf.detect_obstacles(scene, field.field, buffer_m=0)
    other = active(found[found["kind"] == "other"])
    assert len(other) == 2
    for place in ((x, y), (x + 30, y + 12)):
        hit = other[other.contains(shapely.Point(grid.to_crs(*place, field.field.crs)))]
        assert len(hit) == 1
        assert hit["confidence"].iloc[0] > 0.3
    careful = gf.detect_obstacles(scene, field.field, buffer_m=0, careful=True)
    assert set(careful["status"]) == {"detected"}


def test_the_cost_of_a_miss_moves_the_line(simulated):
    counts = []
    for cost in (3, 30, 300):
        found = gf.detect_obstacles(simulated.scene, simulated.field, cost_missed=cost)
        told = found.attrs["detection"]
        assert told["possible_from"] <= told["threshold"]
        counts.append((len(active(found)), len(found)))
    assert counts == sorted(counts)
    assert thresholds(30) == pytest.approx((1 / 6, 1 / 21))
    # Where a miss is cheap, nothing is shown that is not worth a detour.
    assert thresholds(1) == pytest.approx((2 / 3.3, 2 / 3.3))


@pytest.mark.parametrize(
    "change",
    [
        lambda b: 0.5 * b + 60,
        lambda b: 0.6 * b + 0.4 * 190,
        lambda b: 0.6 * b,
    ],
    ids=["half contrast", "haze", "dark"],
)
@pytest.mark.parametrize("bands", [4, 3, 1])
def test_light_and_haze_do_not_blind_it(simulated, change, bands):
    grey = np.rint(simulated.scene.grey)[None] if bands == 1 else simulated.scene.bands[:bands]
    changed = np.clip(np.rint(change(grey.astype(float))), 0, 255).astype(np.uint8)
    roles = ("grey",) if bands == 1 else simulated.scene.roles[:bands]
    scene = Scene(simulated.scene.grid, changed, roles, simulated.scene.valid)
    found = gf.detect_obstacles(scene, simulated.field)
    assert gf.evaluate(found, simulated.obstacles, distance_m=3.6).pooled.f1 > 0.85


def test_grey_in_three_equal_bands_is_grey(simulated):
    grey = np.clip(np.rint(simulated.scene.grey), 0, 255).astype(np.uint8)[None]
    scene = simulated.scene
    one = Scene(scene.grid, grey, ("grey",), scene.valid)
    three = Scene(scene.grid, np.repeat(grey, 3, axis=0), scene.roles[:3], scene.valid)
    a, b = (gf.detect_obstacles(s, simulated.field) for s in (one, three))
    assert len(a) == len(b) > 3
    assert a["x_px"].to_numpy() == pytest.approx(b["x_px"].to_numpy(), abs=0.05)
    assert b.attrs["detection"]["method"] == "network_grey"


def test_pixel_transform_is_that_of_the_grid(simulated, detected):
    grid = simulated.scene.grid
    assert isinstance(grid.transform, Affine)
    row = detected.iloc[0]
    lon, lat = grid.to_lonlat(row["x_px"], row["y_px"])
    assert (row["lon"], row["lat"]) == pytest.approx((lon, lat))


@pytest.fixture(scope="module")
def cut_field():
    """A field that fills its picture, with trees apart from each other."""
    settings = SimulationSettings(width_px=360, height_px=360, obstacles=14, climate="temperate")
    made = simulate_field(21, settings)
    frame = shapely.box(0, 0, made.scene.grid.width_px, made.scene.grid.height_px)
    to_metric = made.scene.grid.to_metric_array
    return made, gf.Field(shapely.transform(frame, to_metric), made.field.crs)


def ended(scene, x_px, y_px, slope):
    """The picture with its data ending at a place, on a leaning line or with its frame."""
    if not slope:
        return scene.crop(0, 0, round(x_px), scene.grid.height_px)
    row, col = np.indices(scene.valid.shape) + 0.5
    return replace(scene, valid=scene.valid & (col - x_px < slope * (row - y_px)))


@pytest.mark.parametrize("slope", [0.0, 0.3])
@pytest.mark.parametrize("shown", [-0.4, 0.0, 0.4])
def test_a_crown_that_the_end_of_the_data_cuts_is_driven_around(cut_field, slope, shown):
    made, field = cut_field
    trees = made.obstacles.sort_values("radius_m").iloc[-8:]
    for tree in trees.itertuples():
        # So much of the radius is seen beyond the trunk, or not up to it.
        end_px = tree.x_px + shown * tree.radius_px
        half = ended(made.scene, end_px, tree.y_px, slope)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ObstacleWarning)
            around = active(gf.detect_obstacles(half, field, others=False))
        seen = shapely.box(0, 0, end_px, half.grid.height_px)
        crown = shapely.Point(tree.x_px, tree.y_px).buffer(tree.radius_px).intersection(seen)
        crown = shapely.transform(crown, half.grid.to_metric_array)
        assert around.geometry.intersects(crown.centroid).any()


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_cut_crowns_do_not_depend_on_the_window(cut_field, monkeypatch, slope):
    made, field = cut_field
    tree = made.obstacles.sort_values("radius_m").iloc[-3]
    # Seen up to the trunk, and less of it, which only its mirror image makes a crown.
    half = ended(made.scene, tree["x_px"] - 0.1 * tree["radius_px"], tree["y_px"], slope)
    with pytest.warns(ObstacleWarning, match="does not show"):
        whole = gf.detect_obstacles(half, field, others=False)
    monkeypatch.setattr("geofield.obstacles.default.CORE_PX", 96)
    with pytest.warns(ObstacleWarning, match="does not show"):
        parts = gf.detect_obstacles(half, field, others=False)
    apart = np.hypot(whole["x_px"] - tree["x_px"], whole["y_px"] - tree["y_px"])
    assert apart.min() < 0.5 * tree["radius_px"]
    assert len(whole) == len(parts) > 5
    for column in ("x_px", "y_px", "radius_px", "confidence"):
        assert parts[column].to_numpy() == pytest.approx(
            whole[column].to_numpy(), abs=1e-6, nan_ok=True
        )


def standing_map(canopy):
    """What the network told of a field of 60 by 60 cells in which nothing but canopy stands."""
    cells = np.zeros((60, 60), np.uint8)
    return StandingMap(cells, np.rint(255 * canopy).astype(np.uint8), 0, 0)


FIELD_PX = shapely.box(0, 0, 60 * CELL_PX, 60 * CELL_PX)


def one_tree(x_cells, y_cells, radius_cells):
    x, y, radius = (np.array([v * float(CELL_PX)]) for v in (x_cells, y_cells, radius_cells))
    return Circles(x, y, radius, np.ones(1))


def test_a_hedge_between_its_trees_is_driven_around():
    canopy = np.zeros((60, 60))
    canopy[28:32, 10:50] = 0.8
    parts, p = standing_map(canopy).things(FIELD_PX, one_tree(20, 30, 3), 0.35)
    assert len(parts) == 2
    hedge = shapely.union_all(parts)
    truth = shapely.box(10, 28, 50, 32)
    uncovered = truth.difference(shapely.Point(20, 30).buffer(3))
    found = shapely.transform(hedge, lambda c: c / CELL_PX)
    assert found.intersection(uncovered).area > 0.95 * uncovered.area
    assert found.difference(truth).area < 0.05 * truth.area
    assert p == pytest.approx([0.8, 0.8], abs=0.01)


@pytest.mark.parametrize(
    ("cells", "p"),
    [
        pytest.param(np.s_[28:32, 18:22], 0.9, id="under its tree"),
        pytest.param(np.s_[28:31, 40:41], 0.9, id="a speck"),
        pytest.param(np.s_[28:32, 30:50], 0.45, id="rather not"),
    ],
)
def test_canopy_that_a_tree_explains_or_that_is_doubtful_adds_nothing(cells, p):
    canopy = np.zeros((60, 60))
    canopy[cells] = p
    assert standing_map(canopy).things(FIELD_PX, one_tree(20, 30, 4), 0.35) == ([], [])


def test_a_shape_without_a_crs_is_no_field():
    field = simulate_field(3)
    with pytest.raises(FieldError, match="must be a Field, not Polygon"):
        gf.detect_obstacles(field.scene, field.field.polygon)  # type: ignore[arg-type]
