"""Writing the GeoPackage that the stages hand to each other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from geofield.errors import FormatError
from geofield.staging import staged_folder
from geofield.staging.generations import keep_earlier

if TYPE_CHECKING:
    from geofield.plan import Plan


def refuse_other_names(output: Path) -> None:
    """Refuse to write a plan into what is no GeoPackage by its name."""
    if output.suffix.lower() != ".gpkg":
        raise FormatError(
            f"{output} is not a GeoPackage name.",
            hint="Stages write NAME.gpkg; use `geofield export` for other formats.",
        )


def save_plan(
    plan: Plan,
    output: Path,
    *,
    read_from: Path | None = None,
    picture: Path | None = None,
    overwrite: bool = False,
) -> None:
    """Write a plan as one GeoPackage.

    `output` may be `read_from`, the GeoPackage that the plan was read from: a stage that adds to a
    file replaces it in one step. `overwrite` allows to replace another. What a person keeps in the
    replaced file beside its plan comes along. The project shows the `picture`, by default that
    which belongs to `read_from`.
    """
    from geofield.formats import write_dataset
    from geofield.formats.gpkg_guests import bring_guests
    from geofield.formats.gpkg_read import scene_beside

    refuse_other_names(output)
    same = read_from is not None and output.resolve() == read_from.resolve()
    dataset = plan.to_dataset()
    if picture is None and read_from is not None:
        picture = scene_beside(read_from)
    if picture is not None and output.resolve().parent == picture.resolve().parent:
        # The project goes on showing the picture that lies there.
        dataset = replace(dataset, scene_path=picture)
    with staged_folder(output.parent, overwrite=overwrite or same) as staging:
        earlier = keep_earlier(output, staging)
        write_dataset(dataset, staging, ["gpkg"], stem=output.stem)
        if earlier is not None:
            bring_guests(earlier, staging / output.name)
