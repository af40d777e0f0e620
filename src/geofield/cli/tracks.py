"""``geofield tracks``: stage 4 alone, on a plan or on any polygons."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from geofield.cli.console import echo_json, say, say_note
from geofield.cli.field_notes import telling
from geofield.cli.files import (
    OLD_PATH,
    PATH,
    claim_file,
    claim_folder,
    output_option,
    tell_unsaved,
)
from geofield.cli.grouped import GroupedCommand
from geofield.cli.many_tracks import (
    Wanted,
    figures_of,
    file_name,
    line_of,
    of_many,
    parcels_in,
    tell_spacing,
)
from geofield.cli.options import (
    continued,
    defaults_option,
    name_option,
    stage_options,
    tell_idle,
)
from geofield.cli.refresh import say_outdated
from geofield.cli.standing import obstacles_for, obstacles_option, tell_obstacles, tell_unreached
from geofield.errors import FieldWarning, TrackError
from geofield.wording import counted

if TYPE_CHECKING:
    from geofield.farm.places import Place
    from geofield.farm.work import Job
    from geofield.plan import Plan
    from geofield.settings import Settings


@click.command(
    cls=GroupedCommand,
    epilog="""\b
Examples (the first two on the project's own sample):
  geofield tracks sample_data/field_1.gpkg --spacing 4 -o tracks.gpkg
  geofield tracks sample_data/field_1.gpkg --direction 45 --headland 8 --route shortest \\
      --turning-radius 4 -o route.gpkg
  geofield tracks parcels.shp --obstacles trees.shp --clearance 1 --spacing 3 -o farm.gpkg
  geofield tracks field.gpkg --obstacles poles.gpkg -o field.gpkg
  geofield tracks parcels.shp --spacing 3 --each -o plans/
""",
)
@click.argument("file", metavar="FILE", type=OLD_PATH)
@output_option(
    "GeoPackage to write, may be FILE of one field; for several fields another one with all of "
    "them, or a folder: a farm, as of `geofield batch`.",
    PATH,
)
@click.option("--each", is_flag=True, help="A GeoPackage for each of several fields, in a folder.")
@obstacles_option
@click.option("--crs", help="CRS of files that do not say theirs, e.g. EPSG:32633.")
@name_option
@defaults_option
@click.option("--fresh", is_flag=True, help="Forget which tracks you took away, changed or drew.")
@click.option("--overwrite", is_flag=True, help="Replace files that are there already.")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON on stdout.")
@stage_options("tracks", imagery=False)
def tracks(
    file: Path,
    output: Path,
    each: bool,
    obstacle_file: Path | None,
    crs: str | None,
    name: str | None,
    defaults: bool,
    fresh: bool,
    overwrite: bool,
    as_json: bool,
    settings: Settings,
) -> None:
    """Plan the tracks of one or many fields.

    FILE is a GeoPackage of geofield, whose field and obstacles count as they are now, with
    all that a person changed, and whose settings hold where you say nothing else (one of several
    fields keeps none); or any file of polygons (Shapefile, GeoJSON, GeoPackage, ...), each of
    which is a field. Their columns come along, and those named like settings (spacing_m,
    heading_deg, ...) hold for their field.
    """
    from geofield.farm.work import Job

    _claim(output, file, overwrite=overwrite)
    tell_unsaved(file.parent, (file.name,))
    notes: list[str] = []
    with telling(notes):
        plan = _own_plan(file, settings)
    if plan is not None and not defaults:
        settings = continued(settings, plan.settings, "tracks")
    places = None if plan is not None else parcels_in(file, settings, crs)
    several = places is not None and len(places) > 1
    obstacle_file = obstacles_for(places, obstacle_file)
    tell_spacing(places, settings)
    job = Job(settings, None, obstacle_file and obstacle_file.absolute(), crs)
    if places is None or not places.settings.num_columns:
        tell_idle(settings)  # a column could choose another way for its field
    tell_obstacles(job, several=several)
    if several and (name or fresh):
        told = "--name is one field's name" if name else "--fresh is of the plan of one field"
        raise click.UsageError(f"{told}: the file has several.")
    rows: list[dict[str, Any]]
    failed: dict[str, str] = {}
    if places is not None and several:
        wanted = Wanted(output, each=each, overwrite=overwrite, quiet=as_json)
        rows, failed = of_many(places, job, wanted)
    else:
        begun: Plan | Place
        if plan is not None:
            stem, begun = file.stem, plan
            begun = replace(plan, field=replace(plan.field, name=name)) if name else plan
        else:
            assert places is not None  # noqa: S101 - no plan, so there are places
            place = next(iter(places))
            stem = file_name(place.name)
            # Without an id of its own the field gets one by its shape.
            field_id = place.field_id if places.ids_given else ""
            begun = replace(place, name=name or place.name, field_id=field_id)
        target = output if output.suffix else output / f"{stem}.gpkg"
        rows = [_one(begun, job, target, file, notes, overwrite=overwrite, fresh=fresh)]
    if as_json:
        echo_json({"fields": rows, "failed": list(failed)})
    for row in () if as_json else rows:
        say(line_of(row))
        say_outdated(Path(row["file"]))
    if failed:
        for one, reason in failed.items():
            say(f"{one}: {reason}")
        raise TrackError(
            f"{len(failed)} of {counted(len(places or ()), 'field')} could not be planned: "
            f"{', '.join(list(failed)[:5])}{', ...' if len(failed) > 5 else ''}.",
            hint="The reasons are above; all other fields were written.",
        )


def _claim(output: Path, file: Path, *, overwrite: bool) -> None:
    """Claim the file or the folder that is written."""
    if output.suffix:
        claim_file(output, overwrite=overwrite, renewed=file)
    else:
        claim_folder(output)


def _own_plan(file: Path, settings: Settings) -> Plan | None:
    """The plan in a GeoPackage of geofield; None for any other file of polygons."""
    import pyogrio

    from geofield import schema
    from geofield.formats.foreign import layer_names
    from geofield.formats.gpkg_read import record_of
    from geofield.notes import warn
    from geofield.plan import read_plan
    from geofield.plan_files import tracks_unread
    from geofield.strangers import is_geopackage

    if not is_geopackage(file):
        return None
    record, layers, layer = record_of(file), layer_names(file), schema.FIELD.name
    if layer in layers:
        ids = pyogrio.read_dataframe(file, layer=layer, columns=["field_id"], read_geometry=False)
        # An outline cut into rows, or deleted, is a plan's that says what to do.
        if len(ids) != 1 and not (record and len(ids.drop_duplicates()) < 2):
            return None
    elif record is None:
        return None
    plan = read_plan(file)
    given = click.get_current_context().params
    if given["crs"] is not None and given["obstacle_file"] is None:
        say_note(f"--crs changes nothing: {file.name} says its own.")
    unread = tracks_unread(file)
    if unread is not None:
        said = settings.tracks.model_fields_set
        unsaid = plan.settings is None and said.isdisjoint(("spacing_m", "width_m", "machine"))
        spacing = (
            f" Its settings are lost, too: the spacing is {settings.tracks.spacing_m:g} m now, "
            "where --spacing says no other."
        )
        warn(
            f"{file.name} {unread}: its tracks are planned anew, whatever was changed of them."
            f"{spacing if unsaid else ''}",
            FieldWarning,
        )
    return plan


def _one(
    plan: Plan | Place,
    job: Job,
    target: Path,
    file: Path,
    notes: list[str],
    *,
    overwrite: bool,
    fresh: bool,
) -> dict[str, Any]:
    """Plan one field and write it; its figures."""
    from geofield.farm.work import plan_place
    from geofield.known import with_further
    from geofield.model.track_edits import TrackEdits
    from geofield.pipeline import run_tracks
    from geofield.plan import Plan
    from geofield.plan_files import save_plan

    inputs = [] if job.obstacles is None else [job.obstacles]
    with telling(notes):
        if not isinstance(plan, Plan):
            done, read_from = plan_place(plan, job), None
            inputs.append(file)
        else:
            if job.standing is not None:
                plan = with_further(plan, job.standing)
            if fresh:
                evidence = replace(plan.evidence, track_edits=TrackEdits())
                plan = replace(plan, tracks=None, evidence=evidence)
            done, read_from = run_tracks(plan, settings=job.settings), file
    tell_unreached(job, [[done.field.polygon_lonlat]])
    for change in done.changes:
        say(f"Changes: {change}")
    save_plan(done, target, read_from=read_from, overwrite=overwrite, inputs=inputs)
    return figures_of(done, target, notes)
