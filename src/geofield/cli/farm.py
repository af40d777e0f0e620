"""``geofield farm``: put reviewed plans back into a farm."""

from __future__ import annotations

from pathlib import Path

import click

from geofield.cli.console import say, say_note
from geofield.cli.files import FARM, OLD_PATH, PATH, claim_folder, output_option, tell_unsaved
from geofield.errors import FormatError
from geofield.staging import written_ns
from geofield.wording import command, nearest


@click.group(
    epilog="""\b
Example (the farm is that of `geofield batch --help`):
  geofield batch sample_data/seeds.csv sample_data/field_1.tif --spacing 4 --out farm/
  geofield farm get farm/ field_1 -o field_1.gpkg
  geofield farm put field_1.gpkg farm/
"""
)
def farm() -> None:
    """Take single plans out of a farm, and put them back when they are reviewed."""


@farm.command(
    epilog="""\b
Example:
  geofield farm get farm/ field_1 -o field_1.gpkg
"""
)
@click.argument("folder", metavar="FARM", type=FARM)
@click.argument("field_id", metavar="ID")
@output_option("GeoPackage.", PATH)
@click.option("--overwrite", is_flag=True, help="Replace a file that is there already.")
def get(folder: str, field_id: str, output: Path, overwrite: bool) -> None:
    """Write the plan of field ID of FARM as a GeoPackage, for QGIS and `geofield review`."""
    from geofield.farm import read_farm
    from geofield.farm.failed import FAILED
    from geofield.farm.store import Store
    from geofield.farm.taken_out import taken_out
    from geofield.plan_files import save_plan

    say_waiting(folder)
    whole = read_farm(folder)
    if field_id not in whole:
        reasons = (
            f"; its {FAILED} tells why others have none" if Store.of(folder).get(FAILED) else ""
        )
        some = ", ".join(whole.ids[:10]) + ", ..." * (len(whole) > 10)
        raise FormatError(
            f"{folder} has no plan of a field {field_id!r}." + nearest(field_id, whole.ids),
            hint=f"It has plans of {some}{reasons}.",
        )
    save_plan(taken_out(whole[field_id]), output, overwrite=overwrite)
    say(f"Plan       {output}")


def say_waiting(folder: str | Path) -> None:
    """Tell of edits beside a farm that it does not hold yet: they are not in what is made of it."""
    from geofield.farm.edited_in_place import edited_in_place
    from geofield.farm.edits import is_edited
    from geofield.farm.folder import OVERVIEW, PROJECT
    from geofield.farm.reviewed import file_of
    from geofield.farm.store import Store

    store = Store.of(folder)
    if store.folder is None:
        return
    edited = [file_of(one) for one in edited_in_place(store)]
    overview, project = store.folder / OVERVIEW, store.folder / PROJECT
    # Both come into place with one time: read is what was written to since, 0.4 ms a field.
    there = overview.is_file() and project.is_file()
    as_written = there and written_ns(overview) == written_ns(project)
    if not as_written and is_edited(store.folder, overview):
        edited.append(OVERVIEW)
    for name in edited:
        say_note(
            f"{name} has edits that the farm does not hold yet. Take them in: "
            f"{command('farm', 'put', Path(folder) / name, Path(folder))}"
        )


@farm.command(
    epilog="""\b
Example:
  geofield farm put field_1.gpkg farm/
  geofield farm put farm/farm.gpkg farm/
"""
)
@click.argument("plan_file", metavar="PLAN", type=OLD_PATH)
@click.argument("folder", metavar="FARM", type=FARM)
@click.option(
    "--anyway",
    is_flag=True,
    help="Put it back although another one was put back since it was taken out; that stays in "
    "FARM/reviewed as ID.gpkg.bak.",
)
def put(plan_file: Path, folder: str, anyway: bool) -> None:
    """Put the reviewed PLAN of one field back into FARM, or all fields edited in its farm.gpkg.

    It takes the place of the plan that is there, and no later run of `geofield batch` changes
    what a person said.
    """
    from geofield.farm.edits import is_overview, put_edits
    from geofield.farm.finish import renew
    from geofield.farm.folder import OVERVIEW
    from geofield.farm.put_back import put_back
    from geofield.farm.store import Store
    from geofield.plan import read_plan

    alone, store = not is_overview(plan_file), Store.of(folder)
    place = store.folder
    if place is not None and place.is_dir():
        claim_folder(place)
    tell_unsaved(plan_file.parent, (plan_file.name,))
    ids: list[str] = []
    if place is not None:
        # Edits in the overview first: it is written anew below.
        overview = place / OVERVIEW if alone else plan_file
        if not alone:
            _refuse_other_edits(place, plan_file)
        but = read_plan(plan_file).field.field_id if alone else None
        ids, waiting = put_edits(place, overview, but=but, anyway=not alone)
        if waiting:
            raise FormatError(
                f"{overview.name} has edits of field {waiting[0]}, of which {folder} has no plan.",
                hint="Go on with `geofield batch`: it takes them in when the field is planned.",
            )
    if alone:
        ids.append(put_back(plan_file, folder, anyway=anyway))
    if ids:
        renew(store)
    for field_id in ids:
        say(f"Field      {field_id} of {folder} is now as you left it")
    if not ids:
        say(f"{plan_file} has no edits.")


def _refuse_other_edits(folder: Path, overview: Path) -> None:
    """Refuse the overview of another place while the farm's own has edits: it is written anew."""
    from geofield.farm.edits import is_edited
    from geofield.farm.folder import OVERVIEW

    own = folder / OVERVIEW
    if own.is_file() and not own.samefile(overview) and is_edited(folder, own):
        raise FormatError(
            f"{own} has edits that the farm does not hold yet.",
            hint=f"Take them in first: {command('farm', 'put', own, folder)}; or move that file "
            "out of the farm.",
        )
