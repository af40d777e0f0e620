"""Every algorithm by QGIS's own command line, as scripts call it; on the sample and a real chip."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest
import rasterio
from plugin_place import POINT, ROOT, SAMPLE
from rasterio.warp import transform

import geofield as gf
from geofield.formats import read_dataset

COMMAND = "/usr/bin/qgis_process.bin"  # Debian's wrapper around it is broken


@pytest.fixture(scope="module")
def process(qgis_environment):
    """Run an algorithm; its results."""
    subprocess.run(
        [COMMAND, "plugins", "enable", "geofield_qgis"],
        env=qgis_environment, capture_output=True, check=False,  # enabled already is an error
    )  # fmt: skip

    def run(name, **values):
        words = []
        for key, value in values.items():
            each = value if isinstance(value, list) else [value]
            words += [f"--{key}={one}" for one in each]
        done = subprocess.run(
            [COMMAND, "--json", "run", f"geofield:{name}", *words],
            env=qgis_environment, capture_output=True, text=True, check=False, timeout=300,
        )  # fmt: skip
        assert done.returncode == 0, (name, done.stdout[-500:], done.stderr[-2000:])
        return json.loads(done.stdout[done.stdout.index("{") :])["results"]

    return run


def test_all_algorithms_one_after_the_other(process, tmp_path):
    picture, point, truth = SAMPLE, POINT, ROOT / "sample_data" / "field_1.gpkg"
    cut = process("imagery", IMAGERY=picture, POINT=point, SIZE_M=90, OUTPUT=tmp_path / "cut.tif")
    assert Path(cut["OUTPUT"]).is_file()
    plan = tmp_path / "plan.gpkg"
    process("outline", IMAGERY=picture, POINT=point, OUTPUT=plan)
    process("obstacles", IMAGERY=picture, PLAN=f"{plan}|layername=field", OUTPUT=plan)
    # QGIS writes into a GeoPackage that it reads; what the next steps read is a copy.
    source = shutil.copy(plan, tmp_path / "source.gpkg")
    tracks = process(
        "tracks", INPUT=f"{source}|layername=field", SPACING_M=6, OUTPUT=tmp_path / "tracks"
    )
    assert tracks["FIELDS"] == 1
    process(
        "route",
        INPUT=f"{source}|layername=field",
        SPACING_M=6,
        HEADLAND_M=12,
        OUTPUT=tmp_path / "route",
    )
    (routed,) = (tmp_path / "route").glob("*.gpkg")
    assert len(read_dataset(routed).table("route")) > 0
    (planned,) = (tmp_path / "tracks").glob("*.gpkg")
    made = read_dataset(planned)
    assert len(made.table("obstacles")) > 10
    out = tmp_path / "export"
    process("export", PLAN=f"{planned}|layername=field", FORMATS=["isoxml", "kml"], OUTPUT=out)
    (task,) = out.rglob("TASKDATA.XML")
    assert process("validate", FILES=task)["ERRORS"] == 0
    (kml,) = out.glob("*.kml")
    process("import", FILES=kml, OUTPUT=tmp_path / "imported.gpkg")
    assert len(read_dataset(tmp_path / "imported.gpkg").table("field")) == 1
    told = process(
        "evaluate",
        DETECTED=f"{source}|layername=obstacles",
        TRUTH=f"{truth}|layername=obstacles",
    )
    assert told["F1"] > 0.8
    tables = [read_dataset(Path(one)).table("obstacles") for one in (source, truth)]
    assert told["F1"] == pytest.approx(gf.evaluate(*tables).pooled.f1, abs=1e-3)


def test_a_real_chip_gives_what_the_command_gives(process, geofield, shared, tmp_path):
    chip = _chip(shared)
    lon, lat = _middle(chip)
    shown = f"{lon},{lat} [EPSG:4326]"
    process("plan", IMAGERY=chip, POINT=shown, SPACING_M=6, OUTPUT=tmp_path / "by_qgis")
    geofield(
        "run", chip, "--lat", lat, "--lon", lon, "--spacing", 6, "--out", tmp_path / "by_command"
    )
    one, other = (
        read_dataset(tmp_path / name / "field.gpkg") for name in ("by_qgis", "by_command")
    )
    for layer in ("field", "segments"):
        assert one.table(layer).geometry.geom_equals(other.table(layer).geometry).all()


def _chip(shared):
    return shared / "data" / "trees" / "riverside_2018_89.tif"


def _middle(chip):
    with rasterio.open(chip) as data:
        x, y = data.xy(data.height // 2, data.width // 2)
        (lon,), (lat,) = transform(data.crs, "EPSG:4326", [x], [y])
    return round(lon, 7), round(lat, 7)


def test_many_fields_at_once(process, tmp_path):
    shapes = [
        {"type": "Feature", "properties": {"name": name},
         "geometry": {"type": "Point", "coordinates": [lon, 35.075373]}}
        for name, lon in (("field", 33.531142),)
    ]  # fmt: skip
    places = tmp_path / "places.geojson"
    places.write_text(json.dumps({"type": "FeatureCollection", "features": shapes}))
    farm = process(
        "batch", PLACES=places, IMAGERY=SAMPLE, SPACING_M=6, WORKERS=1, OUTPUT=tmp_path / "farm"
    )
    assert farm["FIELDS"] == 1
    made = gf.read_farm(tmp_path / "farm")
    assert len(made) == 1
    assert 3.5 < made.fields["area_ha"].iloc[0] < 3.8
    assert farm["FIELD"] == f"{tmp_path}/farm/farm.gpkg|layername=field"
