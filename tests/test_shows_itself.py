"""What a user of Python sees of a value: its repr, its card in a notebook, its plot."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest

import geofield as gf

mpl.use("agg")
SAMPLE = Path(__file__).resolve().parents[1] / "sample_data" / "field_1.tif"
POINT: dict[str, Any] = {"lat": 35.075373, "lon": 33.531142}


@pytest.fixture(scope="module")
def plan() -> gf.Plan:
    return gf.plan_field(SAMPLE, **POINT, settings=gf.Settings(tracks={"spacing_m": 6.0}))


def test_every_value_fits_five_lines(plan: gf.Plan) -> None:
    assert plan.scene is not None
    assert plan.tracks is not None
    for value in (plan, plan.field, plan.tracks, plan.scene, plan.scene.grid):
        lines = repr(value).splitlines()
        assert len(lines) <= 5, lines
        assert all(len(line) <= 100 for line in lines), lines
    assert f"{plan.field.area_ha:.2f} ha" in repr(plan)
    assert f"{len(plan.tracks.lines)} of" in repr(plan)
    assert "EPSG:32636" in repr(plan.scene)


def test_cards_in_a_notebook_hold_map_and_figures(plan: gf.Plan) -> None:
    assert plan.tracks is not None
    assert plan.obstacles is not None
    for value, paths in ((plan, 3), (plan.field, 1), (plan.tracks, 2)):
        text = value._repr_html_()
        assert text.count("<path") == paths
        assert "<script" not in text
        assert len(text) < 60_000
    drawn = re.findall(r"<path d='([^']*)'", plan._repr_html_())
    assert drawn[1].count("M") == len(plan.tracks.segments)
    assert drawn[2].count("M") == len(plan.obstacles)


def test_a_name_is_only_a_name(plan: gf.Plan) -> None:
    from dataclasses import replace

    field = replace(plan.field, name="<script>alert(1)</script>")
    assert "<script" not in field._repr_html_()


def test_the_plot_lies_where_the_plan_lies(plan: gf.Plan, tmp_path: Path) -> None:
    axes = plan.plot()
    left, bottom, right, top = plan.field.polygon.bounds
    assert axes.get_xlim()[0] <= left < right <= axes.get_xlim()[1]
    assert axes.get_ylim()[0] <= bottom < top <= axes.get_ylim()[1]
    picture = axes.get_images()[0]
    assert picture.get_extent()[0] == pytest.approx(plan.grid.transform.c)
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert "tracks" in labels
    assert any("detected" in label for label in labels)
    axes.get_figure(root=True).savefig(tmp_path / "plan.png", dpi=60)
    assert plan.plot(axes) is axes
