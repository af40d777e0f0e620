"""``geofield field``: stage 2 alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from geofield.cli.console import echo_json, progress_bar, say
from geofield.cli.files import FILE, FOLDER, claim_plan
from geofield.cli.grouped import GroupedCommand
from geofield.cli.options import (
    acknowledge_option,
    name_option,
    point_or_parcel_options,
    stage_options,
    tell_idle,
)
from geofield.cli.parcels import boundary_options, parcel_and_point
from geofield.cli.refresh import say_outdated, say_removed
from geofield.settings import as_before, with_values
from geofield.wording import counted

if TYPE_CHECKING:
    from geofield.model import Field, Scene
    from geofield.plan import Plan
    from geofield.settings import Settings


@click.command(
    cls=GroupedCommand,
    epilog="""\b
Examples (on the project's own sample):
  geofield field sample_data/field_1.tif --lat 35.075373 --lon 33.531142 -o field.gpkg
  geofield field sample_data/field_1.tif --lat 35.075373 --lon 33.531142 --list
  geofield field sample_data/field_1.tif --lat 35.075373 --lon 33.531142 \\
      --region 2 --region 3 -o regions.gpkg
  geofield field sample_data/field_1.tif --lat 35.075373 --lon 33.531142 \\
      --include-lonlat 33.5305,35.0753 --exclude-lonlat 33.5325,35.0743 \\
      --alternatives -o field.gpkg --overwrite
""",
)
@click.argument("imagery", type=click.Path(path_type=str))
@point_or_parcel_options
@click.option(
    "-o",
    "--output",
    type=FILE,
    help="GeoPackage to write; an outline that a person drew in it is kept.",
)
@click.option(
    "--overwrite",
    is_flag=True,
    help="Replace the output where it exists; an outline drawn by hand is kept.",
)
@click.option("--fresh", is_flag=True, help="With --overwrite: forget what a person edited there.")
@click.option(
    "--list",
    "list_regions",
    is_flag=True,
    help="Show the study's numbered regions instead of extracting; draws them with --pictures.",
)
@click.option(
    "--region",
    "regions",
    type=int,
    multiple=True,
    help="Take this numbered region of the study's method; repeat to join several.",
)
@click.option(
    "--pictures",
    type=FOLDER,
    help="Folder for the study's pictures: grey, binary, numbered regions, reconstruction.",
)
@click.option(
    "--alternatives",
    is_flag=True,
    help="Show the most likely different outlines; the file's layer alternatives has them.",
)
@click.option(
    "--choose",
    type=click.IntRange(1, 3),
    help="Take this outline of the alternatives: your word, kept on every later run.",
)
@acknowledge_option
@name_option
@boundary_options
@click.option("--json", "as_json", is_flag=True, help="Print what was found as JSON on stdout.")
@stage_options("imagery", "field")
def field(
    imagery: str,
    lat: float | None,
    lon: float | None,
    output: Path | None,
    overwrite: bool,
    fresh: bool,
    list_regions: bool,
    regions: tuple[int, ...],
    pictures: Path | None,
    alternatives: bool,
    choose: int | None,
    acknowledge_terms: bool,
    name: str | None,
    boundary: Path | None,
    boundary_layer: str | None,
    boundary_name: str | None,
    as_json: bool,
    settings: Settings,
) -> None:
    """Find the outline of the field around a point.

    IMAGERY is a picture or any other source that `geofield tiles` takes. Where the outline
    touches the window's edge, the window grows as far as the picture reaches.
    """
    from geofield.cli.imagery_tools import imagery_of, say_wider
    from geofield.earlier import holds, known_outline
    from geofield.pipeline import run_field
    from geofield.plan import read_plan
    from geofield.plan_files import save_plan
    from geofield.windows import open_scene, showing

    _refuse_at_odds(click.get_current_context().params)
    parcel, lat, lon = parcel_and_point(boundary, boundary_layer, boundary_name, lat, lon)
    chosen = with_values(settings, method="study") if regions else settings
    tell_idle(chosen, parcel=parcel is not None)
    previous = None
    if output is not None:
        claim_plan(output, overwrite=overwrite)
        if output.is_file():
            previous = None if fresh else read_plan(output)
    seen = showing(settings, lat, lon, known_outline(parcel, previous, lat, lon))
    source = imagery_of(imagery, seen, (lon, lat), acknowledged=acknowledge_terms)
    with (
        progress_bar(quiet=as_json) as progress,
        source.at(lat, lon, seen.imagery, progress) as picture,
    ):
        if list_regions or regions or pictures is not None:
            scene = open_scene(picture.path, lat, lon, settings)
            _study(scene, lat, lon, regions, pictures, tell=list_regions, as_json=as_json)
        if output is None:
            return
        plan = run_field(
            picture.path, lat=lat, lon=lon, settings=settings, previous=previous,
            regions=regions, boundary=parcel, choose=choose, name=name, fetch_wider=picture.wider,
        )  # fmt: skip
    if previous is not None and holds(previous, lat=lat, lon=lon):
        # The stages behind this one go on as the plan was made.
        made = as_before(plan.settings or settings, previous.settings, "obstacles")
        plan = replace(plan, settings=as_before(made, previous.settings, "tracks"))
    inputs = [each for each in (imagery, boundary) if each is not None]
    read_from = output if previous else None
    save_plan(plan, output, read_from=read_from, overwrite=overwrite, inputs=inputs)
    if as_json:
        echo_json(_figures(plan, output))
    else:
        _say(plan, output, alternatives=alternatives)
        say_removed(previous, plan, output)
        say_wider(plan, picture)


def _refuse_at_odds(given: Mapping[str, Any]) -> None:
    """Refuse options that ask for two outlines at once, or for none."""
    listing, regions, choose = given["list_regions"], given["regions"], given["choose"]
    if given["boundary"] is not None and (regions or listing or choose):
        raise click.UsageError(
            "--boundary takes a parcel as it is: leave --list, --region and --choose out."
        )
    if listing and (given["output"] is not None or choose):
        raise click.UsageError(
            "--list shows the regions and writes no outline: leave -o and --choose out, or --list."
        )
    if regions and (choose or given["field__include"] or given["field__exclude"]):
        raise click.UsageError(
            "--region takes the study's regions as they are: leave --choose, --include-lonlat and "
            "--exclude-lonlat out, or --region."
        )
    if not listing and given["output"] is None:
        raise click.UsageError("Name the GeoPackage to write with -o, or ask for --list.")


def _figures(plan: Plan, output: Path) -> dict[str, Any]:
    """What was found, plain JSON values."""
    found = plan.field
    return {
        "file": str(output),
        "field_id": found.field_id,
        "name": found.name,
        "method": found.method,
        "area_ha": found.area_ha,
        "perimeter_m": found.perimeter_m,
        "vertices": len(found.polygon.exterior.coords) - 1,
        "holes": len(found.polygon.interiors),
        "crs": found.crs.to_string(),
        "alternatives": [
            {"area_ha": area_ha, "certainty": certain} for area_ha, certain in _alternatives(found)
        ],
        "evidence": plan.to_dataset().provenance.evidence.get("field", {}),
    }


def _say(plan: Plan, output: Path, *, alternatives: bool) -> None:
    found = plan.field
    say(
        f"Field      {found.area_ha:.2f} ha, perimeter {found.perimeter_m:.0f} m, "
        f"{len(found.polygon.exterior.coords) - 1} corners ({found.method})"
    )
    if found.quality is not None:
        certain = found.certainty
        say(f"Trust      {'not measured' if certain is None else f'{certain:.0%}'}")
        for reason in found.quality.reasons:
            say(f"           {reason}")
    if alternatives and not found.alternatives:
        say("Others     none: only method auto offers alternatives")
    for number, (area_ha, certain) in enumerate(_alternatives(found) if alternatives else (), 1):
        say(f"Outline {number}  {area_ha:.2f} ha, certainty {certain:.0%}")
    if alternatives and len(found.alternatives) == 1:
        say("Others     none is likely: say more with --include-lonlat, --exclude-lonlat")
    for change in plan.changes:
        say(f"Changes    {change}")
    say(f"File       {output}")
    say_outdated(output)


def _alternatives(field: Field) -> list[tuple[float, float]]:
    """Area on the ground, hectares, and certainty of each outline that may be meant."""
    from geofield.crs import ground_areas_m2

    areas_m2 = ground_areas_m2([one.polygon for one in field.alternatives], field.crs)
    sure = [one.certainty for one in field.alternatives]
    return [(float(area) / 1e4, each) for area, each in zip(areas_m2, sure, strict=True)]


def _study(
    scene: Scene,
    lat: float,
    lon: float,
    regions: tuple[int, ...],
    folder: Path | None,
    *,
    tell: bool,
    as_json: bool,
) -> None:
    """Print and draw the study's numbered regions."""
    from geofield.model.upright import upright
    from geofield.study.threshold import study_pictures

    # Numbers are those of `extract_field`, which sees every picture so.
    scene = upright(scene)
    study = study_pictures(scene.grey, scene.valid)
    here = study.region_at(*scene.pixel_of(lat=lat, lon=lon))
    square_m = scene.grid.ground_resolution_m**2
    # Specks are numbered, too, but no list is read that shows thousands of them.
    shown = [i for i, count in enumerate(study.counts, 1) if count * square_m >= 100.0 or i == here]
    rows = [
        {
            "region": number,
            "pixels": int(study.counts[number - 1]),
            "area_ha": round(float(study.counts[number - 1]) * square_m / 1e4, 4),
            "at_point": number == here,
        }
        for number in shown
    ]
    if tell and as_json:
        echo_json({"threshold": study.threshold, "regions": rows})
    elif tell:
        click.echo("region    pixels   area_ha")
        for row in rows:
            mark = "  <- the point" if row["at_point"] else ""
            click.echo(f"{row['region']:6d} {row['pixels']:9d} {row['area_ha']:9.3f}{mark}")
        say(f"{counted(len(study.counts), 'region')}, {len(rows)} of them of at least 100 m2")
    if folder is not None:
        from geofield.study.pictures import draw_study

        folder.mkdir(parents=True, exist_ok=True)
        for name, image in draw_study(study, regions or (here,), shown).items():
            image.save(folder / f"{name}.png")
            say(f"Picture    {folder / name}.png")
