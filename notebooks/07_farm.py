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
# # 07 A farm
#
# Many fields in one value: parcels that a person drew and points in a picture, planned together,
# shown on one map, joined with what the owner knows of them, and exported in one file.

# %%
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import geopandas as gpd
import look
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import shapely
from IPython.display import display

import geofield as gf

look.use()
out = Path(tempfile.mkdtemp())


def geofield(*words: object) -> str:
    """The command line, as typed; what it says, without the folder."""
    line = [sys.executable, "-m", "geofield", *map(str, words)]
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    return done.stderr.replace(f"{out}/", "")


# %% [markdown]
# ## Parcels of a made-up farm
#
# Twelve fields. The owner's columns come along; `spacing_m` is a setting, so it holds for its
# field alone.

# %%
rng = np.random.default_rng(7)
shapes, crops = [], []
for row in range(3):
    for column in range(4):
        x, y = 500_000 + 300 * column + 25 * row, 5_300_000 + 240 * row
        corners = np.array([[0, 0], [270, 0], [270, 210], [0, 210]]) + rng.uniform(-22, 22, (4, 2))
        shapes.append(shapely.Polygon(corners + np.array([x, y])))
        crops.append(["wheat", "maize", "rape"][(row + column) % 3])
parcels = gpd.GeoDataFrame(
    {
        "id": [f"P{number:02d}" for number in range(1, 13)],
        "crop": crops,
        "spacing_m": [6.0 if crop == "wheat" else 9.0 for crop in crops],
    },
    geometry=shapes,
    crs="EPSG:32633",
)
parcels.to_file(out / "parcels.gpkg")
trees = gpd.GeoDataFrame(
    {"radius_m": rng.uniform(2, 6, 25)},
    geometry=[
        shapely.Point(p) for p in rng.uniform([500_050, 5_300_050], [501_150, 5_300_600], (25, 2))
    ],
    crs="EPSG:32633",
)
trees.to_file(out / "trees.gpkg")
farm = gf.Farm(gf.plan_fields(out / "parcels.gpkg", obstacles=out / "trees.gpkg"))
display(farm)

# %% [markdown]
# ## One map

# %%
figure, axes = plt.subplots(figsize=(8, 5.4))
farm.fields.plot(ax=axes, column="crop", cmap="Pastel1", edgecolor="0.2", legend=True)
farm.segments.plot(ax=axes, color="0.25", linewidth=0.4)
if len(farm.obstacles):
    farm.obstacles.plot(ax=axes, color=look.COLOURS["obstacle"])
for label, point in zip(farm.fields["field_id"], farm.fields.representative_point(), strict=True):
    axes.annotate(label, (point.x, point.y), ha="center", fontsize=8, weight="bold")
axes.set_axis_off()
axes.set_title(f"{len(farm)} fields, {farm.fields['area_ha'].sum():.1f} ha")
plt.show()

# %% [markdown]
# ## One table
#
# Lengths and areas in the columns are true metres and hectares on the ground.

# %%
table = (
    farm.tracks.groupby("field_id")
    .agg(tracks=("track_no", "size"), km=("length_m", lambda metres: metres.sum() / 1000))
    .join(farm.fields.set_index("field_id")[["crop", "area_ha"]])
)
table["gaps"] = farm.gaps.groupby("field_id").size().reindex(table.index, fill_value=0)
table.round(2)

# %% [markdown]
# ## Joined with what the owner knows
#
# The id is the owner's own, so any table of theirs joins by it: what a kilometre costs per crop.

# %%
owner = pd.DataFrame(
    {"id": parcels["id"], "euro_per_km": np.where(parcels["crop"] == "maize", 9, 6)}
)
joined = table.merge(owner, left_index=True, right_on="id")
joined["euro"] = (joined["km"] * joined["euro_per_km"]).round(0)
joined.groupby("crop")[["area_ha", "km", "euro"]].sum().round(1)

# %% [markdown]
# ## Points in a picture
#
# Without an outline there must be a picture: the outline is found around the point, with what
# speaks against it. A point beside the picture fails alone.

# %%
pd.DataFrame(
    {
        "id": ["sample", "elsewhere"],
        "lat": [35.075373, 35.2],
        "lon": [33.531142, 33.6],
        "spacing_m": [8.0, 8.0],
    }
).to_csv(out / "points.csv", index=False)
geofield(
    "batch",
    out / "points.csv",
    "../sample_data/field_1.tif",
    "--workers",
    1,
    "--out",
    out / "found",
)
found = gf.read_farm(out / "found")
found.status[["field_id", "status", "error", "certainty", "doubts"]]
# %%
display(found["sample"])

# %% [markdown]
# ## Real parcels
#
# Where the project's real parcels lie beside the checkout: 42 declared fields of several
# countries, in several zones, with holes.

# %%
shared = Path(os.environ.get("GEOFIELD_SHARED", "../../shared")) / "data/fields/fields.gpkg"
if shared.is_file():
    real = gf.Farm(gf.plan_fields(shared, spacing_m=12.0))
    print(real)
    print(real.fields.groupby("utm_epsg")["area_ha"].agg(["size", "sum"]).round(1))
else:
    print("They are not here.")

# %% [markdown]
# ## Written, read, exported
#
# A folder of GeoParquet with an overview for QGIS; each plan comes back as it was.

# %%
farm.write(out / "farm")
again = gf.read_farm(out / "farm")
print(again["P07"] == farm["P07"])
print(
    geofield(
        "export", out / "farm", "--format", "isoxml", "--format", "kml", "--out", out / "export"
    )
)
