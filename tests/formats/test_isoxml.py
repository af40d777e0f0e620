"""ISOXML: read by a second reader, checked against the standard's rules, broken on purpose."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import shapely
from formats_plan import NAME, SCALE, UTM, X0, Y0, make_dataset
from isoxml.models.base import v3, v4
from isoxml.util.isoxml_io import isoxml_from_path
from pyproj import Geod

from geofield import __version__, schema
from geofield.crs import ground_areas_m2
from geofield.errors import FormatError
from geofield.formats import read_dataset, validate_file, write_dataset
from geofield.formats.arrow import to_lonlat
from geofield.model.dataset import Provenance
from geofield.model.obstacles import circle_polygons

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")
NAMES = {4: "isoxml", 3: "isoxml-v3"}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("isoxml")
    options = {"customer": "Müller & Söhne", "farm": "Hof <Ost>"}
    write_dataset(make_dataset(), folder, list(NAMES.values()), options=options)
    return {v: folder / name / "TASKDATA" / "TASKDATA.XML" for v, name in NAMES.items()}


@pytest.mark.parametrize("version", [3, 4])
def test_a_second_reader_understands_it(files, version):
    data, _ = isoxml_from_path(files[version])
    model = {3: v3, 4: v4}[version]
    assert isinstance(data, model.Iso11783TaskData)
    (field,) = data.partfields
    assert field.designator == NAME
    customer = data.customers[0]
    assert (customer.last_name if version == 4 else customer.designator) == "Müller & Söhne"
    assert data.farms[0].designator == "Hof <Ost>"
    assert data.farms[0].customer_id_ref == field.customer_id_ref == "CTR1"
    dataset = make_dataset()
    outline = to_lonlat(dataset.table("field").geometry.to_numpy(), dataset.crs)[0]
    area, _ = Geod(ellps="WGS84").geometry_area_perimeter(shapely.orient_polygons(outline))
    assert field.area == round(area)
    kinds = [polygon.type.value for polygon in field.polygons]
    assert sorted(map(int, kinds)) == [1, 6, 6, 6, 6]
    boundary = field.polygons[0]
    assert [int(line.type.value) for line in boundary.line_strings] == [1, 2]
    ring = [(float(p.east), float(p.north)) for p in boundary.line_strings[0].points]
    expected = to_lonlat(dataset.table("field").geometry.to_numpy(), dataset.crs)[0]
    outline = shapely.Polygon(ring)
    assert shapely.hausdorff_distance(outline, shapely.Polygon(expected.exterior)) < 2e-9


@pytest.mark.parametrize("version", [3, 4])
def test_who_wrote_it_is_told_of_an_imported_field_too(tmp_path, version):
    """It said version 0."""
    dataset = replace(make_dataset(), provenance=Provenance())
    (file,) = write_dataset(dataset, tmp_path, [NAMES[version]])
    root = ET.parse(file).getroot()
    assert root.get("ManagementSoftwareManufacturer") == "geofield"
    assert root.get("ManagementSoftwareVersion") == __version__


def test_guidance_of_version_4(files):
    data, _ = isoxml_from_path(files[4])
    groups = data.partfields[0].guidance_groups
    patterns = [group.guidance_patterns for group in groups]
    assert all(len(one) == 1 for one in patterns)
    reference, *explicit = [one[0] for one in patterns]
    dataset = make_dataset()
    assert len(explicit) == len(dataset.table("segments"))
    assert int(reference.propagation_direction.value) == 1
    assert (reference.number_of_swaths_left, reference.number_of_swaths_right) == (11, 0)
    geod = Geod(ellps="WGS84")
    for pattern in explicit:
        assert int(pattern.propagation_direction.value) == 4
        assert int(pattern.extension.value) == 4
        line = pattern.line_strings[0] if hasattr(pattern, "line_strings") else pattern.line_string
        a, b = line.points
        assert (int(a.type.value), int(b.type.value)) == (6, 7)
        assert line.width == round(5000 / SCALE)
        azimuth, _, _ = geod.inv(float(a.east), float(a.north), float(b.east), float(b.north))
        assert abs((float(pattern.heading) - azimuth + 180) % 360 - 180) < 0.005


def test_guidance_of_version_3_are_lines_of_the_field(files):
    data, _ = isoxml_from_path(files[3])
    lines = data.partfields[0].line_strings
    assert len(lines) == len(make_dataset().table("segments"))
    assert {int(line.type.value) for line in lines} == {5}
    assert {int(point.type.value) for line in lines for point in line.points} == {2}


@pytest.mark.parametrize("version", [3, 4])
def test_no_fault_by_the_rules(files, version):
    assert [each for each in validate_file(files[version]) if each.level == "error"] == []


@pytest.mark.parametrize("version", [3, 4])
def test_the_schema_itself(files, version):
    folder = os.environ.get("ISOXML_XSD")
    if folder is None:
        pytest.skip("ISOXML_XSD names no folder with the schema files, which are not free")
    import xmlschema

    (schema,) = sorted(Path(folder).glob(f"ISO11783_TaskFile_V{version}-3.xsd"))
    xmlschema.XMLSchema(schema).validate(files[version])


BREAKS = [
    ('C="35.07', 'C="95.07', "beyond 90 degrees"),
    ('A="PFD1"', 'A="F1"', "is not PFD and digits"),
    (f'C="{NAME}"', f'C="{"x" * 33}"', "33 of 32 characters"),
    ('VersionMajor="4"', 'VersionMajor="7"', "not 3 or 4"),
    ('E="CTR1"', 'E="CTR9"', "names nothing"),
    ('<PNT A="7"', '<PNT A="2"', "an AB line is"),
    ('D="6389"', 'D="6389.5"', "whole square metres"),
    ('<PLN A="6"', '<PLN A="66"', "no code of this version"),
    ('<PLN A="6"', '<PLN A="²"', "A='²' is no code of this version"),
    ('<PLN A="6"', '<PLN A="٦"', "A='٦' is no code of this version"),
    ('C="35.07', 'C="٣5.07', "is no number with 9 decimals"),
]


@pytest.mark.parametrize(("old", "new", "message"), BREAKS)
def test_broken_rules_are_found(files, tmp_path, old, new, message):
    text = files[4].read_text(encoding="utf-8")
    assert old in text
    broken = tmp_path / "TASKDATA.XML"
    broken.write_text(text.replace(old, new), encoding="utf-8")
    assert any(message in each.message for each in validate_file(broken))


def test_damaged_and_foreign_files(files, tmp_path):
    broken = tmp_path / "TASKDATA.XML"
    broken.write_bytes(files[4].read_bytes()[:5000])
    with pytest.raises(FormatError, match="not well-formed"):
        read_dataset(broken)
    root = ET.parse(files[4]).getroot()
    field = root.find("PFD")
    root.append(field)
    ET.ElementTree(root).write(broken)
    with pytest.raises(FormatError, match="holds 2 fields"):
        read_dataset(broken)


def test_fields_in_a_file_of_their_own(files, tmp_path):
    root = ET.parse(files[4]).getroot()
    field = root.find("PFD")
    root.remove(field)
    ET.SubElement(root, "XFR", A="PFD00001", B="1")
    outer = ET.Element("XFC")
    outer.append(field)
    ET.ElementTree(root).write(tmp_path / "TASKDATA.XML")
    with pytest.raises(FormatError, match="lacks PFD00001"):
        read_dataset(tmp_path)
    ET.ElementTree(outer).write(tmp_path / "PFD00001.XML")
    assert len(read_dataset(tmp_path).table("obstacles")) == 3


def test_a_boundary_with_two_exterior_rings_is_two_outlines(tmp_path):
    rings = "".join(
        '<LSG A="1">'
        + "".join(
            f'<PNT A="2" C="{50 + y}" D="{10 + x}"/>'
            for x, y in [(dx, 0), (dx + 0.001, 0), (dx + 0.001, 0.001), (dx, 0)]
        )
        + "</LSG>"
        for dx in (0, 0.01)
    )
    (tmp_path / "TASKDATA.XML").write_text(
        '<ISO11783_TaskData VersionMajor="4" VersionMinor="3" DataTransferOrigin="1">'
        f'<PFD A="PFD1" C="Two" D="1"><PLN A="1">{rings}</PLN></PFD></ISO11783_TaskData>'
    )
    with pytest.raises(FormatError, match="holds 2 outlines"):
        read_dataset(tmp_path)


RING = [(10.0, 50.0), (10.004, 50.0), (10.004, 50.003), (10.0, 50.003), (10.0, 50.0)]
BOW = [(10.001, 50.001), (10.002, 50.002), (10.002, 50.001), (10.001, 50.002), (10.001, 50.001)]


def task_data(folder, *inside):
    (folder / "TASKDATA.XML").write_text(
        '<ISO11783_TaskData VersionMajor="4" VersionMinor="3" DataTransferOrigin="1">'
        f'<PFD A="PFD1" C="One" D="1">{"".join(inside)}</PFD></ISO11783_TaskData>'
    )
    return folder


def polygon(kind, *rings):
    lines = [
        f'<LSG A="{1 if number == 0 else 2}">'
        + "".join(f'<PNT A="2" C="{lat}" D="{lon}"/>' for lon, lat in ring)
        + "</LSG>"
        for number, ring in enumerate(rings)
    ]
    return f'<PLN A="{kind}">{"".join(lines)}</PLN>'


def test_trees_of_one_name_are_all_there(tmp_path):
    trees = [f'<PNT A="5" B="Tree" C="50.001" D="{lon}"/>' for lon in (10.001, 10.002, 10.003)]
    dataset = read_dataset(task_data(tmp_path, polygon(1, RING), *trees))
    assert list(dataset.table("obstacles")["obstacle_no"]) == [1, 2, 3]


def test_rings_that_cross_themselves_are_repaired(tmp_path):
    dataset = read_dataset(task_data(tmp_path, polygon(1, RING, BOW), polygon(6, BOW)))
    assert dataset.table("field").geometry.is_valid.all()
    assert len(dataset.table("obstacles")) == 2


def test_a_hole_whose_first_corner_is_rounded_beyond_the_border_is_one(tmp_path):
    """It was gone without a word, and ground in it for driving."""
    hole = [(10.0 - 1e-9, 50.001), (10.001, 50.001), (10.001, 50.002), (10.0 - 1e-9, 50.001)]
    rest = shapely.Polygon(RING).difference(shapely.Polygon(hole))
    field = read_dataset(task_data(tmp_path, polygon(1, RING, hole))).table("field").to_crs(4326)
    assert shapely.symmetric_difference(field.geometry.iloc[0], rest).area < 1e-6 * rest.area


def test_trees_that_a_cut_name_leaves_out_are_in_their_obstacle(tmp_path):
    """Nine trees stood in it, eight of them anew and 2 m wide."""
    dataset = make_dataset()
    x, y = (np.linspace(20, 75, 12) + X0, np.full(12, Y0 + 30.0))
    rows = {"obstacle_no": range(1001, 1013), "kind": ["tree"] * 12, "status": ["detected"] * 12}
    hedge = schema.table(schema.OBSTACLES, rows, circle_polygons(x, y, np.full(12, 3.5), UTM), UTM)
    dataset.tables["obstacles"] = hedge
    write_dataset(dataset, tmp_path, ["isoxml"])
    back = read_dataset(tmp_path / "isoxml").table("obstacles")
    assert back[["obstacle_no", "kind"]].values.tolist() == [[1001, "tree"]]
    assert shapely.symmetric_difference(back.geometry[0], hedge.union_all()).area < 0.01


def test_fences_and_obstacles_that_are_lines_stand_there(tmp_path):
    """They were left out without a word, as were drains and flags."""
    ends = '<PNT A="2" C="50.001" D="10.001"/><PNT A="2" C="50.001" D="10.002"/>'
    kinds = {"7": "", "9": ' C="3000"', "6": "", "5": ""}
    lines = [f'<LSG A="{kind}"{width}>{ends}</LSG>' for kind, width in kinds.items()]
    flags = ['<PNT A="1" C="50.001" D="10.001"/>'] * 2
    task_data(tmp_path, polygon(1, RING), *lines, *flags)
    dataset = read_dataset(tmp_path)
    long_m = Geod(ellps="WGS84").line_length([10.001, 10.002], [50.001, 50.001])
    areas = ground_areas_m2(dataset.table("obstacles").geometry, dataset.crs)
    assert areas.tolist() == pytest.approx([0.1 * long_m, 3.0 * long_m], rel=0.05)
    assert len(dataset.table("tracks")) == 1
    for words in (
        "1 line of type fence taken",
        "1 line left out: drainage",
        "2 points left out: f",
    ):
        assert any(words in note for note in dataset.notes)


@pytest.mark.parametrize("west", [10.0, 179.998, -179.9999, 179.9955])
def test_a_heading_through_a_field_goes_on_across_180(tmp_path, west):
    """A tenth of the line was there."""
    ring = [((x - 10 + west + 180) % 360 - 180, y) for x, y in RING]
    point = f'<PNT A="6" C="50.0015" D="{(west + 0.0021 + 180) % 360 - 180}"/>'
    line = f'<GPN A="GPN1" C="2" G="80"><LSG A="5">{point}</LSG></GPN>'
    dataset = read_dataset(task_data(tmp_path, polygon(1, ring), f'<GGP A="GGP1">{line}</GGP>'))
    (found,) = dataset.table("segments").to_crs(4326).geometry
    (lon0, lat0), (lon1, lat1) = found.coords
    azimuth, _, metres = Geod(ellps="WGS84").inv(lon0, lat0, lon1, lat1)
    assert (azimuth, metres) == pytest.approx((80.0, 291.198), abs=2e-3)


@pytest.mark.parametrize(("pattern", "kinds", "told"), [
    ('C="1"', "6", "fewer than two points"),
    ('C="2" G="90"', "", "an A+ line without a point or heading"),
    ('C="2"', "6", "an A+ line without a point or heading"),
    ('C="4" H="9000"', "6", "a pivot without a centre"),
    ('C="4"', "8", "a pivot without a radius"),
    ('C="1" E="1"', "67", "1 line to be repeated left out, others being there: New"),
])  # fmt: skip
def test_guidance_that_is_not_driven_is_told(tmp_path, pattern, kinds, told):
    def group(number, name, how, kinds):
        points = "".join(
            f'<PNT A="{kind}" C="50.001" D="{10.001 + place / 1000}"/>'
            for place, kind in enumerate(kinds)
        )
        own = f'<GPN A="GPN{number}" B="{name}" {how}><LSG A="5">{points}</LSG></GPN>'
        return f'<GGP A="GGP{number}">{own}</GGP>'

    groups = group(1, "Old", 'C="1" E="4"', "67"), group(2, "New", pattern, kinds)
    dataset = read_dataset(task_data(tmp_path, polygon(1, RING), *groups))
    assert len(dataset.table("tracks")) == 1
    assert any(told in note for note in dataset.notes)


@pytest.mark.parametrize("figure", ["nan", "inf", "1e400", "north"])
def test_positions_that_are_no_numbers(tmp_path, figure):
    """Infinity ended in a traceback of GEOS."""
    ring = [*RING[:3], (10.0, figure), RING[0]]
    with pytest.raises(FormatError, match=f"PNT C='{figure}' is no number"):
        read_dataset(task_data(tmp_path, polygon(1, ring)))


@pytest.mark.parametrize(("pattern", "kind"), [
    ('C="2" G="north"', 6), ('C="2" G="nan"', 6), ('C="4" H="wide"', 8), ('C="4" H="inf"', 8),
])  # fmt: skip
def test_figures_of_guidance_that_are_none(tmp_path, pattern, kind):
    line = f'<LSG A="5"><PNT A="{kind}" C="50.001" D="10.001"/></LSG>'
    group = f'<GGP A="GGP1"><GPN A="GPN1" {pattern}>{line}</GPN></GGP>'
    task_data(tmp_path, polygon(1, RING), group)
    with pytest.raises(FormatError, match="no number"):
        read_dataset(tmp_path)
    assert any(each.level == "error" for each in validate_file(tmp_path))
