# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # 05 Exchange with farm tools
#
# A plan goes out as many formats, and comes back from most of them. This notebook writes every
# format that geofield knows, says what each leaves out, reads back what can be read, and measures
# how far the coordinates moved on the way.

# %%
import json
import tempfile
import warnings
from pathlib import Path

import geopandas as gpd
import pandas as pd
import shapely

import geofield as gf
from geofield.formats import FORMATS, read_dataset

warnings.simplefilter("ignore", gf.GeofieldWarning)  # what formats leave out is shown below
pd.set_option("display.max_colwidth", 70)
pd.set_option("display.width", 140)
out = Path(tempfile.mkdtemp())

# %% [markdown]
# ## A plan from any polygon
#
# Field and trees of the sample, tracks 6 m apart.

# %%
field = gpd.read_file("../sample_data/field_2.gpkg", layer="field")
trees = gpd.read_file("../sample_data/field_2.gpkg", layer="obstacles")
tracks = gf.plan_tracks(field.geometry.iloc[0], trees, crs=field.crs, spacing_m=6.0, step_m=2.0)
plan = gf.Plan(
    field=gf.Field(field.geometry.iloc[0], field.crs, name="Sample two", method="boundary"),
    obstacles=gf.read_plan("../sample_data/field_2.gpkg").obstacles,
    tracks=tracks,
)
print(
    f"{plan.field.area_ha:.2f} ha, {len(plan.obstacles)} obstacles, {len(tracks.segments)} segments"
)

# %% [markdown]
# ## Every format

# %%
rows = []
for name, kind in FORMATS.items():
    folder = out / name
    files = plan.write(folder, formats=[name])
    own = [path for path in files if path.name not in ("map.png", "report.json")]
    size_kb = sum(path.stat().st_size for path in own) / 1024
    back = "yes" if kind.reader else ""
    rows.append((name, kind.title, len(own), round(size_kb), back))
print(
    pd.DataFrame(rows, columns=["format", "title", "files", "kB", "read back"]).to_string(
        index=False
    )
)

# %% [markdown]
# ## What each leaves out
#
# The report of a run says it too, so that nothing is lost unseen.

# %%

for name in ("geojson", "shapefile", "kml", "isoxml", "agopengps", "gpx", "csv"):
    report = json.loads((out / name / "report.json").read_text(encoding="utf-8"))
    print(f"{name:10}", "; ".join(report["formats"][name]["leaves_out"]) or "nothing")

# %% [markdown]
# ## There and back
#
# The outline that comes back, against the one that went out: the largest distance between the
# two in millimetres. (Of formats with a file per layer, the field's file alone is read here.)
# Formats in longitude and latitude round to some decimals; the registry
# states how far a coordinate may move.


# %%
def first_file(name):
    """The file or folder to read a format back from."""
    folder = out / name
    if name in ("isoxml", "isoxml-v3"):
        return folder / name
    if name == "agopengps":
        return next((folder / "agopengps" / "Fields").iterdir())
    names = ("field", "boundary")
    found = [p for p in sorted(folder.rglob("*")) if p.suffix in FORMATS[name].suffixes]
    return next((p for p in found if p.stem in names), found[0] if found else folder / "field.rdf")


rows = []
for name, kind in FORMATS.items():
    if kind.reader is None or "field" not in kind.layers:
        continue
    back = read_dataset(first_file(name))
    outline = back.table("field").to_crs(plan.field.crs).geometry.iloc[0]
    moved_mm = 1000 * shapely.hausdorff_distance(outline, plan.field.polygon)
    limit = 1000 * kind.precision_m
    rows.append((name, round(moved_mm, 3), limit, len(back.table("obstacles"))))
table = pd.DataFrame(rows, columns=["format", "moved mm", "stated mm", "obstacles back"])
print(table.to_string(index=False))
assert (table["moved mm"] <= table["stated mm"] + 0.01).all()

# %% [markdown]
# ## Inside an ISOXML task
#
# The file that most terminals read. `PFD` is the field, `PLN` a polygon (type 1 the boundary,
# others obstacles), `GGP` a guidance group, `GPN` a pattern and `LSG` a line.

# %%
from collections import Counter
from xml.etree import ElementTree

taskdata = next((out / "isoxml").rglob("TASKDATA.XML"))
root = ElementTree.parse(taskdata).getroot()
print(taskdata.relative_to(out), root.attrib["VersionMajor"], root.attrib.get("VersionMinor"))
print(Counter(element.tag for element in root.iter()).most_common(8))

# %% [markdown]
# ## An AgOpenGPS field folder

# %%
folder = first_file("agopengps")
for path in sorted(folder.iterdir()):
    lines = path.read_text(encoding="utf-8").splitlines()
    print(f"{path.name:16} {len(lines):5} lines | " + " | ".join(lines[:3]))
