"""``geofield tracks``: stage 4 alone, on a plan or on any polygons."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from geofield.cli.console import echo_json, progress_bar, say
from geofield.cli.grouped import GroupedCommand
from geofield.cli.options import name_option, section_options, section_values, settings_option
from geofield.cli.refresh import say_outdated

if TYPE_CHECKING:
    from geofield.plan import Plan


@click.command(
    cls=GroupedCommand,
    epilog="""\b
Examples (the first two on the project's own sample):
  geofield tracks sample_data/field_1.gpkg --spacing 4 -o tracks.gpkg
  geofield tracks sample_data/field_1.gpkg --direction 45 --headland 8 --route shortest \\
      --turning-radius 4 -o route.gpkg
  geofield tracks parcels.shp --obstacles trees.shp --clearance 1 --spacing 3 -o plans/
""",
)
@click.argument("file", metavar="FILE", type=click.Path(exists=True, path_type=Path))
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(path_type=Path),
    help="GeoPackage to write, may be FILE; for several fields a folder, one file each.",
)
@click.option(
    "--obstacles",
    "obstacle_file",
    type=click.Path(exists=True, path_type=Path),
    help="File of what to avoid: polygons, points with a radius_m, lines.",
)
@click.option("--crs", help="CRS of files that do not say theirs, e.g. EPSG:32633.")
@name_option
@click.option("--overwrite", is_flag=True, help="Replace files that are there already.")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON on stdout.")
@settings_option
@section_options("tracks")
def tracks(
    file: Path,
    output: Path,
    obstacle_file: Path | None,
    crs: str | None,
    name: str | None,
    overwrite: bool,
    as_json: bool,
    settings_file: str | None,
    **options: Any,
) -> None:
    """Plan the tracks of one or many fields.

    FILE is a GeoPackage of geofield, whose field and obstacles count as they are now, with
    all that a person changed; or any file of polygons (Shapefile, GeoJSON, GeoPackage, ...),
    each of which is a field.
    """
    # Before the large imports: a typo is told at once.
    from geofield.settings import load_settings

    settings = load_settings(settings_file, section_values(options))
    from geofield.cli.claiming import claim_file, claim_folder
    from geofield.cli.polygon_files import obstacles_of, plans_of, with_obstacles
    from geofield.errors import GeofieldError, TrackError
    from geofield.pipeline import run_tracks
    from geofield.plan_files import save_plan

    (claim_file if output.suffix else claim_folder)(output)
    plans, is_plan = plans_of(file, crs=crs)
    standing = None if obstacle_file is None else obstacles_of(obstacle_file, crs=crs)
    several = len(plans) > 1
    if name:
        if several:
            raise click.UsageError("--name is one field's name: the file has several.")
        plans = [(stem, replace(one, field=replace(one.field, name=name))) for stem, one in plans]
    if several and output.suffix:
        raise TrackError(
            f"{file} holds {len(plans)} fields, and {output} is one file.",
            hint="Give a folder: -o plans/",
        )
    rows: list[dict[str, Any]] = []
    failed: list[str] = []
    with progress_bar(quiet=as_json) as progress:
        for done, (stem, begun) in enumerate(plans):
            progress(done, len(plans), stem)
            target = output / f"{stem}.gpkg" if several or not output.suffix else output
            try:
                plan = begun if standing is None else with_obstacles(begun, standing)
                plan = run_tracks(plan, settings=settings)
            except GeofieldError as error:
                if not several:
                    raise
                failed.append(stem)
                say(f"{stem}: {error.message} {error.hint or ''}")
                continue
            save_plan(plan, target, read_from=file if is_plan else None, overwrite=overwrite)
            rows.append(_row(plan, target))
            if not as_json:
                say(_line(rows[-1]))
                say_outdated(target)
    if as_json:
        echo_json({"fields": rows, "failed": failed})
    if failed:
        raise TrackError(
            f"{len(failed)} of {len(plans)} fields could not be planned: {', '.join(failed[:5])}"
            f"{', ...' if len(failed) > 5 else ''}.",
            hint="The reasons are above; all other fields were written.",
        )


def _row(plan: Plan, target: Path) -> dict[str, Any]:
    """Figures of one field, plain JSON values."""
    import math
    from dataclasses import asdict

    if plan.tracks is None:
        return {}
    figures = {
        name: None if isinstance(value, float) and math.isnan(value) else value
        for name, value in asdict(plan.tracks.statistics).items()
    }
    turns = plan.tracks.turns
    if turns is not None:
        figures |= {
            "turn_count": len(turns),
            "turn_length_m": float(turns["length_m"].sum()),
            "turns_that_do_not_fit": int((turns["fits"] == "no").sum()),
        }
    return {
        "field_id": plan.field.field_id,
        "name": plan.field.name,
        "file": str(target),
        "heading_deg": plan.tracks.heading_deg,
        "spacing_m": plan.tracks.spacing_m,
        "direction_why": plan.tracks.direction_why,
        **figures,
        "notes": list(plan.tracks.notes),
    }


def _line(row: dict[str, Any]) -> str:
    text = (
        f"{row['name']}: {row['track_count']} tracks, {row['segment_count']} segments, "
        f"{row['length_m']:.0f} m, heading {row['heading_deg']:.1f} degrees, "
        f"{row['coverage_percent']:.1f} % covered"
    )
    if "turn_count" in row:
        text += f", {row['turn_count']} turns ({row['turns_that_do_not_fit']} do not fit)"
    if row["direction_why"]:
        text += f" ({row['direction_why']})"
    return f"{text}; in {row['file']}"
