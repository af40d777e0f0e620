"""Writing the GeoPackage that the stages hand to each other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from geofield.errors import FormatError

if TYPE_CHECKING:
    from geofield.plan import Plan


def save_plan(
    plan: Plan, output: Path, *, read_from: Path | None = None, overwrite: bool = False
) -> None:
    """Write a plan as one GeoPackage.

    Parameters
    ----------
    plan : Plan
    output : Path
        May be `read_from`: a stage that adds to a file replaces it in one step.
    read_from : Path, optional
        The GeoPackage that the plan was read from.
    overwrite : bool
        Replace a file other than `read_from`.
    """
    from geofield.formats import write_dataset

    if output.suffix.lower() != ".gpkg":
        raise FormatError(
            f"{output} is not a GeoPackage name.",
            hint="Stages write NAME.gpkg; use `geofield export` for other formats.",
        )
    same = read_from is not None and output.resolve() == read_from.resolve()
    write_dataset(
        plan.to_dataset(), output.parent, ["gpkg"], stem=output.stem, overwrite=overwrite or same
    )
