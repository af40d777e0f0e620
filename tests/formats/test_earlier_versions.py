"""Files that an earlier version wrote are read as it wrote them.

The archive was made by the code of 22 November 2026, before outlines had certainties, plans had
IRIs of their own and GeoPackages a record of what was written: two trees, three tracks.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import shapely

from geofield.formats import read_dataset
from geofield.plan import read_plan
from geofield_command import run_geofield as geofield

ARCHIVE = Path(__file__).parent / "earlier" / "plan_of_2026_11_22.zip"
LINKED = ("field.rdf", "field.ttl", "field.jsonld", "field.nt")


@pytest.fixture
def earlier(tmp_path: Path) -> Path:
    shutil.unpack_archive(ARCHIVE, tmp_path)
    return tmp_path


@pytest.mark.parametrize("product", ["geojson", *LINKED])
def test_all_products_hold_the_same_plan(earlier: Path, product: str) -> None:
    base, other = read_dataset(earlier / "field.gpkg"), read_dataset(earlier / product)
    # 12 mm is what seven decimals of a degree leave; linked data have the metres themselves.
    within_m = 0.02 if product == "geojson" else 1e-6
    for layer, count in (("field", 1), ("obstacles", 2), ("segments", 4), ("gaps", 1)):
        ours, theirs = base.table(layer), other.table(layer).to_crs(base.crs)
        assert len(ours) == len(theirs) == count
        far_m = shapely.hausdorff_distance(ours.geometry.to_numpy(), theirs.geometry.to_numpy())
        assert far_m.max() < within_m, layer
    assert list(base.table("obstacles")["obstacle_no"]) == list(
        other.table("obstacles")["obstacle_no"]
    )
    assert np.allclose(
        base.table("obstacles")["confidence"], other.table("obstacles")["confidence"], atol=1e-4
    )
    assert len(base.table("track_points")) == len(other.table("track_points")) == 71


def test_work_goes_on_from_an_earlier_plan(earlier: Path) -> None:
    plan = earlier / "field.gpkg"
    before = read_plan(plan)
    done = geofield("tracks", plan, "--spacing", 6, "-o", plan)
    assert done.returncode == 0, done.stderr
    after = read_plan(plan)
    assert after.field.polygon.equals(before.field.polygon)
    # What that version did not record is no edit of a person.
    assert set(after.obstacles["status"]) == {"detected"}
    assert after.obstacles.geometry.geom_equals(before.obstacles.geometry).all()
    assert after.tracks.spacing_m == 6
    done = geofield("export", plan, "-f", "isoxml", "-f", "turtle", "--out", earlier / "new")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("product", LINKED)
def test_its_linked_data_are_imported_and_asked(earlier: Path, product: str) -> None:
    done = geofield("import", earlier / product, "-o", earlier / "new.gpkg")
    assert done.returncode == 0, done.stderr
    assert len(read_plan(earlier / "new.gpkg").obstacles) == 2
    done = geofield("validate", earlier / product)
    assert "Traceback" not in done.stderr
