"""``geofield export``: one or more plans in other formats."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from geofield.cli.console import echo_json, say, say_note
from geofield.cli.farm import say_waiting
from geofield.cli.files import FOLDER, OLD_PATH, PATH, claim_folder, tell_unsaved
from geofield.errors import GeofieldError

if TYPE_CHECKING:
    from geofield.model import Dataset


@click.command(
    epilog="""\b
Examples (on the project's own sample):
  geofield run sample_data/field_1.tif --lat 35.075373 --lon 33.531142 --out out/
  geofield export out/field.gpkg --format isoxml --format kml --out export/
  geofield export out/field.gpkg -f map -f html --out pictures/
  geofield export out/field.gpkg -f shapefile --profile tracklead --out stick/
  geofield export out/*.gpkg --format isoxml --customer "Ann" --out one_stick/
`geofield formats` lists the formats and what each can carry.
"""
)
@click.argument("plan_files", metavar="PLAN...", nargs=-1, required=True, type=PATH)
@click.option(
    "-f", "--format", "formats", multiple=True, required=True, help="Format; may be repeated."
)
@click.option("--out", "folder", required=True, type=FOLDER, help="Folder for the products.")
@click.option("--stem", default="field", show_default=True, help="Name of single files.")
@click.option("--crs", help="CRS of PLAN where the file does not say it, e.g. EPSG:32633.")
@click.option(
    "--picture",
    type=OLD_PATH,
    help="Picture to show, or a folder of some; by default that beside PLAN, or the farm's.",
)
@click.option("--customer", help="Customer's name, for terminals.")
@click.option("--farm", help="Farm's name, for terminals.")
@click.option(
    "--profile",
    type=click.Choice(["generic", "tracklead", "aggps"]),
    help="Names and columns of Shapefiles.",
)
@click.option("--zip", "zipped", is_flag=True, help="Shapefiles or ISOXML in one archive.")
@click.option(
    "--points/--no-points",
    default=None,
    help="Track points: by default in the GeoPackage and the study's files, not in other RDF.",
)
@click.option(
    "--option", "further", multiple=True, metavar="NAME=VALUE", help="Further option of a format."
)
@click.option(
    "--overwrite",
    is_flag=True,
    help="Replace products that are there already; `geofield undo` brings a GeoPackage back.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the files as JSON on stdout.")
def export(
    plan_files: tuple[Path, ...],
    formats: tuple[str, ...],
    folder: Path,
    stem: str,
    crs: str | None,
    picture: Path | None,
    further: tuple[str, ...],
    overwrite: bool,
    as_json: bool,
    **given: Any,
) -> None:
    """Write other formats from one or more plans.

    PLAN is a GeoPackage of geofield, the folder of a farm, or any file it can import. Of
    several plans, formats that can hold several fields get them in one file (one ISOXML task
    file, one set of Shapefiles, one KML with folders, one linked dataset); the others have a
    file or folder per field.
    Columns "customer" and "farm" of the field say whose it is. All products come into place
    together or not at all; what a format cannot carry is said once.
    """
    from geofield.farm import is_farm, read_farm
    from geofield.formats import format_named, read_dataset, write_datasets
    from geofield.formats.export import unknown_option
    from geofield.formats.many import apart
    from geofield.formats.registry import products as products_of

    given["zip"] = given.pop("zipped") or None
    options = {key: value for key, value in given.items() if value is not None}
    options |= dict(_named(text) for text in further)
    names = [name for text in formats for name in text.split(",")]
    chosen = [format_named(name) for name in names]
    unknown = unknown_option(chosen, options)
    if unknown is not None:
        flag = f"--{unknown[0]}" if unknown[0] in given else f"--option {unknown[0]}"
        raise click.UsageError(f"No chosen format knows {flag}. {unknown[1]}")
    products = [product.replace("{stem}", stem) for each in chosen for product in each.files]
    claim_folder(folder, {product.partition("/")[0] for product in products})
    datasets: list[Dataset] = []
    pictured = any(each.pictured for each in chosen)
    cuts = click.get_current_context().with_resource(
        tempfile.TemporaryDirectory(prefix="geofield-")
    )
    for plan_file in products_of(plan_files):
        below = picture
        if is_farm(plan_file):
            from geofield.farm.pictures import pictures_of

            say_waiting(plan_file)
            own = [plan.to_dataset() for plan in read_farm(plan_file)]
            below = picture or pictures_of(plan_file)
        else:
            tell_unsaved(plan_file.parent, (plan_file.name,))
            dataset = read_dataset(plan_file, crs=crs)
            for note in dataset.notes:
                say(note)
            own = apart(dataset)
        if pictured and below is not None:
            # Of several fields those off the picture are told, with all others drawn on it.
            alone = picture is not None and len(own) == len(plan_files) == 1
            own = [_on(below, each, cuts, must=alone) for each in own]
        datasets += own
    off = [each.name for each in datasets if each.scene_path is None]
    if pictured and picture is not None and off:
        say_note(f"{picture} does not show {', '.join(off)}.")
    written = write_datasets(
        datasets,
        folder,
        names,
        stem=stem,
        overwrite=overwrite,
        options=options,
        inputs=plan_files,
    )
    if as_json:
        echo_json({"files": [str(path) for path in written]})
        return
    for path in written:
        say(str(path))


def _on(picture: Path, dataset: Dataset, cuts: str, *, must: bool) -> Dataset:
    """The dataset with its part of the picture, which it must have or may."""
    from geofield.imagery import write_scene
    from geofield.plan import Plan
    from geofield.settings import Settings
    from geofield.windows import scene_of_plan

    plan = Plan.from_dataset(dataset)
    try:
        scene = scene_of_plan(picture, plan, plan.settings or Settings())
    except GeofieldError:
        if must:
            raise
        return dataset
    place = Path(tempfile.mkdtemp(dir=cuts)) / "scene.tif"
    return replace(dataset, scene_path=write_scene(scene, place))


def _named(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise click.BadParameter(f"{text!r} is not NAME=VALUE.", param_hint="--option")
    return name, value
