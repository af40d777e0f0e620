"""The verifier's tables: LightGBM's trees as JSON that can be read and compared."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import lightgbm as lgb
import numpy as np


def forest_table(model: lgb.Booster, names: tuple[str, ...]) -> dict[str, Any]:
    """Write LightGBM's trees as plain lists, thresholds between the features' steps."""
    used = sorted({i for i, gain in enumerate(model.feature_importance("gain")) if gain > 0})
    index = {old: new for new, old in enumerate(used)}
    trees = []
    for info in model.dump_model()["tree_info"]:
        nodes: list[list[float]] = []
        leaves: list[float] = []

        def walk(branch: dict[str, Any], nodes: Any = nodes, leaves: Any = leaves) -> int:
            if "leaf_value" in branch:
                leaves.append(round(branch["leaf_value"], 5))
                return -len(leaves)
            here = len(nodes)
            nodes.append([index[branch["split_feature"]], halfway(branch["threshold"]), 0, 0])
            nodes[here][2] = walk(branch["left_child"])
            nodes[here][3] = walk(branch["right_child"])
            return here

        walk(info["tree_structure"])
        trees.append({"nodes": nodes, "leaves": leaves})
    return {"features": [names[i] for i in used], "trees": trees}


def halfway(threshold: float) -> float:
    """Return the middle between the two steps of a feature that a threshold parts.

    LightGBM's thresholds may lie on a step, or a hair from zero, where rounding would tip them.
    """
    step = round(threshold * 1000)
    if float(np.float32(step / 1000)) > threshold:
        step -= 1
    return round(step / 1000 + 0.0005, 4)


def write(table: dict[str, Any], path: Path) -> None:
    """One tree per line, so that the table can be read and compared."""
    text = json.dumps(table).replace('{"nodes"', '\n{"nodes"').replace('], "', '],\n"')
    path.parent.mkdir(exist_ok=True)
    path.write_text(text + "\n", encoding="utf-8")
    json.loads(path.read_text(encoding="utf-8"))
    print(f"  {path.name}: {path.stat().st_size / 1024:.0f} KiB")
