"""What is said of a datum: which grids of corrections are lacking, and how exact they make it."""

from types import SimpleNamespace

import pytest
from pyproj import CRS
from pyproj.transformer import AreaOfInterest, TransformerGroup

from geofield import datum
from geofield.crs import LONLAT

CONUS, KANSAS = "us_noaa_conus.tif", "us_noaa_kshpgn.tif"


@pytest.mark.parametrize(("there", "told"), [
    ((), f"2 grids to 1.5 m: pyproj sync --file {CONUS}, then pyproj sync --file {KANSAS}"),
    ((CONUS,), f"its grid to 1.5 m: pyproj sync --file {KANSAS}"),
])  # fmt: skip
def test_each_grid_that_a_way_lacks_is_named(monkeypatch, there, told):
    """Of NAD27 in Kansas the first was, which makes it 5 m, and was again once it was there."""
    grids = [SimpleNamespace(short_name=name, available=name in there) for name in (CONUS, KANSAS)]
    ways = SimpleNamespace(
        transformers=[SimpleNamespace(accuracy=5.0 if there else 7.0)],
        unavailable_operations=[
            SimpleNamespace(accuracy=5.0, grids=grids[:1]),
            SimpleNamespace(accuracy=1.5, grids=grids),
        ],
    )
    monkeypatch.setattr(datum, "TransformerGroup", lambda *_, **__: ways)
    datum._notes.cache_clear()
    (note,) = datum.datum_notes(CRS.from_epsg(26714), 5e5, 4.2e6)
    datum._notes.cache_clear()
    assert note.startswith("Positions in EPSG:26714 are good to ")
    assert note.endswith(told)


@pytest.mark.filterwarnings("ignore:Best transformation is not available")
def test_what_proj_itself_lists_for_nad27_is_told_whole():
    area = AreaOfInterest(-98.0, 38.0, -98.0, 38.0)
    crs = CRS.from_epsg(4267)
    ways = TransformerGroup(crs, LONLAT, always_xy=True, area_of_interest=area)
    if not ways.unavailable_operations:
        pytest.skip("the grids of NAD27 are installed")
    lacks = [grid.short_name for grid in ways.unavailable_operations[0].grids if not grid.available]
    (note,) = datum.datum_notes(crs, -98.0, 38.0)
    assert [each.strip(",") for each in note.split() if each.startswith("us_noaa")] == lacks
