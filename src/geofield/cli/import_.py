"""``geofield import``: other people's boundaries, obstacles and lines as a GeoPackage."""

from __future__ import annotations

from pathlib import Path

import click

from geofield.cli.console import echo_json, say
from geofield.cli.files import PATH, claim_plan, output_option
from geofield.cli.options import without_blanks
from geofield.wording import counted


@click.command(
    "import",
    epilog="""\b
Examples (the first two on the project's own sample):
  geofield export sample_data/field_1.gpkg --format shapefile --out others/
  geofield import others/shapefile/boundary.shp others/shapefile/obstacles.shp -o mine.gpkg
  geofield import boundary.shp -o field.gpkg
  geofield import boundary.shp trees.geojson -o field.gpkg --crs EPSG:32633
  geofield import walk_round.gpx trees.csv -o field.gpkg
  geofield import TASKDATA/ -o field.gpkg && geofield tracks field.gpkg --spacing 3 -o field.gpkg
""",
)
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=PATH)
@output_option("GeoPackage to write.")
@click.option("--crs", help="CRS of files that do not say theirs, e.g. EPSG:32633.")
@click.option("--name", callback=without_blanks, help="The field's name.")
@click.option(
    "--overwrite",
    is_flag=True,
    help="Replace a file that is there already; `geofield undo` brings it back.",
)
@click.option("--json", "as_json", is_flag=True, help="Print what was found as JSON on stdout.")
def import_(
    files: tuple[Path, ...],
    output: Path,
    crs: str | None,
    name: str | None,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Read boundaries, obstacles and guidance lines from other programs' files.

    FILE is a Shapefile, GeoPackage, GeoJSON, KML, GPX, GeoParquet, FlatGeobuf, DXF, ISOXML
    TASKDATA, AgOpenGPS field, a CSV table with lat and lon (or WKT), or what else GDAL finds shapes
    in (GML, MapInfo, a file geodatabase), in any CRS. Several files make one field: the boundary
    from one, the obstacles from another. A lone polygon, or line of GPX or DXF that ends where it
    began, is the field; of several, whole words of the layers' names (boundary, trees), their
    columns, and what lies in what decide. What was taken as what is said on stderr.
    """
    from geofield.formats import write_dataset
    from geofield.formats.importing import read_together, recorded
    from geofield.plan_files import staged_plan

    claim_plan(output, overwrite=overwrite, inputs=files)
    dataset = recorded(read_together(files, crs=crs, name=name))
    with staged_plan(output, overwrite=overwrite, inputs=files) as staging:
        shown = {"picture": dataset.picture_lies_in(output.parent)}
        write_dataset(dataset, staging, ["gpkg"], stem=output.stem, options=shown)
    for note in dataset.notes:
        say(note)
    counts = {layer: len(table) for layer, table in dataset.tables.items() if len(table)}
    if as_json:
        echo_json(
            {
                "files": [str(output)],
                "name": dataset.name,
                "rows": counts,
                "taken": list(dataset.notes),
            }
        )
        return
    found = ", ".join(
        counted(count, layer.replace("_", " ").removesuffix("s")) for layer, count in counts.items()
    )
    say(f"{dataset.name}: {found} in {output}")
