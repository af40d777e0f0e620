"""The commands: export, import, validate, info, formats."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace

import pytest
import rasterio
from click.testing import CliRunner
from formats_plan import NAME, make_dataset
from rasterio.transform import from_origin

from geofield.cli.export import export
from geofield.cli.formats import formats
from geofield.cli.import_ import import_
from geofield.cli.info import info
from geofield.cli.main import cli
from geofield.cli.validate import validate
from geofield.errors import FormatError
from geofield.formats import FORMATS, read_dataset, write_dataset

pytestmark = pytest.mark.filterwarnings("ignore::geofield.errors.FormatWarning")


@pytest.fixture
def plan_file(tmp_path):
    write_dataset(make_dataset(), tmp_path, ["gpkg"])
    return tmp_path / "field.gpkg"


def run(command, *arguments):
    done = CliRunner().invoke(command, [str(a) for a in arguments], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done


def test_formats_lists_every_format():
    listed = json.loads(run(formats, "--json").stdout)
    assert [each["name"] for each in listed] == list(FORMATS)
    text = run(formats).stdout
    for name in FORMATS:
        assert name in text
    assert "settings and evidence" in text


def test_export_and_import_and_validate(plan_file, tmp_path):
    out = tmp_path / "export"
    done = run(export, plan_file, "-f", "isoxml,kml", "-f", "agopengps", "--out", out, "--json")
    files = json.loads(done.stdout)["files"]
    assert len(files) == 7
    for product in ("isoxml", "field.kml", "agopengps/Fields"):
        run(validate, out / product)
        back = tmp_path / f"back-{product.replace('/', '-')}.gpkg"
        found = json.loads(run(import_, out / product, "-o", back, "--json").stdout)
        assert found["name"] == NAME
        assert found["rows"]["field"] == 1
        assert read_dataset(back).name == NAME


def test_export_options_reach_the_writer(plan_file, tmp_path):
    out = tmp_path / "stick"
    run(
        export, plan_file, "-f", "shapefile", "--profile", "aggps", "--customer", "Ann Löw",
        "--farm", "Nord", "--out", out,
    )  # fmt: skip
    assert (
        out / "AgGPS" / "Data" / "Ann_Low" / "Nord" / "Grosser_Acker_Nandu" / "swaths.shp"
    ).is_file()
    run(export, plan_file, "-f", "shapefile", "--zip", "--out", tmp_path / "zip")
    assert [p.name for p in (tmp_path / "zip").iterdir()] == ["field_shapefile.zip"]


def test_a_project_shows_the_picture_where_it_lies_beside_it_alone(sample, tmp_path):
    dataset, picture = make_dataset(), tmp_path / "scene.tif"
    with rasterio.open(sample / "field_1.tif") as file:
        west, _, _, north = dataset.tables["field"].to_crs(file.crs).total_bounds
        place = from_origin(west, north, *file.res)
        profile = {**file.profile, "transform": place, "driver": "GTiff"}
        with rasterio.open(picture, "w", **profile) as there:
            there.write(file.read())
    write_dataset(replace(dataset, scene_path=picture), tmp_path, ["gpkg"])
    run(export, tmp_path / "field.gpkg", "-f", "gpkg,html", "--out", tmp_path / "out")
    run(export, tmp_path / "field.gpkg", "-f", "gpkg,scene", "--out", tmp_path / "whole")
    for place in ("", "/.."):
        back = tmp_path / f"whole{place}" / "back.gpkg"
        run(import_, tmp_path / "field.gpkg", "-o", back)
        assert shown(back) == (place == "/..")
    assert shown(tmp_path / "field.gpkg")
    assert not shown(tmp_path / "out" / "field.gpkg")
    assert shown(tmp_path / "whole" / "field.gpkg")
    assert "data:image/webp" in (tmp_path / "out" / "field.html").read_text(encoding="utf-8")


def shown(plan_file):
    with zipfile.ZipFile(plan_file.with_suffix(".qgz")) as project:
        return b"scene.tif" in project.read(project.namelist()[0])


def test_export_never_replaces_its_input(plan_file):
    with pytest.raises(FormatError, match="is an input"):
        run(export, plan_file, "-f", "gpkg", "--out", plan_file.parent, "--overwrite")


def test_info(plan_file):
    facts = json.loads(run(info, plan_file, "--json").stdout)
    assert facts["name"] == NAME
    assert facts["rows"]["segments"] == 23
    assert facts["obstacles"] == {"added": 1, "confirmed": 1, "detected": 1, "rejected": 1}
    assert facts["origin"]["licence"] == "CC BY 4.0"
    assert "0.6389" in run(info, plan_file).stdout


def test_info_of_a_field_across_180_degrees(tmp_path):
    import geopandas as gpd

    middle = gpd.points_from_xy([-179.9999], [-17.0], crs=4326).to_crs(32701)[0]
    gpd.GeoDataFrame(geometry=[middle.buffer(150)], crs=32701).to_file(tmp_path / "fiji.gpkg")
    facts = json.loads(run(info, tmp_path / "fiji.gpkg", "--json").stdout)
    assert abs(facts["field"]["lon"]) > 179.99
    assert facts["field"]["lat"] == pytest.approx(-17.0, abs=0.01)


def test_info_of_a_picture(sample):
    facts = json.loads(run(info, sample / "field_1.tif", "--json").stdout)
    assert facts["centre"]["lat"] == pytest.approx(35.075, abs=0.01)
    assert facts["metres per pixel on the ground"] > 0


def test_info_of_pictures_of_any_name_and_without_a_place(sample, tmp_path):
    import shutil

    import rasterio

    named = shutil.copy(sample / "field_1.tif", tmp_path / "field_1.img")
    facts = json.loads(run(info, named, "--json").stdout)
    assert facts["centre"]["lat"] == pytest.approx(35.075, abs=0.01)
    local = tmp_path / "local.tif"
    shape = {"width": 9, "height": 9, "count": 1, "dtype": "uint8"}
    crs = rasterio.crs.CRS.from_wkt('LOCAL_CS["mine",UNIT["metre",1]]')
    with rasterio.open(local, "w", **shape, crs=crs, transform=rasterio.Affine.scale(2, -2)):
        pass
    facts = json.loads(run(info, local, "--json").stdout)
    assert "mine" in facts["CRS"]
    assert "centre" not in facts
    nowhere = tmp_path / "nowhere.tif"
    with (
        pytest.warns(rasterio.errors.NotGeoreferencedWarning),
        rasterio.open(nowhere, "w", **shape, crs="EPSG:32636"),
    ):
        pass
    facts = json.loads(run(info, nowhere, "--json").stdout)
    assert facts["position"] == "not recorded"
    assert "centre" not in facts
    (tmp_path / "plain.txt").write_text("neither picture nor vector file")
    with pytest.raises(FormatError, match=r"format of .*plain.txt is not known"):
        run(info, tmp_path / "plain.txt")


def test_validate_goes_on_behind_what_it_cannot_read(plan_file, tmp_path):
    (tmp_path / "plain.txt").write_text("no product")
    files = [str(tmp_path / "plain.txt"), str(plan_file)]
    done = CliRunner().invoke(validate, [*files, "--json"])
    assert done.exit_code == 1
    found = json.loads(done.stdout)
    assert found[files[1]] == []
    (only,) = found[files[0]]
    assert only["level"] == "error"
    assert "is not known" in only["message"]


def test_validate_knows_products_that_nothing_checks(plan_file, tmp_path):
    """The report of a run was called a GeoJSON file without features."""
    run(export, plan_file, "-f", "report,html", "--out", tmp_path)
    for file in (tmp_path / "report.json", tmp_path / "field.html"):
        done = CliRunner().invoke(validate, [str(file), "--json"])
        assert done.exit_code == 0
        ((only,),) = json.loads(done.stdout).values()
        assert only["level"] == "warning"
        assert "there is no check for" in only["message"]
        with pytest.raises(FormatError, match="can be written, not read"):
            run(info, file)


@pytest.mark.parametrize("name", ["geojson", "shapefile", "geoparquet", "flatgeobuf"])
def test_validate_passes_a_layer_that_is_empty(tmp_path, name):
    dataset = make_dataset()
    empty = dataset.tables["obstacles"].iloc[:0]
    dataset = replace(dataset, tables={**dataset.tables, "obstacles": empty})
    (file,) = (
        path
        for path in write_dataset(dataset, tmp_path, [name])
        if path.stem == "obstacles" and path.suffix in FORMATS[name].suffixes
    )
    done = CliRunner().invoke(validate, [str(file), "--json"])
    assert done.exit_code == 0
    ((only,),) = json.loads(done.stdout).values()
    assert (only["level"], only["message"]) == ("warning", "holds no geometries")


def test_validate_knows_a_project_by_its_geopackage(plan_file):
    project = plan_file.with_suffix(".qgz")
    done = CliRunner().invoke(validate, [str(project)])
    assert (done.exit_code, "check field.gpkg, which it shows" in done.output) == (0, True)
    plan_file.rename(plan_file.with_name("other.gpkg"))
    done = CliRunner().invoke(validate, [str(project)])
    assert (done.exit_code, "field.gpkg, which it shows, is not" in done.output) == (1, True)


def test_validate_finds_a_track_through_a_tree(tmp_path):
    dataset = make_dataset()
    dataset.tables["obstacles"].loc[2, "status"] = "confirmed"
    write_dataset(dataset, tmp_path, ["gpkg"])
    done = CliRunner().invoke(validate, [str(tmp_path / "field.gpkg")])
    assert done.exit_code == 1
    assert "runs through obstacle 3" in done.output


def test_validate_finds_what_was_drawn_and_what_is_empty(tmp_path):
    dataset = make_dataset()
    write_dataset(dataset, tmp_path, ["gpkg"])
    file = tmp_path / "field.gpkg"
    drawn = dataset.tables["obstacles"].iloc[[2]][["geometry"]]
    drawn.to_file(file, layer="obstacles", driver="GPKG")
    done = CliRunner().invoke(validate, [str(file)])
    assert "runs through an obstacle that was drawn" in done.output
    dataset.tables["field"].iloc[:0].to_file(file, layer="field", driver="GPKG")
    done = CliRunner().invoke(validate, [str(file)])
    assert "error: field: no row has an outline" in done.output


def test_import_says_when_the_crs_is_in_doubt(tmp_path):
    import geopandas as gpd
    import shapely

    box = shapely.box(5e5, 5.5e6, 5e5 + 100, 5.5e6 + 100)
    gpd.GeoDataFrame(geometry=[box], crs=32633).to_file(tmp_path / "a.shp")
    (tmp_path / "a.prj").unlink()
    with pytest.raises(FormatError, match="does not say its CRS"):
        run(import_, tmp_path / "a.shp", "-o", tmp_path / "a.gpkg")
    run(
        import_, tmp_path / "a.shp", "-o", tmp_path / "a.gpkg", "--crs", "EPSG:32633", "--name", "A"
    )
    assert read_dataset(tmp_path / "a.gpkg").name == "A"


def test_info_adds_up_the_fields_of_a_farm_wherever_they_lie(tmp_path):
    """Of two fields it told the first one's area, and a farm of several zones was refused."""
    import geopandas as gpd
    import shapely
    from pyproj import Geod

    places = [shapely.box(lon, 48.0, lon + 0.004, 48.002) for lon in (17.9, 18.1, 179.998)]
    geod, true_ha = Geod(ellps="WGS84"), 0.0
    for each in places:
        true_ha += geod.geometry_area_perimeter(shapely.segmentize(each, 1e-4))[0] / 1e4
    gpd.GeoDataFrame(geometry=places, crs=4326).to_file(tmp_path / "parcels.gpkg")
    run(cli, "batch", tmp_path / "parcels.gpkg", "--spacing", "40", "--out", tmp_path / "farm")
    told = json.loads(run(info, tmp_path / "farm", "--json").output)
    assert told["fields together"]["area (ha)"] == pytest.approx(true_ha, rel=1e-5)
    assert "metric CRS" not in told
    assert told["rows"]["field"] == 3


def test_bad_options_are_usage_errors(plan_file, tmp_path):
    done = CliRunner().invoke(
        export, [str(plan_file), "-f", "kml", "--out", str(tmp_path), "--option", "x"]
    )
    assert done.exit_code == 2
    assert "NAME=VALUE" in done.output


@pytest.mark.parametrize("name", ["export", "import", "validate", "info", "formats"])
def test_help_ends_with_an_example(name):
    text = run(cli, name, "--help").output
    assert f"geofield {name}" in text.partition("Options")[2]
