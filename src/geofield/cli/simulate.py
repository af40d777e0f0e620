"""``geofield simulate``: synthetic fields with known truth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from geofield.cli.console import echo_json, progress_bar, say, say_note
from geofield.cli.files import FOLDER, claim_folder
from geofield.cli.options import Number
from geofield.simulate import CLIMATES, SimulatedField, SimulationSettings, simulate_fields
from geofield.staging import staged_folder
from geofield.wording import counted


@click.command(
    epilog="""\b
Examples:
  geofield simulate --fields 51 --seed 7 --out sim/
  geofield simulate --fields 1 --seed 3 --climate dry --trees 12 --out one/
"""
)
@click.option(
    "--fields", default=1, show_default=True, type=click.IntRange(1, 10_000), help="How many."
)
@click.option(
    "--seed",
    default=1,
    show_default=True,
    type=click.IntRange(min=0),
    help="The same seed gives the same fields.",
)
@click.option(
    "--size",
    "size_px",
    default=640,
    show_default=True,
    type=click.IntRange(64, 20_000),
    help="Side of each picture, pixels.",
)
@click.option(
    "--resolution",
    "resolution_m",
    default=0.6,
    show_default=True,
    type=Number(0.05, 5),
    help="Metres per pixel.",
)
@click.option(
    "--trees",
    "obstacles",
    type=click.IntRange(0, 5000),
    help="Trees per field; drawn by lot when not given.",
)
@click.option(
    "--climate",
    type=click.Choice(CLIMATES),
    help="Colours of the ground; drawn by lot when not given.",
)
@click.option(
    "--equal-brightness",
    is_flag=True,
    help="All neighbours at the field's grey level (else every third field).",
)
@click.option(
    "--nir/--no-nir", default=True, show_default=True, help="With the near infrared band."
)
@click.option(
    "--lat",
    default=35.075373,
    show_default=True,
    type=Number(-80, 84),
    help="Latitude of the pictures' centre.",
)
@click.option(
    "--lon",
    default=33.531142,
    show_default=True,
    type=Number(-180, 180),
    help="Longitude of the pictures' centre.",
)
@click.option("--out", required=True, type=FOLDER, help="Folder to write.")
@click.option("--overwrite", is_flag=True, help="Replace what an earlier run wrote there.")
@click.option("--json", "as_json", is_flag=True, help="List what was written as JSON on stdout.")
def simulate(
    fields: int,
    seed: int,
    size_px: int,
    out: Path,
    overwrite: bool,
    as_json: bool,
    **asked: Any,
) -> None:
    """Make synthetic fields: field_1.tif, its truth field_1.gpkg, ..., and seeds.csv.

    The truth has the layers field and obstacles, as `geofield evaluate` reads them.
    """
    import pandas as pd

    settings = SimulationSettings(width_px=size_px, height_px=size_px, **asked)
    claim_folder(out)
    rows: list[dict[str, Any]] = []
    with staged_folder(out, overwrite=overwrite) as folder, progress_bar(quiet=as_json) as progress:
        for one in simulate_fields(fields, seed, settings):
            rows.append(_write(one, folder, f"field_{len(rows) + 1}"))
            progress(len(rows), fields, "fields")
        pd.DataFrame(rows).to_csv(folder / "seeds.csv", index=False, lineterminator="\r\n")
    wanted, least = asked["obstacles"], min(row["obstacles"] for row in rows)
    if wanted is not None and least < wanted:
        say_note(f"Not every field has room for {counted(wanted, 'tree')}: one has {least}.")
    if as_json:
        echo_json(rows)
        return
    trees = sum(row["obstacles"] for row in rows)
    wrote = counted(fields, "field")
    say(f"Wrote {wrote} with {counted(trees, 'tree')} to {out}/; points are in seeds.csv.")


def _write(one: SimulatedField, folder: Path, name: str) -> dict[str, Any]:
    from geofield.formats import write_dataset
    from geofield.imagery import write_scene
    from geofield.plan import Plan

    write_scene(one.scene, folder / f"{name}.tif")
    dataset = Plan(field=one.field, obstacles=one.obstacles, source=one.scene.source).to_dataset()
    write_dataset(dataset, folder, ["gpkg"], stem=name)
    return {
        "name": name,
        "image": f"{name}.tif",
        "truth": f"{name}.gpkg",
        "lat": round(one.lat, 7),
        "lon": round(one.lon, 7),
        "obstacles": len(one.obstacles),
        "area_ha": round(one.field.area_ha, 4),
    }
