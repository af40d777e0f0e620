"""Views: in which part of a picture a field is searched, and how large it is looked at."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from geofield.errors import FieldError, PointOutsideError
from geofield.field import FieldSearch, extract_field, prepare_field
from geofield.field.frame import Frame
from geofield.field.part import Part
from geofield.raster import resample
from geofield.simulate import SimulationSettings, simulate_field


def coarser(scene, times):
    """The same ground in fewer pixels."""
    bands = np.stack([resample(band.astype(np.float32), times) for band in scene.bands])
    rows, columns = bands.shape[1:]
    return replace(
        scene,
        grid=scene.grid.resized(columns, rows),
        bands=np.rint(bands).astype(np.uint8),
        valid=np.ones((rows, columns), bool),
    )


@pytest.mark.parametrize(("seed", "least"), [(2, 0.97), (3, 0.97), (8, 0.97)])
def test_a_field_of_few_pixels_is_found_as_exactly_as_one_of_many(seed, least):
    truth = simulate_field(seed, SimulationSettings(width_px=640, height_px=640))
    scene = coarser(truth.scene, 10)
    assert scene.grid.shape == (64, 64)
    field = extract_field(scene, lat=truth.lat, lon=truth.lon)
    true = truth.field.polygon
    overlap = field.polygon.intersection(true).area / field.polygon.union(true).area
    assert overlap > least
    assert field.quality is not None
    assert field.quality.trusted
    kept = prepare_field(scene, lat=truth.lat, lon=truth.lon)
    again = extract_field(scene, lat=truth.lat, lon=truth.lon, search=kept)
    assert again.polygon == field.polygon
    # It gave the outline of the picture that it was prepared for, certain and without a doubt.
    other = replace(scene, bands=scene.bands[:, ::-1])
    for picture, lat in ((other, truth.lat), (scene, truth.lat + 1e-5)):
        with pytest.raises(FieldError, match="prepared for another picture or point"):
            extract_field(picture, lat=lat, lon=truth.lon, search=kept)


def test_a_search_is_of_a_picture_smoothed_or_not(simulated):
    place = {"lat": simulated.lat, "lon": simulated.lon}
    smooth = extract_field(simulated.scene, **place, smooth="diffusion")
    kept = prepare_field(simulated.scene, **place, smooth="diffusion")
    again = extract_field(simulated.scene, **place, smooth="diffusion", search=kept)
    assert again.polygon == smooth.polygon != extract_field(simulated.scene, **place).polygon
    with pytest.raises(FieldError, match="smoothed otherwise"):
        extract_field(simulated.scene, **place, search=kept)


@pytest.mark.parametrize(
    ("rows", "columns", "times"),
    [(256, 256, 1), (171, 100, 1), (170, 20, 2), (64, 100, 3), (9, 12, 8)],
)
def test_only_small_pictures_are_enlarged_onto_the_same_ground(rows, columns, times):
    scene = simulate_field(1, SimulationSettings(width_px=300, height_px=300)).scene
    scene = scene.crop(10, 20, columns, rows)
    valid = scene.valid.copy()
    valid[0, 1] = False
    scene = replace(scene, valid=valid)
    large = Part.whole(scene).magnified().of(scene)
    assert (large is scene) == (times == 1)
    assert large.grid.shape == (rows * times, columns * times)
    corners = ([0, columns, columns], [0, 0, rows])
    np.testing.assert_allclose(
        large.grid.to_native(*(times * np.array(one) for one in corners)),
        scene.grid.to_native(*corners),
    )
    # A pixel's middle keeps its value where cutting leaves it a middle.
    assert large.valid.sum() == valid.sum() * times**2
    assert not large.valid[0, times : 2 * times].any()
    if times % 2:
        middle = large.bands[:, times // 2 :: times, times // 2 :: times]
        np.testing.assert_array_equal(middle, scene.bands)
    assert abs(large.bands.mean() - scene.bands.mean()) < 1.5


def among(truth, number):
    """A picture in the middle of others, number x number."""
    rows, columns = truth.scene.grid.shape
    bands = np.tile(truth.scene.bands, (1, number, number))
    middle = number // 2
    for row, column in np.ndindex(number, number):
        if (row, column) != (middle, middle):
            other = simulate_field(1000 + 37 * row + column, SIDE).scene
            top, left = row * rows, column * columns
            bands[:, top : top + rows, left : left + columns] = other.bands
    grid = truth.scene.grid.crop(-middle * columns, -middle * rows, number * columns, number * rows)
    return replace(truth.scene, grid=grid, bands=bands, valid=np.ones(grid.shape, bool))


SIDE = SimulationSettings(width_px=256, height_px=256)


@pytest.fixture(scope="module")
def wide():
    """A field of 256 pixels in a picture of 1280."""
    truth = simulate_field(1, SIDE)
    return truth, among(truth, 5)


def share(one, other):
    """Intersection over union."""
    return one.intersection(other).area / one.union(other).area


def test_a_field_is_found_in_a_wide_picture_as_well_as_in_a_narrow_one(wide):
    truth, scene = wide
    field = extract_field(scene, lat=truth.lat, lon=truth.lon)
    assert share(field.polygon, truth.field.polygon) > 0.97
    assert field.crs == scene.grid.metric_crs
    # The part that was searched is no frame: the field does not go on outside the picture.
    assert field.quality is not None
    assert dict(field.quality.figures)["edge_share"] == 0.0
    assert not any("outside the picture" in one for one in field.quality.reasons)


def test_the_narrowest_view_that_holds_points_and_outline_is_taken(wide):
    truth, scene = wide
    search = FieldSearch((truth.lon, truth.lat))
    narrow = search.view(scene)
    assert narrow.part.box[2:] == (250, 250)
    assert search.view(scene).search is narrow.search
    # Ground far away belongs: only the whole picture holds both.
    far = (scene.grid.to_lonlat(60.0, 1200.0),)
    assert search.view(scene, far).part == Part.whole(scene)
    again = FieldSearch((truth.lon, truth.lat))
    assert again.view(scene, far).part == Part.whole(scene)
    assert search.view(scene).part == narrow.part


def test_what_was_corrected_in_a_wide_view_is_not_taken_back_to_a_narrow_one(wide):
    truth, scene = wide
    place = truth.lon, truth.lat
    search = FieldSearch(place)
    search.levels[(), ()] = 1
    assert search.view(scene, (place,)).part.box[2:] == (500, 500)


@pytest.fixture(scope="module")
def large():
    """A field wider than the first view."""
    return simulate_field(101, SimulationSettings(width_px=640, height_px=640))


@pytest.mark.parametrize("blind", ["", "_ground_goes_on", "View.cuts"])
def test_a_field_wider_than_the_first_view_is_not_cut_there(large, blind, monkeypatch):
    """The network's ground says so, and the outline alone would, too."""
    if blind:
        monkeypatch.setattr(f"geofield.field.views.{blind}", lambda *_: False)
    search = prepare_field(large.scene, lat=large.lat, lon=large.lon)
    assert search.view(large.scene).part == Part.whole(large.scene)
    field = extract_field(large.scene, lat=large.lat, lon=large.lon, search=search)
    assert share(field.polygon, large.field.polygon) > 0.97


def test_the_end_of_a_view_is_not_the_pictures(large):
    scene = large.scene
    search = FieldSearch((large.lon, large.lat))
    search.levels[(), ()] = 0
    field = extract_field(scene, lat=large.lat, lon=large.lon, search=search)
    assert field.area_ha < 0.8 * large.field.area_ha
    assert field.quality is not None
    assert dict(field.quality.figures)["edge_share"] == 0.0


@pytest.mark.parametrize("place", [(8.0, 8.0), (1276.0, 640.0)])
def test_a_view_at_the_pictures_border_stays_in_it(wide, place):
    _, scene = wide
    search = FieldSearch(scene.grid.to_lonlat(*place))
    part = search.view(scene).part
    left, top, width, height = part.box
    assert 0 <= left <= place[0] < left + width <= 1280
    assert 0 <= top <= place[1] < top + height <= 1280


def test_a_part_knows_where_it_lies_in_the_picture():
    part = Part((30, 0, 50, 40), (100, 200), 5)
    assert part.sides_inside == (True, False, True, True)
    here = shapely.box(0, 0, 250, 200)
    assert part.to_picture(here).bounds == (30.0, 0.0, 80.0, 40.0)
    assert part.to_picture(part.frame_px).bounds == (0.0, 0.0, 100.0, 200.0)
    with_data = part.from_picture(shapely.box(10, 20, 90, 110))
    assert with_data is not None
    assert with_data.bounds == (-100.0, 100.0, 300.0, 550.0)
    # Along the picture's own frame an outline is not cut, along the other sides it is.
    assert not part.cuts(shapely.box(20, 0, 200, 150), 2.0)
    assert part.cuts(shapely.box(1, 20, 200, 150), 2.0)
    assert part.cuts(shapely.box(20, 20, 249, 150), 2.0)
    assert part.cuts(shapely.box(20, 20, 200, 199), 2.0)
    assert not part.cuts(shapely.box(20, 20, 200, 150), 2.0)
    # A corner that touches a side is none that goes on: it may take two hundredths of the border.
    spit = [(20, 20), (200, 20), (200, 70), (249, 70), (249, 80), (200, 80), (200, 150), (20, 150)]
    assert not part.cuts(shapely.Polygon(spit), 2.0)
    wider = [(x, 85 if y == 80 else 65 if y == 70 else y) for x, y in spit]
    assert part.cuts(shapely.Polygon(wider), 2.0)
    below = Part((0, 160, 100, 40), (100, 200))
    assert below.sides_inside == (False, True, False, False)
    assert not below.cuts(shapely.box(0, 20, 100, 40), 2.0)
    assert below.cuts(shapely.box(20, 0, 80, 20), 2.0)


def test_no_alternative_ends_where_the_search_did(wide):
    truth, scene = wide
    search = FieldSearch((truth.lon, truth.lat))
    part = search.view(scene).part
    field = extract_field(scene, lat=truth.lat, lon=truth.lon, search=search)
    left, top, width, height = part.box
    sides = shapely.box(left, top, left + width, top + height).exterior.buffer(1.0)
    for one in field.alternatives:
        border = replace(field, polygon=one.polygon).polygon_px(scene.grid).exterior
        assert border.intersection(sides).length < 0.02 * border.length


def test_an_empty_margin_changes_neither_outline_nor_certainty():
    truth = simulate_field(3, SimulationSettings(width_px=400, height_px=400))
    scene = truth.scene.crop(0, 0, 256, 256)
    lon, lat = scene.grid.to_lonlat(128.0, 128.0)
    margin = ((30, 20), (50, 40))
    framed = replace(
        scene,
        grid=scene.grid.crop(-50, -30, 346, 306),
        bands=np.pad(scene.bands, ((0, 0), *margin)),
        valid=np.pad(scene.valid, margin),
    )
    field, same = (extract_field(one, lat=lat, lon=lon) for one in (scene, framed))
    assert shapely.equals_exact(same.polygon, field.polygon, 1e-6)
    assert same.quality == field.quality
    kept = prepare_field(framed, lat=lat, lon=lon)
    assert extract_field(framed, lat=lat, lon=lon, search=kept).polygon == same.polygon


def test_a_slanting_end_of_data_is_judged_as_the_frame_is():
    made = simulate_field(3, SimulationSettings(width_px=256, height_px=256))
    grid = made.scene.grid
    x, y = (float(at) for at in grid.from_lonlat(made.lon, made.lat))
    truth = made.field.polygon_px(grid)
    far = 0.6 * x + 0.4 * truth.bounds[2] + 0.35 * y
    shown = shapely.Polygon([(0, 0), (far, 0), (far - 0.35 * 256, 256), (0, 256)])
    row, column = np.indices(grid.shape) + 0.5
    cut = replace(made.scene, valid=shapely.contains_xy(shown, column, row))
    whole, part = (extract_field(one, lat=made.lat, lon=made.lon) for one in (made.scene, cut))
    assert whole.quality.score - part.quality.score < 0.05
    assert part.quality.trusted
    found, there = part.polygon_px(grid), truth.intersection(shown)
    assert found.intersection(there).area > 0.975 * found.union(there).area
    assert 0.05 < dict(part.quality.figures)["edge_share"] < 0.5


@pytest.mark.parametrize("factor", [1, 2, 3])
def test_the_frame_of_a_reduced_picture_is_the_end_of_the_data_around_the_seed(factor):
    scene = simulate_field(1, SIDE).scene
    valid = np.zeros(scene.valid.shape, bool)
    valid[12:90, 30:102] = valid[120:240, 150:252] = True
    scene = replace(scene, valid=valid)
    for (x, y), end in (((60, 50), (30, 12, 102, 90)), ((200, 180), (150, 120, 252, 240))):
        frame = Frame.of(scene, factor, (x / factor, y / factor), 1)
        assert frame.shape == (-(-256 // factor), -(-256 // factor))
        assert frame.shown is not None
        # Straightened by up to three pixels, outwards.
        beyond = (np.array(frame.shown.bounds) - np.array(end) / factor) * [-1, -1, 1, 1]
        assert ((beyond > -0.1) & (beyond < 3.1)).all()


def test_what_values_lie_where_there_are_no_data_changes_nothing():
    truth = simulate_field(3, SimulationSettings(width_px=640, height_px=640))
    scene = coarser(truth.scene, 10)
    row, column = np.indices(scene.grid.shape)
    valid = column + row // 4 < 0.8 * scene.grid.width_px  # through the field
    black, white = (
        replace(scene, valid=valid, bands=np.where(valid, scene.bands, np.uint8(value)))
        for value in (0, 255)
    )
    lon, lat = truth.lon, truth.lat
    field, same = (extract_field(one, lat=lat, lon=lon) for one in (black, white))
    assert same.polygon == field.polygon
    assert same.quality == field.quality


@pytest.mark.parametrize("look", [extract_field, prepare_field])
def test_a_picture_without_any_data_is_told(look):
    made = simulate_field(1, SimulationSettings(width_px=96, height_px=96))
    scene = replace(made.scene, valid=np.zeros_like(made.scene.valid))
    with pytest.raises(PointOutsideError, match="no data"):
        look(scene, lat=made.lat, lon=made.lon)
