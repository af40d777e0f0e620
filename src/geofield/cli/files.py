"""Files and folders on the command line: kinds of paths, and the claim of what will be written."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import Any, TypeVar

import click

from geofield.cli.console import say_note
from geofield.staging import claimed
from geofield.strangers import picture_file
from geofield.wording import command

Command = TypeVar("Command", bound=Callable[..., Any])


class NamedPath(click.Path):
    """A path; no name at all, as of a variable that is not set, is not the working folder.

    A link to a GeoPackage is what it leads to: there the plan is saved, with its log and products.
    Of a picture in a file (`picture_file`) the file must be there.
    """

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path."""
        if value == "":
            self.fail("it is empty: give a name.", param, ctx)
        given = self.exists or isinstance(param, click.Argument)
        if given and str(value).lower().startswith(("http://", "https://")):
            self.fail(
                f"{value} is an address, from which only pictures are read: download the file, "
                "and name that.",
                param,
                ctx,
            )
        if value == "-" and not self.exists:
            self.fail("standard input and output are not used here: give a name.", param, ctx)
        if isinstance(param, click.Option) and str(value).startswith("-") and not self.exists:
            self.fail(f"{value} is an option: give a name, or ./{value} if it is one.", param, ctx)
        if self.exists and (file := picture_file(value)) != Path(value):
            super().convert(str(file), param, ctx)
            return Path(value)
        path = super().convert(value, param, ctx)
        if isinstance(path, Path) and path.suffix.lower() == ".gpkg" and path.is_symlink():
            try:
                return path.resolve()
            except (OSError, RuntimeError):
                self.fail(f"{path} is a link that leads back to itself.", param, ctx)
        return path


PATH = NamedPath(path_type=Path)
FILE = NamedPath(dir_okay=False, path_type=Path)
FOLDER = NamedPath(file_okay=False, path_type=Path)
#: The folder of a farm, which may lie in an object store.
FARM = NamedPath(path_type=str)
#: What must be there.
OLD_PATH = NamedPath(exists=True, path_type=Path)
OLD_FILE = NamedPath(exists=True, dir_okay=False, path_type=Path)
plan_argument = click.argument("plan_file", metavar="PLAN.gpkg", type=OLD_FILE)


def output_option(help_text: str, kind: click.Path = FILE) -> Callable[[Command], Command]:
    """Add ``-o``, ``--output``, which must be given."""
    return click.option("-o", "--output", required=True, type=kind, help=help_text)


def claim_folder(
    folder: Path,
    names: Collection[str] | None = None,
    *,
    replaced: Collection[str] = (),
    overwrite: bool = True,
    inputs: Iterable[Path | str] = (),
) -> None:
    """Claim a folder, or some names in it, until the command ends, before it reads what is there.

    Raises
    ------
    OutputExistsError
        Another geofield works there, or a file that would be `replaced` is there.
    FormatError
        Such a file cannot be replaced: it is an input, read-only, or open in another program.
    """
    claim = claimed(folder, names, replaced=replaced, overwrite=overwrite, inputs=inputs)
    click.get_current_context().with_resource(claim)
    tell_unsaved(folder, names)


def tell_unsaved(folder: Path, names: Collection[str] | None = None) -> None:
    """Tell of edits of the review page that were not saved: what a command makes has them not."""
    from geofield.review.plans import REVIEWING, SUFFIX, unsaved_in

    told: set[Path] = click.get_current_context().meta.setdefault(__name__, set())
    for notes in set(unsaved_in(folder)) - told:
        plan = notes.with_name(notes.name.removesuffix(SUFFIX))
        if names is None or plan.name in names:
            told.add(notes)
            place = folder if notes.parent.name == REVIEWING else plan
            say_note(
                f"{notes} holds edits of the review page that were not saved, and that are not in "
                f"what is made now. Bring them back: {command('review', place)}"
            )


def claim_file(
    output: Path,
    *,
    overwrite: bool,
    inputs: Iterable[Path | str] = (),
    renewed: Path | None = None,
) -> None:
    """The same for one file; the plan that is `renewed` may be replaced by itself."""
    if renewed is not None and output.exists() and output.samefile(renewed):
        overwrite = True
    name = (output.name,)
    claim_folder(output.parent, name, replaced=name, overwrite=overwrite, inputs=inputs)


def claim_plan(output: Path, **how: Any) -> None:
    """The same for a plan that a stage will write; another name than a GeoPackage's is refused."""
    from geofield.plan_files import refuse_other_names

    refuse_other_names(output)
    claim_file(output, **how)
