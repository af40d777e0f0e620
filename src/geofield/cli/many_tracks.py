"""Tracks of many fields: one GeoPackage with all of them, a farm, or a file for each."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geofield.cli.console import progress_bar, say_note
from geofield.cli.field_notes import labels, notes_in, remarks, tell_farm, tell_fields
from geofield.cli.parcels import tell_places
from geofield.cli.standing import tell_unreached
from geofield.errors import GeofieldError, TrackError
from geofield.wording import counted, unlike, without_shape

if TYPE_CHECKING:
    from geofield.farm.engine import Engine
    from geofield.farm.places import Places
    from geofield.farm.value import Farm
    from geofield.farm.work import Job
    from geofield.plan import Plan
    from geofield.settings import Settings

#: Figures of each field, and by name why some failed.
Told = tuple[list[dict[str, Any]], dict[str, str]]
#: Up to so many fields are planned in this process: workers take seconds to begin.
_FEW = 100
#: Names of files may have 255 bytes, with what comes behind them.
_NAME_BYTES = 200
#: Up to so many fields each has a line of its own.
_LISTED = 50


@dataclass(frozen=True)
class Wanted:
    """What is to be written."""

    #: A GeoPackage or a folder.
    output: Path
    #: A GeoPackage for each field.
    each: bool
    overwrite: bool
    #: No bar, and figures of all fields.
    quiet: bool


def parcels_in(file: Path, settings: Settings, crs: str | None) -> Places:
    """The parcels of a file.

    Raises
    ------
    TrackError
        When it holds no polygons.
    """
    from geofield.farm.place_reader import read_places

    places = read_places(file, settings=settings, crs=crs, unnamed=file.stem)
    if places.outlines is None:
        raise TrackError(f"{file} holds no polygons.", hint="Give a file of field outlines.")
    if lost := places.rows[~places.known].tolist():
        say_note(f"{file.name}: {without_shape(lost, 'left out')}")
        places = places.only(places.known)
    return tell_places(places)


def tell_spacing(places: Places | None, settings: Settings) -> None:
    """Tell by which spacing several plans in one GeoPackage are planned: it keeps no settings."""
    from geofield.formats.gpkg_read import is_own

    if places is None or not is_own(Path(places.path)):
        return
    said = {*settings.tracks.model_fields_set, *places.settings.column_names}
    if said.isdisjoint(("spacing_m", "width_m", "machine")):
        say_note(
            f"{Path(places.path).name} keeps no settings of its fields: their spacing is "
            f"{settings.tracks.spacing_m:g} m now, where --spacing says no other."
        )


def of_many(places: Places, job: Job, wanted: Wanted) -> Told:
    """Plan all parcels and write them; the figures of each, and why some failed, by name."""
    if wanted.each:
        return _each(places, job, wanted)
    from geofield.farm.overview import dataset_of
    from geofield.formats.gpkg import write as write_gpkg
    from geofield.plan_files import staged_plan

    output = wanted.output
    if not output.suffix:
        farm = _farm(places, job, output, wanted, fresh=wanted.overwrite)
        return _figures(farm, places, wanted)
    with (
        tempfile.TemporaryDirectory(prefix="geofield-") as folder,
        staged_plan(output, overwrite=wanted.overwrite, inputs=_inputs(places, job)) as staging,
    ):
        farm = _farm(places, job, Path(folder) / "farm", wanted, fresh=False)
        write_gpkg(dataset_of(farm, output.stem), staging, stem=output.stem, options={})
        return _figures(farm, places, wanted)


def _farm(places: Places, job: Job, folder: Path, wanted: Wanted, *, fresh: bool) -> Farm:
    from geofield.cli.batch import overview_renewed, take_in
    from geofield.farm.engine import Here
    from geofield.farm.finish import finish
    from geofield.farm.folder import outlines_in
    from geofield.farm.pool import Pool, cores
    from geofield.farm.run import run_farm
    from geofield.farm.store import Store
    from geofield.farm.value import read_farm

    def engine() -> Engine:
        return Here() if len(places) <= _FEW else Pool(cores())

    store, stays = Store.of(folder), folder == wanted.output
    waiting = take_in(store, job) if stays else []
    with overview_renewed(store, overview=stays), progress_bar(quiet=wanted.quiet) as progress:
        count = run_farm(
            places, job, store, engine, fresh=fresh,
            tell=lambda now: progress(now.done, now.total, "fields"),
        )  # fmt: skip
    waiting = waiting and take_in(store, job, waiting)
    if stays:
        finish(store, places, anew=count.done > count.before, overview=not waiting)
        tell_farm(store, places)
    else:
        tell_farm(store, places, f"in layer places of {wanted.output.name}")
    tell_unreached(job, outlines_in(store))
    return read_farm(folder)


def _figures(farm: Farm, places: Places, wanted: Wanted) -> Told:
    status = farm.status.sort_values(["place", "field_id"]).set_index("field_id")
    called, before = labels(places), remarks(places)
    bad = status[~status.index.isin(farm.ids)]
    failed = {
        called[one]: f"{error} {hint}".strip()
        for one, error, hint in zip(bad.index, bad["error"], bad["hint"], strict=True)
    }
    rows = []
    if wanted.quiet or len(farm) <= _LISTED:
        found = {}
        for plan in farm:
            one = plan.field.field_id
            remark = before.get(one, "")
            notes = [*filter(None, [remark]), *notes_in(status["notes"][one], remark)]
            found[one] = figures_of(plan, wanted.output, notes)
        rows = [found[one] for one in status.index if one in found]
    else:
        say_note(f"{counted(len(farm), 'field is', 'fields are')} planned, in {wanted.output}.")
    return rows, failed


def _each(places: Places, job: Job, wanted: Wanted) -> Told:
    """One after the other, each into a file of its own."""
    from geofield.farm.work import plan_place
    from geofield.notes import listening
    from geofield.plan_files import save_plan

    if wanted.output.suffix:
        raise TrackError(
            f"{wanted.output} is one file, and --each writes one for each field.",
            hint="Give a folder: --each -o plans/",
        )
    rows, failed, taken, outlines = [], {}, set[str](), []
    called, notes = labels(places), []
    with progress_bar(quiet=wanted.quiet) as progress:
        for done, place in enumerate(places):
            stem, name = unlike(file_name(place.name), taken, "_"), called[place.field_id]
            progress(done, len(places), stem)
            plan = None
            with listening() as heard:
                try:
                    plan = plan_place(place, job)
                except GeofieldError as error:
                    failed[name] = f"{error.message} {error.hint or ''}".strip()
            notes.append((name, [str(note) for note in heard]))
            if plan is None:
                continue
            target = wanted.output / f"{stem}.gpkg"
            save_plan(plan, target, overwrite=wanted.overwrite, inputs=_inputs(places, job))
            rows.append(figures_of(plan, target, [*place.notes, *map(str, heard)]))
            outlines.append([plan.field.polygon_lonlat])
    tell_fields(notes, "by a farm: -o FOLDER without --each")
    tell_unreached(job, outlines)
    return rows, failed


def _inputs(places: Places, job: Job) -> list[Path | str]:
    """The files that are read, which are a person's own."""
    return [places.path, *([] if job.obstacles is None else [job.obstacles])]


def file_name(name: str) -> str:
    """A field's name as that of a file on a disk, which has letters of every script."""
    plain = re.sub(r"[^\w.-]+", "_", name).strip("._-")
    return plain.encode()[:_NAME_BYTES].decode(errors="ignore") or "field"


def figures_of(plan: Plan, target: Path, notes: Iterable[str]) -> dict[str, Any]:
    """Figures of one field, plain JSON values, and what was told of it."""
    if plan.tracks is None:
        return {}
    figures = asdict(plan.tracks.statistics)
    turns = plan.tracks.turns
    if turns is not None:
        figures |= {
            "turn_count": len(turns),
            "turn_length_m": float(turns["length_m"].sum()),
            "turns_that_do_not_fit": int((turns["fits"] == "no").sum()),
            "unworked_at_turns_m": float(turns["skipped_m"].sum()),
        }
    return {
        "field_id": plan.field.field_id,
        "name": plan.field.name,
        "file": str(target),
        "heading_deg": plan.tracks.heading_deg,
        "spacing_m": plan.tracks.spacing_m,
        "direction_why": plan.tracks.direction_why,
        **figures,
        "notes": list(dict.fromkeys([*notes, *plan.tracks.notes])),
    }


def line_of(row: dict[str, Any]) -> str:
    """The figures of one field as a line for people."""
    from geofield.model.map_words import heading_in_words

    text = (
        f"{row['name']}: {counted(row['track_count'], 'track')}, "
        f"{counted(row['segment_count'], 'segment')}, "
        f"{row['length_m']:.0f} m, heading {heading_in_words(row['heading_deg'])} degrees, "
        f"{row['coverage_percent']:.1f} % covered"
    )
    if "turn_count" in row:
        text += (
            f", {counted(row['turn_count'], 'turn')} ({row['turns_that_do_not_fit']} do not fit)"
        )
        if row["unworked_at_turns_m"] >= 0.5:
            text += f", {row['unworked_at_turns_m']:.0f} m of track left unworked at them"
    if row["direction_why"]:
        text += f" ({row['direction_why']})"
    return f"{text}; in {row['file']}"
