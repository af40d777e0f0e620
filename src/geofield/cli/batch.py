"""``geofield batch``: many fields."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from geofield.cli.console import echo_json, progress_bar, say, say_note
from geofield.cli.field_notes import tell_farm
from geofield.cli.files import FARM, PATH, claim_folder
from geofield.cli.grouped import GroupedCommand
from geofield.cli.options import Number, acknowledge_option, stage_options, tell_idle
from geofield.cli.parcels import place_options, places_of
from geofield.cli.standing import obstacles_for, obstacles_option, tell_obstacles, tell_unreached
from geofield.errors import FieldError, GeofieldError
from geofield.wording import counted

if TYPE_CHECKING:
    from geofield.farm.engine import Engine
    from geofield.farm.places import Places
    from geofield.farm.run import Count
    from geofield.farm.store import Store
    from geofield.farm.work import Job
    from geofield.imagery import Imagery
    from geofield.settings import Settings, Stage

#: Reviewed fields without a plan that are named.
_TOLD = 10


@click.command(
    cls=GroupedCommand,
    epilog="""\b
Examples (the first one on the project's own sample):
  geofield batch sample_data/seeds.csv sample_data/field_1.tif --spacing 4 --out farm/
  geofield batch parcels.gpkg --obstacles trees.gpkg --workers 8 --out farm/
  geofield batch places.parquet ortho/ --scheduler tcp://10.0.0.5:8786 --out s3://bucket/farm
""",
)
@click.argument("places", metavar="PLACES", type=PATH)
@click.argument("imagery", required=False)
@click.option(
    "--out",
    required=True,
    metavar="FARM",
    type=FARM,
    help="Folder of the farm, or s3://BUCKET/FOLDER; where it is begun already, only what is "
    "missing is done.",
)
@click.option(
    "--workers",
    type=click.IntRange(1, 1024),
    help="Worker processes on this machine; one per core by default.",
)
@click.option("--scheduler", metavar="ADDRESS", help="Of a Dask cluster: tcp://HOST:8786.")
@obstacles_option
@click.option(
    "--fresh",
    is_flag=True,
    help="Plan all anew where the farm is of other work; what a person reviewed stays.",
)
@click.option(
    "--overview/--no-overview",
    default=True,
    show_default=True,
    help="Write farm.gpkg and farm.qgz for QGIS at the end.",
)
@click.option("--retry", is_flag=True, help="Try places again that failed or were lost.")
@click.option(
    "--time-limit",
    "time_limit_s",
    type=Number(0, min_open=True),
    default=600.0,
    show_default=True,
    help="Of one field, seconds.",
)
@click.option(
    "--memory-limit",
    "memory_limit_mb",
    type=Number(0, min_open=True),
    default=4000.0,
    show_default=True,
    help="Of a worker, megabytes.",
)
@acknowledge_option
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON on stdout.")
@place_options
@stage_options("imagery", "field", "obstacles", "tracks")
def batch(
    places: Path,
    imagery: str | None,
    out: str,
    workers: int | None,
    scheduler: str | None,
    obstacle_file: Path | None,
    fresh: bool,
    overview: bool,
    retry: bool,
    time_limit_s: float,
    memory_limit_mb: float,
    acknowledge_terms: bool,
    as_json: bool,
    settings: Settings,
    **options: Any,
) -> None:
    """Plan many fields into one farm.

    PLACES is a file with a row per field: points (CSV or Parquet with columns lat and lon, or
    any vector file) or parcels (polygons), whose outlines are taken as they are. Columns named
    like settings (spacing_m, heading_deg, name, ...) hold for their field; all others come along.
    IMAGERY is whatever `geofield run` takes; parcels need none.

    What a person edited in the farm's overview (farm.gpkg) is taken in first and kept.
    Ctrl+C lets the fields at work end; a second one stops at once. The same command goes on.
    """
    from geofield.farm.finish import finish
    from geofield.farm.folder import outlines_in
    from geofield.farm.limits import Limits
    from geofield.farm.reviewed import reviewed_rows, without_place
    from geofield.farm.run import run_farm
    from geofield.farm.store import Store
    from geofield.farm.work import Job

    if "://" not in out:
        claim_folder(Path(out))
    found = places_of(places, settings, options)
    if imagery is None and not found.parcels:
        raise FieldError(
            f"{places.name} holds points, and a point alone has no outline.",
            hint="Name the IMAGERY behind PLACES, or give parcels (polygons).",
        )
    obstacle_file = obstacles_for(found, obstacle_file, imagery=imagery)
    pictures, about = _imagery(imagery, settings, found, acknowledged=acknowledge_terms)
    job = Job(settings, pictures, None if obstacle_file is None else obstacle_file.absolute(),
              options.get("places_crs"))  # fmt: skip
    _tell_unused(settings, found, pictures=imagery is not None)
    tell_obstacles(job, several=True)
    store = Store.of(out)
    if scheduler is not None and workers is not None:
        raise click.UsageError("Name --workers or --scheduler, not both.")
    say(f"Places     {len(found)} of {places.name}")
    waiting = take_in(store, job)
    with (
        overview_renewed(store, overview=overview),
        progress_bar(quiet=as_json) as progress,
        _two_interrupts() as stop,
    ):
        count = run_farm(
            found, job, store, lambda: _engine(workers, scheduler, store),
            limits=Limits(time_limit_s, memory_limit_mb), fresh=fresh, retry=retry,
            imagery=about, stop=stop, tell=lambda at: _show(progress, at),
        )  # fmt: skip
    unused = without_place(store, found.ids.to_pylist()) if count.done > count.before else []
    if unused:
        say_note(
            f"{counted(len(unused), 'reviewed plan is', 'reviewed plans are')} of no id in "
            f"{places.name}, and {'waits' if len(unused) == 1 else 'wait'} for one: "
            f"{', '.join(unused[:5])}."
        )
    reviewed = reviewed_rows(store)
    if count.done > count.before:
        tell_farm(store, found)
    waiting = waiting and take_in(store, job, waiting)
    files = finish(store, found, anew=count.done > count.before, overview=overview and not waiting)
    if as_json:
        echo_json({"farm": store.shown, "places": count.total, **count.statuses, "files": files})
    else:
        _summarise(count, store.shown, files)
    tell_unreached(job, outlines_in(store))
    if count.done < count.total:
        raise GeofieldError(
            f"Stopped: {count.done} of {counted(count.total, 'place is', 'places are')} done.",
            hint="The same command does what is missing.",
        )
    if count.failed == count.total:
        raise GeofieldError("No place could be planned.", hint="The reasons are in failed.csv.")
    without = [row["field_id"] for row in reviewed if row["status"] in ("failed", "lost")]
    if without:
        raise GeofieldError(
            f"{counted(len(without), 'reviewed field has', 'reviewed fields have')} no plan: "
            f"{', '.join(without[:_TOLD])}.",
            hint="The reasons are in failed.csv; what you said of them waits in reviewed/.",
        )


def _tell_unused(settings: Settings, places: Places, *, pictures: bool) -> None:
    """Tell which options change nothing where outlines are given, and no picture is."""
    unused: dict[Stage, str] = {}
    if places.parcels:
        unused["field"] = "beside parcels, which are taken as they are"
    if not pictures:
        unused["imagery"] = "without IMAGERY"
        unused["obstacles"] = (
            "without IMAGERY: polygons of --obstacles are avoided as drawn, points and lines with "
            "the margin of their column buffer_m; --clearance keeps more from all"
        )
    if not places.settings.num_columns:  # a column could choose another way for its field
        tell_idle(settings, unused=unused)


@contextmanager
def overview_renewed(store: Store, *, overview: bool) -> Iterator[None]:
    """Where a run is refused, an overview in which what was taken in is no edit any more."""
    from geofield.farm.finish import renew_unless_edited
    from geofield.farm.marks import CHANGED

    try:
        yield
    except GeofieldError:
        if overview and store.get(CHANGED) is not None:
            renew_unless_edited(store)
        raise


@contextmanager
def _two_interrupts() -> Iterator[threading.Event]:
    """What the first Ctrl+C sets; the second, and any other stop, end the block."""
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def first(number: int, frame: Any) -> None:
        signal.signal(signal.SIGINT, before)
        stop.set()
        say_note("What is begun is finished; again Ctrl+C stops at once.")

    # Asked first: the handler can be called before a value that is handed back has its name.
    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, first)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)


def take_in(store: Store, job: Job, only: list[str] | None = None) -> list[str]:
    """Take in what was edited in the overview; edited fields that have no plan.

    Before a run all edits; after it `only` those of fields that had no plan before.
    """
    from geofield.farm.edited_in_place import edited_in_place
    from geofield.farm.edited_plan import said_of
    from geofield.farm.edits import put_edits
    from geofield.farm.folder import OVERVIEW
    from geofield.farm.put_back import take_in_place
    from geofield.farm.reviewed import file_of

    if store.folder is None:
        return []
    for one in list(edited_in_place(store)) if only is None else ():
        with said_of(one):
            take_in_place(store, one)
        say(f"Field      {one} as edited in {file_of(one)}: kept, its tracks planned again")
    overview = store.folder / OVERVIEW
    edited, waiting = put_edits(
        store.folder, overview, only=only, anyway=only is not None, around=job.standing
    )
    for one in edited:
        say(f"Field      {one} as edited in {OVERVIEW}: kept, its tracks planned again")
    if waiting and only is not None:
        say_note(
            f"{OVERVIEW} stays as it is: it has edits of fields without a plan "
            f"({', '.join(waiting[:5])}). Move it out of the farm to have it written anew."
        )
    return waiting


def _imagery(
    what: str | None, settings: Settings, places: Places, *, acknowledged: bool
) -> tuple[Imagery | None, dict[str, Any]]:
    """Where pictures come from, and what the record says of it; terms are checked here, once."""
    if what is None:
        return None, {}
    import numpy as np

    from geofield.cli.imagery_tools import source_of
    from geofield.farm.pictures import refuse_elsewhere
    from geofield.imagery import Imagery, is_own_picture, pictures_digest
    from geofield.imagery.sources import PictureSource

    if is_own_picture(what):
        refuse_elsewhere(Path(what), places, settings)
        digest = pictures_digest(Path(what), allow=settings.fetch.allow)
        about = {"imagery": Path(what).name, "imagery_digest": digest}
        return Imagery(str(Path(what).absolute()), digest=digest), about
    first = int(np.flatnonzero(np.isfinite(places.lat))[0])
    point = (float(places.lon[first]), float(places.lat[first]))
    source, options = source_of(what, settings, point, acknowledged=acknowledged)
    terms = source.terms
    about = {
        "imagery": source.name,
        "attribution": terms.attribution,
        "licence": terms.licence,
        "terms_url": terms.url,
        "identity": source.path if isinstance(source, PictureSource) else "",
    }
    return Imagery("", source, options), about


def _engine(workers: int | None, scheduler: str | None, store: Store) -> Engine:
    """Who does the work; said, with the address of a dashboard."""
    engine: Engine
    if scheduler is None:
        from geofield.farm.pool import Pool, cores

        engine = Pool(workers or cores())
    else:
        from geofield.farm.cluster import Cluster

        try:
            engine = Cluster.at(scheduler, store)
        except ImportError:
            raise GeofieldError(
                "A Dask cluster needs the extra: pip install geofield[batch]",
                hint="Without it, --workers N uses this machine.",
            ) from None
    try:
        say(f"Workers    {engine.where}")
    except BaseException:  # a stop: nobody else knows of it yet
        engine.close()
        raise
    return engine


def _show(progress: Any, count: Count) -> None:
    """How far the run is: fields per minute, failed, time left."""
    left = count.left_s
    words = f"{counted(round(count.per_minute), 'field')} per minute, {count.failed} failed"
    if left is not None and count.done < count.total:
        words += f", {_span(left)} left"
    progress(
        count.done,
        count.total,
        words,
        failed=count.failed,
        per_minute=round(count.per_minute, 1),
        left_s=None if left is None else round(left),
    )


def _span(seconds: float) -> str:
    """A time in words."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _summarise(count: Count, place: str, files: list[str]) -> None:
    parts = ", ".join(f"{n} {status}" for status, n in sorted(count.statuses.items()))
    say(f"Fields     {count.done} of {count.total}: {parts or 'none'}")
    if count.done > count.before:
        say(f"Pace       {count.per_minute:.0f} per minute")
    if count.failed:
        few = counted(count.failed, "place has", "places have")
        say_note(f"{few} no plan: the reasons are in {place}/failed.csv.")
    say(f"Farm       {place}" + (f" ({', '.join(files)})" if files else ""))
