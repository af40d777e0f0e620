"""``geofield run``: the main job."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from geofield.cli.console import echo_json, progress_bar, say, say_note
from geofield.cli.files import FOLDER, claim_folder
from geofield.cli.grouped import GroupedCommand
from geofield.cli.options import (
    acknowledge_option,
    name_option,
    point_or_parcel_options,
    stage_options,
    tell_idle,
)
from geofield.cli.parcels import boundary_options, parcel_and_point
from geofield.cli.refresh import say_outdated
from geofield.cli.standing import obstacles_option, tell_obstacles, tell_unreached
from geofield.errors import OutputExistsError
from geofield.wording import counted

if TYPE_CHECKING:
    from geofield.model import Tracks
    from geofield.plan import Plan
    from geofield.settings import Settings


@click.command(
    cls=GroupedCommand,
    epilog="""\b
Examples (the first three on the project's own sample):
  geofield run sample_data/field_1.tif --lat 35.075373 --lon 33.531142 --spacing 4 --out out/
  geofield run sample_data/field_1.tif --lat 35.075373 --lon 33.531142 --out out/ \\
      --buffer 2 --format gpkg --format geojson --overwrite
  geofield run sample_data/field_1.tif --out own/ \\
      --boundary sample_data/field_1.gpkg --boundary-layer field
  geofield run ortho.tif --lat 35.075373 --lon 33.531142 --obstacles poles.gpkg --out out/
""",
)
@click.argument("imagery", type=click.Path(path_type=str))
@point_or_parcel_options
@click.option(
    "--out",
    required=True,
    type=FOLDER,
    help="Folder for the products; made when it does not exist.",
)
@click.option(
    "--overwrite",
    is_flag=True,
    help="Replace earlier products there; reviewed obstacles and a moved outline are kept.",
)
@obstacles_option
@click.option("--fresh", is_flag=True, help="With --overwrite: forget what a person edited there.")
@acknowledge_option
@name_option
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON on stdout.")
@boundary_options
@stage_options("imagery", "field", "obstacles", "tracks")
@click.option(
    "--format", "export__formats", multiple=True, help="Format to write; repeat for several."
)
@click.option(
    "--points",
    "export__points",
    is_flag=True,
    default=None,
    help="Track points in linked data, too: most of its bytes.",
)
def run(
    imagery: str,
    lat: float | None,
    lon: float | None,
    out: Path,
    overwrite: bool,
    obstacle_file: Path | None,
    fresh: bool,
    acknowledge_terms: bool,
    name: str | None,
    boundary: Path | None,
    boundary_layer: str | None,
    boundary_name: str | None,
    as_json: bool,
    settings: Settings,
) -> None:
    """From a picture and a point in a field, or its boundary, to outline, obstacles and tracks.

    IMAGERY is a GeoTIFF, a folder of them, or any other source that `geofield tiles` takes.
    Written are the picture used (scene.tif), field.gpkg with a QGIS project, GeoJSON,
    Shapefiles, RDF, a map picture and report.json.
    """
    from geofield.cli.imagery_tools import imagery_of, say_wider
    from geofield.earlier import known_outline, no_longer_said, with_said_tracks
    from geofield.farm.work import Job
    from geofield.formats import format_named
    from geofield.pipeline import plan_field
    from geofield.plan import read_plan
    from geofield.windows import showing

    parcel, lat, lon = parcel_and_point(boundary, boundary_layer, boundary_name, lat, lon)
    # What cannot be is said at once, not after the work.
    for each in settings.export.formats:
        format_named(each).refuse_undrawn()
    claim_folder(out, replaced=["field.gpkg"] if overwrite else ())
    # What file managers leave in a folder is hidden, as our own is.
    if not overwrite and any(not each.name.startswith(".") for each in out.iterdir()):
        raise OutputExistsError(
            f"{out} is not empty.",
            hint="Choose another --out, or --overwrite: reviewed obstacles are then kept.",
        )
    earlier = out / "field.gpkg"
    previous = read_plan(earlier) if earlier.is_file() and not fresh else None
    tell_idle(with_said_tracks(settings, previous)[0], parcel=parcel is not None)
    gone = no_longer_said(settings, previous)
    if gone is not None:
        say_note(gone)
    job = Job(settings, obstacles=obstacle_file)
    tell_obstacles(job, several=False)
    timings: dict[str, float] = {}
    seen = showing(settings, lat, lon, known_outline(parcel, previous, lat, lon))
    source = imagery_of(imagery, seen, (lon, lat), acknowledged=acknowledge_terms)
    with (
        progress_bar(quiet=as_json) as progress,
        source.at(lat, lon, seen.imagery, progress) as picture,
    ):
        plan = plan_field(
            picture.path, lat=lat, lon=lon, settings=settings, previous=previous, boundary=parcel,
            known=job.standing, progress=progress, timings_s=timings, name=name,
            fetch_wider=picture.wider,
        )  # fmt: skip
        inputs = [each for each in (imagery, boundary, obstacle_file) if each is not None]
        files = plan.write(out, overwrite=overwrite, timings_s=timings, inputs=inputs)
    tell_unreached(job, [[plan.field.polygon_lonlat]])
    if as_json:
        echo_json(json.loads((out / "report.json").read_text(encoding="utf-8")))
    else:
        summarise(plan, files, timings)
        say_wider(plan, picture)
        say_outdated(out / "field.gpkg")


def summarise(plan: Plan, files: list[Path], timings: dict[str, float]) -> None:
    """A short account of a plan for the person at the terminal."""
    field = plan.field
    say(f"Field      {field.area_ha:.2f} ha, perimeter {field.perimeter_m:.0f} m ({field.method})")
    for doubt in plan.doubts:
        say(f"           check this outline: {doubt}", fg="yellow")
    if plan.obstacles is not None:
        counts = plan.obstacles["status"].value_counts().sort_index()
        parts = ", ".join(f"{count} {status}" for status, count in counts.items())
        say(f"Obstacles  {len(plan.obstacles)}" + (f" ({parts})" if parts else ""))
    if plan.tracks is not None:
        _say_tracks(plan.tracks)
    if plan.changes:
        say(f"Changes    {'; '.join(plan.changes)}")
        say(
            "           the earlier plan is kept: geofield undo "
            + str(files[0].parent / "field.gpkg")
        )
    if timings:
        say("Time       " + ", ".join(f"{stage} {value:.1f} s" for stage, value in timings.items()))
    folder = files[0].parent
    say(f"Files      {len(files)} in {folder}/")
    for name, text in (("map.png", "look at this first"), ("field.gpkg", "open this in QGIS")):
        if folder / name in files:
            say(f"           {folder / name}  ({text})")


def _say_tracks(tracks: Tracks) -> None:
    from geofield.model.map_words import heading_in_words

    segments = tracks.segments
    say(
        f"Tracks     {len(tracks.lines)} in {counted(len(segments), 'segment')}, "
        f"{segments['length_m'].sum() / 1000:.2f} km, "
        f"heading {heading_in_words(tracks.heading_deg)} degrees"
    )
    if tracks.direction_why:
        say(f"           {tracks.direction_why}")
    if tracks.turns is not None:
        _say_turns(tracks.turns)


def _say_turns(turns: Any) -> None:
    unfit, unworked_m = int((turns["fits"] == "no").sum()), float(turns["skipped_m"].sum())
    left = f", {unworked_m:.0f} m of track left unworked at them" if unworked_m >= 0.5 else ""
    say(f"Turns      {len(turns)}{left}")
    if unfit:
        do = counted(unfit, "turn does", "turns do")
        say(
            f"           {do} not fit: the machine cannot drive there "
            "(red on the map; a smaller turning radius, a margin or a headland helps)",
            fg="yellow",
        )
