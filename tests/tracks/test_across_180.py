"""Fields across the 180th meridian, and what stands in them, however its longitude is written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely
from click.testing import CliRunner

import geofield as gf
from geofield.cli.main import cli

UTM = 32760
#: Where 180 degrees runs, and what stands on both of its sides, metres.
MIDDLE = np.array([819_790.0, 8_140_150.0])
TREES = np.add(MIDDLE, [(-90.0, 10.0), (0.0, -25.0), (95.0, 30.0)])


def _written(shapes: Sequence[shapely.Geometry], path: Path, turned: float | None) -> Path:
    """A file of shapes: in UTM, or in degrees with longitudes from `turned` on."""
    table = gpd.GeoDataFrame({"radius_m": [5.0] * len(shapes)}, geometry=list(shapes), crs=UTM)
    if turned is not None:
        table = table.to_crs(4326)
        table = table.set_geometry(
            shapely.transform(
                table.geometry.to_numpy(),
                lambda lonlat: np.column_stack(
                    [(lonlat[:, 0] - turned) % 360.0 + turned, lonlat[:, 1]]
                ),
            ),
            crs=4326,
        )
    table.to_file(path)
    return path


@pytest.mark.parametrize("trees_from", [None, -180.0, 0.0])
@pytest.mark.parametrize("field_from", [None, 0.0])
def test_trees_on_both_sides_are_avoided(
    tmp_path: Path, trees_from: float | None, field_from: float | None
) -> None:
    outline = shapely.box(*(MIDDLE - 150.0), *(MIDDLE + 150.0))
    parcel = _written([outline], tmp_path / "parcel.gpkg", field_from)
    lon = gpd.GeoSeries([outline], crs=UTM).to_crs(4326).get_coordinates()["x"]
    assert lon.min() < -179.99
    assert lon.max() > 179.99
    trees = _written(list(shapely.points(TREES)), tmp_path / "trees.gpkg", trees_from)
    done = CliRunner().invoke(
        cli,
        ["tracks", str(parcel), "--obstacles", str(trees), "--spacing", "4", "-o",
         str(tmp_path / "plan.gpkg")],
        catch_exceptions=False,
    )  # fmt: skip
    assert done.exit_code == 0
    assert "NOTHING" not in done.stderr
    plan = gf.read_plan(tmp_path / "plan.gpkg")
    assert plan.obstacles is not None
    assert plan.tracks is not None
    at = plan.obstacles.to_crs(UTM).geometry.centroid.get_coordinates().to_numpy()
    assert np.abs(at[np.argsort(at[:, 0])] - TREES).max() < 0.01
    lines = plan.tracks.segments.to_crs(UTM).geometry.to_numpy()
    assert shapely.distance(lines[:, None], shapely.points(TREES)[None, :]).min() > 4.99


def _lon(south: float, *sides: tuple[float, float]) -> shapely.MultiPolygon:
    """An outline in degrees, cut at 180 where it has two sides."""
    return shapely.MultiPolygon([shapely.box(a, south, b, south + 0.001) for a, b in sides])


@pytest.mark.filterwarnings("ignore:.*cannot carry.*:geofield.errors.FormatWarning")
def test_fields_of_two_zones_across_180_are_whole_and_read_back(tmp_path: Path) -> None:
    parcels = tmp_path / "fiji.geojson"
    outlines = [
        _lon(-17.2, (179.998, 180.0)),
        _lon(-17.21, (179.999, 180.0), (-180.0, -179.999)),
        _lon(-17.22, (-179.92, -179.918)),
    ]
    gpd.GeoDataFrame({"field_id": ["a", "x", "z"]}, geometry=outlines, crs=4326).to_file(parcels)

    def run(*words: object) -> None:
        done = CliRunner().invoke(cli, [str(word) for word in words], catch_exceptions=False)
        assert done.exit_code == 0, done.output

    folder = tmp_path / "farm"
    run("tracks", parcels, "--spacing", 12, "-o", folder)
    overview = folder / "farm.gpkg"
    for layer in ("field", "tracks", "segments"):
        shapes = gpd.read_file(overview, layer=layer).geometry
        assert shapes.bounds.eval("maxx - minx").max() < 300.0

    fields = gpd.read_file(overview, layer="field")
    grown = fields.geometry.scale(1.1, 1.0)
    fields.set_geometry(grown.where(fields["field_id"] == "x", fields.geometry)).to_file(
        overview, layer="field", driver="GPKG"
    )
    before = {plan.field.field_id: plan.field for plan in gf.read_farm(folder)}
    run("farm", "put", overview, folder)
    after = gf.read_farm(folder)
    assert after.status.set_index("field_id")["reviewed"].to_dict() == {
        "a": False, "x": True, "z": False,
    }  # fmt: skip
    assert after["x"].field.area_ha == pytest.approx(1.1 * before["x"].area_ha, rel=1e-4)
    assert after["a"].field.polygon.equals(before["a"].polygon)

    for name in ("gpkg", "geojson", "shapefile"):
        run("export", folder, "--format", name, "--out", tmp_path / name)
    read = [next((tmp_path / "gpkg").glob("*.gpkg")), *tmp_path.glob("geojson/**/field.geojson")]
    read += tmp_path.glob("shapefile/**/boundary.shp")
    assert len(read) == 3
    for path in read:
        parts = gpd.read_file(path, layer=0).explode().to_crs(3832).bounds.eval("maxx - minx")
        assert 0.0 < parts.max() < 300.0
