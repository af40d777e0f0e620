"""Writing the GeoPackage that the stages hand to each other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from geofield.errors import FormatError
from geofield.staging import staged_folder

if TYPE_CHECKING:
    from geofield.plan import Plan


def refuse_other_names(output: Path) -> None:
    """Refuse to write a plan into what is no GeoPackage by its name.

    Its project and the files beside it know it by that name, letter by letter.
    """
    if output.suffix != ".gpkg":
        raise FormatError(
            f"{output} is not a GeoPackage name.",
            hint="Stages write NAME.gpkg, in small letters; `geofield export` has other formats.",
        )


@contextmanager
def staged_plan(
    output: Path, *, overwrite: bool = False, inputs: Iterable[Path | str] = ()
) -> Iterator[Path]:
    """A folder to write a plan's GeoPackage into, which then takes the place of the one before.

    The one before stays as the earlier one, and what a person keeps in it beside its plan comes
    along; a project beside it that a person saved stays. `inputs`, files read for this work, are
    never replaced.
    """
    from geofield.formats.gpkg_guests import replace_plan

    refuse_other_names(output)
    with staged_folder(output.parent, overwrite=overwrite, inputs=inputs) as staging:
        yield staging
        replace_plan(output, staging / output.name)


def save_plan(
    plan: Plan,
    output: Path,
    *,
    read_from: Path | None = None,
    picture: Path | None = None,
    overwrite: bool = False,
    inputs: Iterable[Path | str] = (),
) -> None:
    """Write a plan as one GeoPackage.

    `output` may be `read_from`, the GeoPackage that the plan was read from: a stage that adds to a
    file replaces it in one step. `overwrite` allows to replace another, but none of the `inputs`:
    all other files that were read. The project shows the `picture`, by default that which belongs
    to `read_from` where the plan still is of that.
    """
    from geofield.formats import write_dataset
    from geofield.formats.gpkg_read import scene_beside

    same = read_from is not None and output.resolve() == read_from.resolve()
    if same and output.is_symlink():
        # The plan is what the link leads to: replaced by a file of its own it would stay as it was.
        output = read_from = output.resolve()
    dataset = plan.to_dataset()
    if picture is None and read_from is not None:
        picture = scene_beside(read_from, dataset.provenance.source)
    if picture is not None and output.resolve().parent == picture.resolve().parent:
        # The project goes on showing the picture that lies there.
        dataset = replace(dataset, scene_path=picture)
    with staged_plan(output, overwrite=overwrite or same, inputs=inputs) as staging:
        shown = {"picture": True}
        write_dataset(dataset, staging, ["gpkg"], stem=output.stem, options=shown)


def tracks_unread(file: Path) -> str | None:
    """Why tracks that lie in a plan's GeoPackage are none of its plan, in words; None if they are.

    Without the record of how they were planned nobody can tell what a person changed of them:
    they are planned anew.
    """
    from geofield import schema
    from geofield.formats.foreign import has_rows, layer_names
    from geofield.formats.gpkg_read import record_of

    record, layer = record_of(file), schema.TRACKS.name
    planned = record is not None and "tracks" in record.provenance.evidence
    if planned or layer not in layer_names(file) or not has_rows(file, layer):
        return None
    return (
        "has lost the record of what was written (as copies made by other programs do)"
        if record is None
        else "has no record of how its tracks were planned (they were imported, perhaps)"
    )
