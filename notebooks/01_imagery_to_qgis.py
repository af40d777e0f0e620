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
# # 01 A field, from imagery to QGIS
#
# One picture and one point in the field: this is all the main job needs. This notebook runs its
# four stages one by one, looks at each result, and shows how a person's word about an obstacle
# outlives every later run.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import pyogrio
from look import COLOURS, show_scene, use
from PIL import Image

import geofield as gf

use()
PICTURE = Path("../sample_data/field_1.tif")
POINT = {"lat": 35.075373, "lon": 33.531142}
out = Path(tempfile.mkdtemp()) / "out"

# %% [markdown]
# ## Stage 1: the picture

# %%
scene = gf.read_scene(PICTURE, **POINT)
print(scene.bands.shape, scene.roles, scene.grid.crs.name)
print(f"{scene.grid.ground_resolution_m:.3f} m per pixel on the ground")
print("source:", scene.source.name, "| licence:", scene.source.licence)

# %% [markdown]
# ## Stage 2: the outline
#
# The outline comes with a quality and with reasons for doubt. An outline that is not trusted is
# for a person to look at before anyone drives.

# %%
settings = gf.Settings(tracks={"spacing_m": 6.0})
field = gf.extract_field(scene, **POINT, **settings.field.model_dump())
print(f"{field.area_ha:.2f} ha, perimeter {field.perimeter_m:.0f} m, method {field.method}")
if field.quality is not None:
    print(f"quality {field.quality.score:.2f}, trusted: {field.quality.trusted}")
    for reason in field.quality.reasons:
        print(" -", reason)

# %% [markdown]
# ## Stage 3: obstacles
#
# A GeoDataFrame in the field's UTM zone, one row each. The geometry is the buffer: the crown grown
# by the safety margin.

# %%
obstacles = gf.detect_obstacles(scene, field)
print(len(obstacles), "obstacles")
print(obstacles[["obstacle_no", "status", "radius_m", "buffer_m", "lat", "lon"]].head().to_string())

# %% [markdown]
# ## Stage 4: tracks

# %%
tracks = gf.plan_tracks(field.polygon, obstacles, crs=field.crs, spacing_m=6.0, grid=scene.grid)
print(len(tracks.lines), "tracks in", len(tracks.segments), "segments")
print(f"{tracks.segments.length.sum() / 1000:.2f} km, heading {tracks.heading_deg:.1f} degrees")

# %%
figure, axis = plt.subplots(figsize=(6.5, 6.5))
show_scene(axis, scene)
axis.plot(*field.polygon.exterior.xy, color=COLOURS["field"], linewidth=1.6)
tracks.segments.plot(ax=axis, color=COLOURS["track"], linewidth=0.5)
obstacles.boundary.plot(ax=axis, color=COLOURS["obstacle"], linewidth=1.2)
plt.show()

# %% [markdown]
# ## All four at once, and the files

# %%
plan = gf.plan_field(PICTURE, **POINT, settings=settings)
files = plan.write(out)
for path in sorted(out.iterdir()):
    print(path.name + ("/" if path.is_dir() else ""))

# %% [markdown]
# `map.png` is the picture to look at first; `field.gpkg` is what QGIS opens, with styles and
# a project inside.

# %%
picture = Image.open(out / "map.png")
picture.thumbnail((760, 760))
figure, axis = plt.subplots(figsize=(7, 7 * picture.height / picture.width))
axis.imshow(picture)
axis.set_axis_off()
plt.show()

# %%
for name, geometry in pyogrio.list_layers(out / "field.gpkg"):
    print(f"{name:16} {geometry or ''}")

# %% [markdown]
# ## A person's word
#
# In QGIS you would set `status` to `rejected` in the attribute table and save. The same with
# geopandas: read the layer, change the row, write the layer back.

# %%
table = pyogrio.read_dataframe(out / "field.gpkg", layer="obstacles")
table.loc[table["obstacle_no"] == 1, "status"] = "rejected"
table.loc[table["obstacle_no"] == 2, "status"] = "confirmed"
pyogrio.write_dataframe(table, out / "field.gpkg", layer="obstacles", append=False)

edited = gf.read_plan(out / "field.gpkg")
again = gf.plan_field(PICTURE, **POINT, settings=settings, previous=edited)
print(again.obstacles["status"].value_counts().to_string())
before, after = plan.tracks.segments.length.sum(), again.tracks.segments.length.sum()
print(f"{before:.1f} m of track before, {after:.1f} m after")
assert sorted(again.obstacles["status"].unique()) == ["confirmed", "detected", "rejected"]
assert len(again.tracks.lines) == len(plan.tracks.lines)

# %% [markdown]
# The rejected one no longer stands in the way; the tracks keep their numbers.
