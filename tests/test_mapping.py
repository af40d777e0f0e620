"""The map picture shows things where they are."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
import shapely
from affine import Affine
from PIL import Image
from shapely import box

from geofield import theme
from geofield.crs import ground_scale
from geofield.grid import Grid
from geofield.mapping import draw_map
from geofield.mapping import fonts as map_fonts
from geofield.model.map_words import figures_in_words, round_length_m
from geofield.model.scene import Scene
from geofield.pipeline import run_tracks
from geofield.plan import Plan
from geofield.settings import load_settings
from geofield.simulate import SimulatedField


@pytest.fixture(scope="module")
def plan(simulated: SimulatedField) -> Plan:
    obstacles = simulated.obstacles.copy()
    obstacles.loc[0, "status"] = "rejected"
    plan = Plan(
        simulated.field,
        obstacles=obstacles,
        source=simulated.scene.source,
        grid=simulated.scene.grid,
        scene=simulated.scene,
    )
    return run_tracks(plan, settings=load_settings(None, {"tracks": {"spacing_m": 8.0}}))


@pytest.mark.parametrize("round_m", [1, 2, 5, 10, 20, 50, 1000])
def test_a_scale_bar_is_as_long_as_fits(round_m: float) -> None:
    assert round_length_m(round_m) == round_length_m(1.9 * round_m) == round_m


@pytest.mark.parametrize("longer", [1.0, 1.09, 0.92])
def test_a_scale_bar_is_as_long_as_it_says(
    plan: Plan, simulated: SimulatedField, longer: float
) -> None:
    """Where pixels were 9 % longer down than across, it was 4 % too short."""
    grid = simulated.scene.grid
    oblong = replace(grid, transform=grid.transform @ Affine.scale(1.0, longer))
    picture = draw_map(plan.to_dataset(), replace(simulated.scene, grid=oblong), long_side_px=1280)
    # The bar is 3 px high and ends 30 px from the map's right side, 22 from its lower one.
    row = np.asarray(picture)[1280 - 22]
    white = np.flatnonzero((row > 250).all(axis=1))
    bar = white[white <= 1250]
    length_px = len(bar) - 1
    assert bar[-1] == 1250
    assert (np.diff(bar) == 1).all()
    metres = length_px * grid.transform.a / 4 / ground_scale(grid.crs, *grid.to_native(160, 160))
    assert metres == pytest.approx(round_length_m(metres * 1.02), rel=0.01)


def test_a_narrow_picture_is_drawn_to_its_end(plan: Plan) -> None:
    """Of one thirty times as long as wide, its end was cut off."""
    x, y = plan.field.polygon.centroid.coords[0]
    corner = Affine(20.0, 0.0, x - 1000.0, 0.0, -20.0, y + 30_000.0)
    grid = Grid(100, 3001, corner, plan.field.crs)
    bands = np.zeros((3, *grid.shape), np.uint8)
    bands[0, -7:] = 255
    scene = Scene(grid, bands, ("red", "green", "blue"), np.ones(grid.shape, bool))
    picture = draw_map(plan.to_dataset(), scene)
    assert near(picture, picture.width / 2, 1400 - 4, (255, 0, 0))


def near(picture: Image.Image, x: float, y: float, colour: tuple[int, ...]) -> bool:
    """Whether a colour occurs within three pixels of a place."""
    pixels = np.asarray(picture)[int(y) - 3 : int(y) + 4, int(x) - 3 : int(x) + 4].reshape(-1, 3)
    return bool((np.abs(pixels.astype(int) - colour[:3]).max(axis=1) < 60).any())


def test_outline_and_circles_lie_where_the_grid_says(plan: Plan, simulated: SimulatedField) -> None:
    grid = simulated.scene.grid
    scale = 1000 / grid.width_px
    picture = draw_map(plan.to_dataset(), simulated.scene, long_side_px=1000)
    assert picture.width == 1000
    ring = np.array(simulated.field.polygon_px(grid).exterior.coords)
    for a, b in itertools.pairwise(ring):
        x, y = (a + b) / 2 * scale
        assert near(picture, x, y, theme.rgb(theme.OUTLINE))
    assert plan.obstacles is not None
    hits = []
    for row in plan.obstacles.itertuples():
        colour = theme.rgb(theme.STATUS[row.status].color)
        angles = np.radians(np.arange(0, 360, 10))
        x = (row.x_px + row.radius_px * np.cos(angles)) * scale
        y = (row.y_px + row.radius_px * np.sin(angles)) * scale
        hits.append(np.mean([near(picture, *at, colour) for at in zip(x, y, strict=True)]))
    # Rejected ones are dashed; all others closed.
    assert hits[0] > 0.5
    assert min(hits[1:]) > 0.9


def test_circles_that_nothing_drives_around_are_dashed(
    plan: Plan, simulated: SimulatedField
) -> None:
    """Dashes began anew at each corner of a circle, before the gap: 0.89 of it was drawn."""
    assert plan.obstacles is not None
    status = ["rejected", "possible", *["detected"] * (len(plan.obstacles) - 2)]
    changed = replace(plan, obstacles=plan.obstacles.assign(status=status), tracks=None)
    grid = simulated.scene.grid
    scale = 1400 / max(grid.width_px, grid.height_px)
    picture = np.asarray(draw_map(changed.to_dataset(), simulated.scene)).astype(int)
    shares = []
    for shape, name in zip(plan.obstacles.geometry, status, strict=True):
        ring = shapely.line_interpolate_point(shape.exterior, np.arange(400) / 400, normalized=True)
        xy = shapely.get_coordinates(ring)
        x, y = grid.from_crs(xy[:, 0], xy[:, 1], plan.field.crs)
        columns, rows = (np.floor(each * scale).astype(int) for each in (x, y))
        off = np.abs(picture[rows, columns] - theme.rgb(theme.STATUS[name].color)).max(axis=1)
        shares.append((off < 40).mean())
    assert shares[0] < 0.6
    assert shares[1] < 0.3
    assert min(shares[2:]) > 0.65


def test_the_map_is_the_same_twice_and_needs_no_picture(
    plan: Plan, simulated: SimulatedField
) -> None:
    one = draw_map(plan.to_dataset(), simulated.scene, long_side_px=500)
    two = draw_map(plan.to_dataset(), simulated.scene, long_side_px=500)
    assert one.tobytes() == two.tobytes()
    plain = draw_map(plan.to_dataset(), None, long_side_px=500)
    assert min(plain.size) > 300
    colours = np.asarray(plain).reshape(-1, 3)
    assert (np.abs(colours.astype(int) - theme.rgb(theme.OUTLINE)).max(axis=1) < 40).sum() > 200


def test_the_map_counts_what_is_driven_around_apart_from_the_rest(plan: Plan) -> None:
    """Of ten, two of them possible, it said "8 obstacles (2 possible)", as if they were six."""
    assert plan.obstacles is not None
    line = f"{len(plan.obstacles) - 1} obstacles, 1 rejected"
    assert figures_in_words(plan.to_dataset())[1] == line


def test_a_field_alone_is_drawn_too(simulated: SimulatedField) -> None:
    picture = draw_map(Plan(simulated.field).to_dataset(), long_side_px=400)
    assert picture.mode == "RGB"


def test_no_number_is_cut_or_lies_on_another() -> None:
    from geofield.mapping.labels import OBSTACLE_LOOK, TRACK_LOOK, Label, draw_labels

    image = Image.new("RGB", (200, 100))
    labels = [Label(((-4, 50),), "128", OBSTACLE_LOOK), Label(((199, 99),), "7", OBSTACLE_LOOK)]
    labels += [Label(((80 + 4 * k, 40),), str(k), TRACK_LOOK) for k in range(12)]
    boxes = draw_labels(image, labels)
    assert len(labels) > len(boxes) > 4
    for number, (left, top, right, bottom) in enumerate(boxes):
        assert min(left, top) >= 0
        assert right <= 200
        assert bottom <= 100
        for other in boxes[number + 1 :]:
            assert not (
                left < other[2] and other[0] < right and top < other[3] and other[1] < bottom
            )


def test_a_number_goes_to_its_next_place_where_another_lies() -> None:
    """A rejected shadow over a possible tree had no number on the map, and was told by it."""
    from geofield.mapping.labels import OBSTACLE_LOOK, Label, draw_labels

    image = Image.new("RGB", (200, 100))
    places = ((50.0, 40.0), (50.0, 60.0))
    boxes = draw_labels(
        image, [Label(places, str(number), OBSTACLE_LOOK) for number in (17, 32, 5)]
    )
    assert [(top + bottom) / 2 for _, top, _, bottom in boxes] == [40.0, 60.0]


def test_overlapping_obstacles_have_a_number_each(
    plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    from dataclasses import replace

    from geofield.mapping import picture
    from geofield.mapping.labels import OBSTACLE_LOOK, Box, draw_labels

    assert plan.obstacles is not None
    twice = plan.obstacles.iloc[[0, 0]].assign(obstacle_no=[17, 32])
    boxes: list[Box] = []
    monkeypatch.setattr(picture, "draw_labels", lambda *given: boxes.extend(draw_labels(*given)))
    draw_map(replace(plan, obstacles=twice).to_dataset(), long_side_px=400)
    # Those of tracks are lower.
    heights = [bottom - top for _, top, _, bottom in boxes]
    assert heights.count(OBSTACLE_LOOK.size_px + 4) == 2


def test_tracks_show_on_white_ground(plan: Plan, simulated: SimulatedField) -> None:
    from dataclasses import replace

    white = replace(simulated.scene, bands=np.full_like(simulated.scene.bands, 255))
    picture = draw_map(plan.to_dataset(), white, long_side_px=1000)
    assert plan.tracks is not None
    scale = 1000 / white.grid.width_px
    middles = plan.tracks.segments.geometry.interpolate(0.5, normalized=True)
    x, y = white.grid.from_crs(middles.x.to_numpy(), middles.y.to_numpy(), plan.field.crs)
    dark = [
        np.asarray(picture)[int(b) - 9 : int(b) + 10, int(a) - 9 : int(a) + 10].min() < 200
        for a, b in zip(x * scale, y * scale, strict=True)
    ]
    assert np.mean(dark) > 0.95


def test_letters_beyond_english_are_no_boxes(plan: Plan) -> None:
    def panel(name: str) -> bytes:
        named = replace(plan, field=replace(plan.field, name=name), scene=None)
        return draw_map(named.to_dataset(), None).tobytes()

    # A box is a box, whatever it stands for.
    assert panel("Wiese \N{LATIN SMALL LETTER SHARP S}") != panel(
        "Wiese \N{LATIN SMALL LETTER L WITH STROKE}"
    )
    assert panel("Pr\N{LATIN SMALL LETTER E WITH ACUTE}") != panel(
        "Pr\N{LATIN SMALL LETTER O WITH DIAERESIS}"
    )


def test_without_any_other_font_accents_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(map_fonts, "_OTHERS", ())
    pieces = map_fonts.written(
        "Gro\N{LATIN SMALL LETTER SHARP S}e Pr\N{LATIN SMALL LETTER E WITH ACUTE}s", 14
    )
    assert "".join(text for text, _ in pieces) == "Grosse Pres"
    assert [text for text, _ in map_fonts.written("Long meadow, 3 ha", 14)] == ["Long meadow, 3 ha"]


def test_one_letter_that_no_font_has_costs_the_others_nothing() -> None:
    name = "M\N{LATIN SMALL LETTER U WITH DIAERESIS}hle "
    ((_, own),) = map_fonts.written(name, 14)
    (text, font), _ = map_fonts.written(f"{name}\U0010fffd", 14)
    assert text == name
    assert font.getname() == own.getname()


def test_each_letter_is_drawn_by_a_font_that_has_it() -> None:
    """Of "Straße", a space and a sign of Chinese one was a box: a line had one font."""
    sign = "田"
    name = f"Straße {sign} 3,62 ha"
    if not any(map_fonts._has(each, sign) for each in map_fonts._fonts(14)):
        pytest.skip("needs a font of Chinese: apt-get install fonts-droid-fallback")
    pieces = map_fonts.written(name, 14)
    assert "".join(text for text, _ in pieces) == name
    for text, font in pieces:
        box_px = font.getmask("￿")
        for letter in text.replace(" ", ""):
            assert bytes(font.getmask(letter)) != bytes(box_px), letter


@pytest.mark.parametrize("width_m", [12.0, 150.0])
def test_words_of_any_length_stay_on_the_map(plan: Plan, width_m: float) -> None:
    middle = plan.field.polygon.centroid
    strip = box(middle.x, middle.y, middle.x + width_m, middle.y + 300)
    name = "Long strip beside the road to the village " * 4 + "x" * 200
    field = replace(plan.field, polygon=strip, name=name)
    picture = draw_map(replace(plan, field=field, scene=None).to_dataset(), None)
    bottom = np.asarray(picture)[1400:]
    assert len(bottom) > 106  # the usual panel
    assert (bottom[:, [0, -1]] == bottom[-1, 0]).all()
    # The legend, which is the first line, has the figures below it, not on it.
    ink = (bottom[:22] != bottom[-1, 0]).any(axis=(0, 2))
    assert not ink[-100:].any()
