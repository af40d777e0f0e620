"""Where the plugin and the sample are."""

from __future__ import annotations

from pathlib import Path

CLIENT = Path(__file__).with_name("client.py")
ROOT = Path(__file__).parents[2]
PLUGINS = ROOT / "plugin"
SAMPLE = ROOT / "sample_data" / "field_1.tif"
POINT = "33.531142,35.075373 [EPSG:4326]"
