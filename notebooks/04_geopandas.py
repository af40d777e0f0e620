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
# # 04 Analysis with geopandas
#
# Every table of a plan is a GeoDataFrame in the field's UTM zone, so questions about a field are a
# few lines each: what area is worked, what does each tree cost, which spacing and which heading
# suit the field. The field and its trees are the sample's truth, so no detection is involved.

# %%
import geopandas as gpd
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from look import COLOURS, side_by_side, use

import geofield as gf

use()
field = gpd.read_file("../sample_data/field_2.gpkg", layer="field")
trees = gpd.read_file("../sample_data/field_2.gpkg", layer="obstacles")
polygon, crs = field.geometry.iloc[0], field.crs
print(f"{crs.name}: {polygon.area / 1e4:.2f} ha, {len(trees)} trees")

# %% [markdown]
# ## Worked area
#
# Each segment works a strip as wide as the spacing. `statistics` has the sums; the strips
# themselves are a buffer away.

# %%
tracks = gf.plan_tracks(polygon, trees, crs=crs, spacing_m=6.0, clearance_m=1.0)
figures = tracks.statistics
print(f"{figures.track_count} tracks, {figures.segment_count} segments, {figures.length_m:.0f} m")
print(
    f"worked {figures.worked_ha:.2f} of {figures.area_ha:.2f} ha: {figures.coverage_percent:.1f} %"
)

strips = tracks.segments.buffer(tracks.spacing_m / 2, cap_style="flat")
missed = polygon.difference(strips.union_all())
figure, axis = plt.subplots(figsize=(6, 5))
strips.plot(ax=axis, color="#dceef8", edgecolor="#9ecae1", linewidth=0.3)
gpd.GeoSeries([missed], crs=crs).plot(ax=axis, color=COLOURS["wrong"])
trees.plot(ax=axis, color=COLOURS["ours"])
gpd.GeoSeries([polygon.exterior], crs=crs).plot(ax=axis, color="black", linewidth=1)
axis.set_title(f"not worked: {missed.area / 1e4:.2f} ha (red)")
axis.set_axis_off()
plt.show()

# %% [markdown]
# ## What each tree costs
#
# The planner shares the lost length among the obstacles that cause it. A join with the table of
# obstacles gives the cost per tree.

# %%
losses = pd.DataFrame([(loss.obstacle_no, loss.length_m) for loss in figures.losses])
losses.columns = ["obstacle_no", "lost_m"]
cost = trees.merge(losses, on="obstacle_no")
cost["lost_m2"] = cost["lost_m"] * tracks.spacing_m
print(
    cost[["obstacle_no", "radius_m", "lost_m", "lost_m2"]]
    .nlargest(5, "lost_m")
    .round(1)
    .to_string(index=False)
)
print(
    f"together {cost['lost_m'].sum():.0f} m, that is "
    f"{100 * cost['lost_m'].sum() / (figures.length_m + cost['lost_m'].sum()):.1f} % of all track"
)

# %% [markdown]
# ## Comparing spacings

# %%
rows = []
for spacing_m in (2, 3, 4, 6, 8, 12, 18, 24):
    one = gf.plan_tracks(polygon, trees, crs=crs, spacing_m=spacing_m, clearance_m=1.0).statistics
    rows.append((spacing_m, one.track_count, one.segment_count, one.length_m, one.coverage_percent))
table = pd.DataFrame(rows, columns=["spacing_m", "tracks", "segments", "length_m", "worked %"])
print(table.round(1).to_string(index=False))

# %% [markdown]
# ## Comparing headings
#
# Fewer tracks mean fewer turns. Every heading in steps of two degrees, against the two choices
# that the planner makes by itself: along the longest edge, and the heading with the fewest tracks.

# %%
headings = np.arange(0, 180, 2.0)
counts = [
    gf.plan_tracks(polygon, trees, crs=crs, spacing_m=6.0, direction=float(heading))
    for heading in headings
]
number = np.array([len(one.lines) for one in counts])
pieces = np.array([len(one.segments) for one in counts])
chosen = {
    name: gf.plan_tracks(polygon, trees, crs=crs, spacing_m=6.0, direction=name)
    for name in ("longest_edge", "fewest")
}
figure, axes = side_by_side(2, height=2.8)
axes[0, 0].plot(headings, number, color=COLOURS["correct"])
axes[0, 0].set(xlabel="heading, degrees", title="tracks")
axes[0, 1].plot(headings, pieces, color=COLOURS["ours"])
axes[0, 1].set(xlabel="heading, degrees", title="segments")
for name, one in chosen.items():
    axes[0, 0].plot(one.heading_deg, len(one.lines), "o", label=name)
    axes[0, 1].plot(one.heading_deg, len(one.segments), "o", label=name)
    print(f"{name:13} heading {one.heading_deg:6.1f}: {len(one.lines)} tracks")
axes[0, 0].legend(fontsize=7)
plt.show()
assert len(chosen["fewest"].lines) <= number.min()
