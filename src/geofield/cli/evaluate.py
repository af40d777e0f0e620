"""``geofield evaluate``: detected obstacles against a truth."""

from __future__ import annotations

import math
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from geofield.cli.console import echo_json, say, say_note
from geofield.cli.files import FILE, OLD_FILE
from geofield.cli.options import Number
from geofield.errors import ObstacleError
from geofield.wording import counted

if TYPE_CHECKING:
    import geopandas as gpd

    from geofield.evaluation import Evaluation

_USUAL = "obstacles"


@click.command(
    epilog="""\b
Examples (on the project's own sample):
  geofield run sample_data/field_1.tif --lat 35.075373 --lon 33.531142 --spacing 4 --out out/
  geofield evaluate out/field.gpkg sample_data/field_1.gpkg
  geofield evaluate out/field.gpkg sample_data/field_1.gpkg --distance 6 --driving \\
      --draw hits.png --scene out/scene.tif
"""
)
@click.argument("detected", type=OLD_FILE)
@click.argument("truth", type=OLD_FILE)
@click.option(
    "--distance",
    "distance_m",
    type=Number(min=0, min_open=True),
    default=6.0,
    show_default=True,
    help="Distance between centres within which a detection is a hit, metres.",
)
@click.option("--layer", default=_USUAL, show_default=True, help="Layer of DETECTED.")
@click.option(
    "--truth-layer", help="Layer of TRUTH; when not given `obstacles`, else its first one."
)
@click.option(
    "--driving",
    is_flag=True,
    help="Also what a driver loses: DETECTED is a plan with its field and tracks.",
)
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the bootstrap."
)
@click.option(
    "--draw", "picture", type=FILE, help="PNG to write: hits, misses and false detections."
)
@click.option("--scene", "scene_file", type=OLD_FILE, help="Picture to draw them on.")
@click.option("--overwrite", is_flag=True, help="Replace an existing drawing.")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON on stdout.")
def evaluate(
    detected: Path,
    truth: Path,
    distance_m: float,
    layer: str,
    truth_layer: str | None,
    driving: bool,
    seed: int,
    picture: Path | None,
    scene_file: Path | None,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Compare DETECTED obstacles with a TRUTH of points, boxes or polygons, which may be a CSV.

    TRUTH may be a plan that a person reviewed: what they rejected is no true obstacle. Matching is
    one to one. Prints precision, recall, F1 and the error of the radii with
    95 % intervals. With --driving also how many true obstacles the plan's tracks run through,
    within 2 m of their centres, what ground false ones cost, and how many the confidences say
    stand among those that are merely possible.
    """
    from geofield.evaluation import draw_matches, placed
    from geofield.evaluation import evaluate as compare
    from geofield.formats.raw_tables import CSV
    from geofield.imagery.write import replacing
    from geofield.plan import read_plan

    if picture is not None:
        _refuse_other_pictures(picture)
    elif scene_file is not None:
        say_note("--scene changes nothing without --draw, which names the picture to write.")
    inputs = [each for each in (detected, truth, scene_file) if each is not None]
    # Entered first: what may not be replaced is refused before the work.
    drawing = replacing(picture, overwrite=overwrite, inputs=inputs) if picture else nullcontext()
    with drawing as place:
        found = placed(_rows(detected, layer), detected.name, metric=True)
        true = _rows(truth, truth_layer)
        if true.crs is None and truth.suffix.lower() in CSV:
            say_note(f"{truth.name} does not say its CRS: x and y are taken as of {detected.name}.")
            true = true.set_crs(found.crs)
        true = placed(true, truth.name)
        options: dict[str, Any] = {"distance_m": distance_m, "seed": seed}
        if driving:
            plan = read_plan(detected)
            if plan.tracks is None:
                raise ObstacleError(
                    f"{detected.name} has no tracks.", hint="Plan them with geofield tracks first."
                )
            # Everything in the plan's own CRS, in which its tracks were planned.
            found, crs = found.to_crs(plan.field.crs), plan.field.crs
            options |= {"segments": plan.tracks.segments.to_crs(crs), "area": plan.field.polygon}
        result = compare(found, true, **options)
        if place is not None:
            draw_matches(found, true, result, place, scene_file, area=options.get("area"))
    score = result.pooled
    if picture is not None:
        say(f"Drawn to {picture}: hits green, missed blue, false red.")
    if as_json:
        figures = {"distance_m": distance_m, **score.as_dict(), "false_kinds": result.false_kinds}
        if result.driving is not None:
            figures["driving"] = result.driving.as_dict()
        echo_json(figures)
        return
    _tell(result)


def _rows(path: Path, layer: str | None) -> gpd.GeoDataFrame:
    """The rows of any vector file, or of a table with positions."""
    from geofield.evaluation import read_obstacles
    from geofield.formats.raw_tables import CSV
    from geofield.formats.registry import refuse_no_rows
    from geofield.formats.table_positions import read_table

    refuse_no_rows(path)
    if path.suffix.lower() in CSV:
        return read_table(path, None if layer == _USUAL else layer)
    return read_obstacles(path, layer)


def _tell(result: Evaluation) -> None:
    score = result.pooled
    hits, truth = counted(score.hits, "hit"), counted(score.truth, "true obstacle")
    say(f"{hits} of {score.detected} detected and {truth}")
    others = result.false_kinds.get("other", 0)
    if others:
        say(
            f"  {others} of {counted(score.detected - score.hits, 'false one')} of kind other: "
            "wrong only if TRUTH holds more than trees"
        )
    for name in ("precision", "recall", "f1", "radius_bias"):
        low, high = score.interval.get(name, (float("nan"), float("nan")))
        unit = " m" if name == "radius_bias" else ""
        label = name.replace("_", " ")
        if math.isnan(getattr(score, name)):
            say(f"  {label:12s} no figure: nothing to take it from")
            continue
        say(f"  {label:12s} {getattr(score, name):6.3f}{unit}  ({low:.3f} to {high:.3f})")
    lost = result.driving
    if lost is not None:
        say(
            f"{lost.driven_through} of {counted(lost.things, 'true obstacle')} driven through, "
            f"{lost.driven_through_m:.0f} of {lost.driven_m:.0f} m of track"
        )
        say(f"  ground lost      {lost.share_lost:6.1%}  ({lost.lost_m2:.0f} square metres)")
        say(f"  expected unseen  {lost.expected_unseen_per_ha:6.2f} per hectare")


def _refuse_other_pictures(picture: Path) -> None:
    from PIL import Image

    if picture.suffix.lower() not in Image.registered_extensions():
        raise click.BadParameter(
            f"{picture} is not the name of a picture: write NAME.png.", param_hint="--draw"
        )
