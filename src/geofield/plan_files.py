"""Writing the GeoPackage that the stages hand to each other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from geofield.errors import FormatError
from geofield.generations import keep_earlier
from geofield.staging import staged_folder

if TYPE_CHECKING:
    from geofield.plan import Plan


def save_plan(
    plan: Plan,
    output: Path,
    *,
    read_from: Path | None = None,
    picture: Path | None = None,
    overwrite: bool = False,
) -> None:
    """Write a plan as one GeoPackage.

    Parameters
    ----------
    plan : Plan
    output : Path
        May be `read_from`: a stage that adds to a file replaces it in one step.
    read_from : Path, optional
        The GeoPackage that the plan was read from.
    picture : Path, optional
        That the project shows; the one that belongs to `read_from` when not given.
    overwrite : bool
        Replace a file other than `read_from`.
    """
    from geofield.formats import write_dataset
    from geofield.formats.gpkg_read import scene_beside

    if output.suffix.lower() != ".gpkg":
        raise FormatError(
            f"{output} is not a GeoPackage name.",
            hint="Stages write NAME.gpkg; use `geofield export` for other formats.",
        )
    same = read_from is not None and output.resolve() == read_from.resolve()
    dataset = plan.to_dataset()
    if picture is None and read_from is not None:
        picture = scene_beside(read_from)
    if picture is not None and output.resolve().parent == picture.resolve().parent:
        # The project goes on showing the picture that lies there.
        dataset = replace(dataset, scene_path=picture)
    with staged_folder(output.parent, overwrite=overwrite or same) as staging:
        keep_earlier(output, staging)
        write_dataset(dataset, staging, ["gpkg"], stem=output.stem)
