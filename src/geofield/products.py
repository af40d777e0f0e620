"""The products of a run: formats, picture, map and report, written all or nothing."""

from __future__ import annotations

import json
import math
import platform
import shutil
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import asdict, replace
from importlib import metadata
from pathlib import Path
from types import MappingProxyType
from typing import Any

from geofield import __version__, schema
from geofield.crs import authority_name
from geofield.errors import FormatError
from geofield.formats import format_named, write_dataset
from geofield.formats.export import dropped
from geofield.formats.gpkg_guests import replace_plan
from geofield.model.dataset import Dataset
from geofield.model.scene import Scene
from geofield.staging import staged_folder

PLAN_FILE = "field.gpkg"
SCENE_FILE = "scene.tif"
MAP_FILE = "map.png"
REPORT_FILE = "report.json"


def write_products(
    dataset: Dataset,
    scene: Scene | None,
    folder: Path,
    *,
    formats: Sequence[str],
    overwrite: bool = False,
    options: Mapping[str, Any] | None = None,
    timings_s: Mapping[str, float] | None = None,
    inputs: Sequence[str | Path] = (),
    changes: Sequence[str] = (),
) -> list[Path]:
    """Write a dataset and its picture into a folder; the files in the order written.

    The scene becomes ``scene.tif`` and is drawn below the map. `timings_s` (seconds per stage) and
    `changes` (of an earlier plan) are for the report; `options` are by format; `inputs` were read
    and are never replaced.
    """
    asked = [name for name in formats if not format_named(name).automatic]
    products = [format_named(name).places(folder) for name in asked]
    with (
        staged_folder(folder, overwrite=overwrite, inputs=inputs, products=products) as staging,
        ThreadPoolExecutor(max_workers=1) as beside,
    ):
        written: list[Path] = []
        shown = {"scene": scene}
        if scene is not None:
            written += write_scene(dataset, staging, stem="", options=shown)
            dataset = replace(dataset, scene_path=written[0])
        # Compressing the map takes as long as several formats, and holds no lock.
        # Whoever listens here hears what it tells.
        drawn = beside.submit(
            copy_context().run, write_map, dataset, staging, stem="", options=shown
        )
        # What a format leaves out stands in the report: the GeoPackage beside it has all.
        told = "gpkg" in asked
        written += write_dataset(
            dataset, staging, asked, overwrite=True, options=options, tell_drops=not told
        )
        if "gpkg" in asked:
            replace_plan(folder / PLAN_FILE, staging / PLAN_FILE)
        written += drawn.result()
        facts = {"timings_s": timings_s or {}, "formats": asked, "changes": changes}
        written += write_report(dataset, staging, stem="", options=facts)
        written = [path for path in written if path.is_file()]
    return [folder / path.relative_to(staging) for path in written]


def write_scene(
    dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]
) -> list[Path]:
    """Write ``scene.tif``: the picture at hand (option ``scene``), else that beside the plan."""
    path = folder / SCENE_FILE
    if options.get("scene") is not None:
        from geofield.imagery import write_scene as write_picture

        write_picture(options["scene"], path)
    elif dataset.scene_path is not None:
        shutil.copyfile(dataset.scene_path, path)
    else:
        raise FormatError(
            "There is no picture beside this plan.", hint="Keep scene.tif beside field.gpkg."
        )
    return [path]


def write_map(
    dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]
) -> list[Path]:
    """Draw ``map.png``, on the picture at hand or beside the plan where there is one."""
    from geofield.mapping import draw_map

    if not dataset.has(schema.FIELD.name):
        raise FormatError("A map needs one field; there are 0.")
    scene = options.get("scene")
    if scene is None and dataset.scene_path is not None:
        from geofield.imagery import read_scene

        scene = read_scene(dataset.scene_path)
    path = folder / MAP_FILE
    # A third of the time of the usual level for an eighth more bytes.
    draw_map(dataset, scene).save(path, compress_level=2)
    return [path]


def write_report(
    dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]
) -> list[Path]:
    """Write ``report.json``; ``timings_s``, ``formats`` and ``changes`` are those of the run."""
    if not dataset.has(schema.FIELD.name):
        raise FormatError("A report needs one field; there are 0.")
    facts = {key: options[key] for key in ("timings_s", "formats", "changes") if key in options}
    report = make_report(dataset, **facts)
    text = json.dumps(report, indent=2, ensure_ascii=False, allow_nan=False)
    path = folder / REPORT_FILE
    path.write_text(text + "\n", encoding="utf-8", newline="\n")
    return [path]


def make_report(
    dataset: Dataset,
    timings_s: Mapping[str, float] = MappingProxyType({}),
    formats: Sequence[str] = (),
    changes: Sequence[str] = (),
) -> dict[str, Any]:
    """Counts, lengths, areas, timings, settings, versions and terms, as plain JSON values."""
    from geofield.evaluation.driving import unseen

    field = dataset.table(schema.FIELD.name).iloc[0]
    obstacles, tracks = dataset.table("obstacles"), dataset.table("tracks")
    segments, gaps = dataset.table("segments"), dataset.table("gaps")
    status = obstacles["status"].value_counts().sort_index()
    provenance = dataset.provenance
    area_ha = float(field["area_ha"])
    return {
        "field": {
            "field_id": field["field_id"],
            "name": field["name"],
            "crs": authority_name(dataset.crs),
            "area_ha": _rounded(area_ha, 4),
            "perimeter_m": _rounded(field["perimeter_m"], 2),
            "longest_edge_m": _rounded(field["longest_edge_m"], 2),
            "heading_deg": _rounded(round(float(field["heading_deg"]), 3) % 180.0, 3),
            "method": field["method"],
            "certainty": _rounded(field["certainty"], 4),
            "doubts": _parts(field["doubts"]),
        },
        "obstacles": {
            "count": len(obstacles),
            **{str(k): int(v) for k, v in status.items()},
            "expected_unseen_per_ha": _rounded(unseen(obstacles, field.geometry) / area_ha, 3),
        },
        "tracks": {
            "tracks": len(tracks),
            "segments": len(segments),
            "gaps": len(gaps),
            "points": int(tracks["point_count"].sum()),
            "length_m": _rounded(segments["length_m"].sum(), 3),
            **_turns(dataset),
        },
        "changes": list(changes),
        "formats": {name: {"leaves_out": dropped(dataset, format_named(name))} for name in formats},
        # The rows of the obstacles' record are in the GeoPackage, for geofield alone.
        "evidence": {k: v for k, v in provenance.evidence.items() if k != "written"},
        "source": asdict(provenance.source),
        "picture": _picture(dataset),
        "settings": dict(provenance.settings),
        "timings_s": {stage: round(seconds, 3) for stage, seconds in timings_s.items()},
        "versions": versions(),
    }


def _picture(dataset: Dataset) -> dict[str, list[str]]:
    """What the bands of the picture show and what was done to it, by its own word."""
    if dataset.scene_path is None or not dataset.scene_path.is_file():
        return {}
    from geofield.imagery import picture_facts

    return picture_facts(dataset.scene_path)


def _turns(dataset: Dataset) -> dict[str, float]:
    """How many turns there are, how many the machine cannot drive, what they leave unworked."""
    if "turns" not in dataset.tables:
        return {}
    turns = dataset.table("turns")
    return {
        "turns": len(turns),
        "turns_that_do_not_fit": int((turns["fits"] == "no").sum()),
        "unworked_at_turns_m": round(float(turns["skipped_m"].sum()), 1),
    }


def _parts(doubts: Any) -> list[str]:
    return doubts.split("; ") if isinstance(doubts, str) and doubts else []


def versions() -> dict[str, str]:
    """Versions of the software and of the libraries that the figures depend on."""
    found = {"python": platform.python_version()}
    for name in ("geofield", "numpy", "scipy", "scikit-image", "shapely", "pyproj", "rasterio"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = __version__ if name == "geofield" else "unknown"
    return found


def _rounded(value: Any, digits: int) -> float | None:
    number = float(value)
    return round(number, digits) if math.isfinite(number) else None
