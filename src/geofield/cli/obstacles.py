"""``geofield obstacles``: stage 3 alone."""

from __future__ import annotations

from pathlib import Path

import click

from geofield.cli.console import echo_json, say
from geofield.cli.files import OLD_FILE, claim_plan, output_option
from geofield.cli.grouped import GroupedCommand
from geofield.cli.options import continued, defaults_option, stage_options, tell_idle
from geofield.cli.refresh import say_outdated, say_removed
from geofield.settings import Settings
from geofield.wording import counted


@click.command(
    cls=GroupedCommand,
    epilog="""\b
Examples (on the project's own sample):
  geofield field sample_data/field_1.tif --lat 35.075373 --lon 33.531142 -o field.gpkg
  geofield obstacles sample_data/field_1.tif field.gpkg -o field.gpkg
""",
)
@click.argument("imagery", type=click.Path(path_type=str))
@click.argument("plan_file", metavar="FIELD.gpkg", type=OLD_FILE)
@output_option("GeoPackage to write; may be the one that was read.")
@defaults_option
@click.option("--overwrite", is_flag=True, help="Replace another file than the one that was read.")
@click.option("--json", "as_json", is_flag=True, help="Print what was found as JSON on stdout.")
@stage_options("obstacles")
def obstacles(
    imagery: str,
    plan_file: Path,
    output: Path,
    defaults: bool,
    overwrite: bool,
    as_json: bool,
    settings: Settings,
) -> None:
    """Find the obstacles in a field.

    IMAGERY is the picture that the field was found in. Rows that a person confirmed,
    rejected or drew in FIELD.gpkg stay as they are; the settings that it was made with hold where
    you say nothing else. The tracks are removed, for they no longer fit: run `geofield tracks`
    next.
    """
    from geofield.pipeline import run_obstacles
    from geofield.plan import read_plan
    from geofield.plan_files import save_plan
    from geofield.windows import scene_of_plan

    if imagery.lower().endswith(".gpkg") and plan_file.suffix.lower() != ".gpkg":
        raise click.UsageError("The picture comes first: geofield obstacles IMAGERY FIELD.gpkg.")
    claim_plan(output, overwrite=overwrite, inputs=[imagery], renewed=plan_file)
    plan = read_plan(plan_file)
    if not defaults:
        settings = continued(settings, plan.settings, "obstacles")
    tell_idle(settings)
    before = plan
    plan = run_obstacles(plan, scene_of_plan(imagery, plan, settings), settings=settings)
    save_plan(plan, output, read_from=plan_file, overwrite=overwrite, inputs=[imagery])
    table = plan.obstacles
    if table is None:
        return
    if as_json:
        echo_json(
            {
                "file": str(output),
                "detection": dict(plan.evidence.detection),
                "obstacles": table.drop(columns="geometry").to_dict("records"),
            }
        )
        return
    counts = table["status"].value_counts().sort_index()
    parts = ", ".join(f"{count} {status}" for status, count in counts.items()) or "none found"
    say(f"{counted(len(table), 'obstacle')} ({parts}) in {output}")
    for change in plan.changes:
        say(f"Changes: {change}")
    say_removed(before, plan, output)
    say_outdated(output)
