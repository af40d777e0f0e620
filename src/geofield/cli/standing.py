"""The file of obstacles: which it is, and what of it is not avoided, or not as it is."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from geofield.cli.console import say, say_note
from geofield.cli.files import OLD_PATH
from geofield.wording import counted, none_of, without_shape

if TYPE_CHECKING:
    from geofield.farm.places import Places
    from geofield.farm.work import Job
    from geofield.known import Shapes


obstacles_option = click.option(
    "--obstacles",
    "obstacle_file",
    type=OLD_PATH,
    help="File of what is known to stand there: polygons, points with a radius_m, lines.",
)


def obstacles_for(
    places: Places | None, given: Path | None, *, imagery: str | None = None
) -> Path | None:
    """The file of what stands in fields: the one given, or else that of the places themselves.

    Those of a plan, or of several in one GeoPackage, unless a picture shows what stands there.
    """
    from geofield.known import own_obstacles

    if places is None or given is not None or imagery is not None:
        return given
    own = own_obstacles(Path(places.path))
    if own is not None:
        say(f"Obstacles  those of {own.name}")
    return own


def tell_obstacles(job: Job, *, several: bool) -> None:
    """Read the file of obstacles before the work, and tell what of it is not as it should be.

    Of one field the stage itself tells of points without a radius.
    """
    import shapely
    from pyproj import CRS

    from geofield.datum import datum_notes
    from geofield.known import LAYERS, WITHOUT_SHAPE, unsized_points
    from geofield.model.obstacles import POINT_RADIUS_M

    standing = job.standing
    if job.obstacles is None or standing is None:
        return
    if layers := standing.attrs[LAYERS]:
        say_note(f"{job.obstacles.name}: what all its layers hold is avoided: {', '.join(layers)}.")
    for note in datum_notes(CRS(standing.crs), *shapely.get_coordinates(standing.geometry).T):
        say_note(f"{job.obstacles.name}: {note}")
    if lost := standing.attrs[WITHOUT_SHAPE]:
        words = without_shape(lost, "not avoided")
        say_note(f"{job.obstacles.name}: {words} Draw or delete them.")
    unsized = unsized_points(standing) if several else 0
    if unsized:
        say_note(
            f"{job.obstacles.name}: {counted(unsized, 'point has', 'points have')} no radius_m; "
            f"{'it is a circle' if unsized == 1 else 'they are circles'} of "
            f"{POINT_RADIUS_M:g} m now. Correct them if the trees are larger."
        )


def tell_unreached(job: Job, outlines_lonlat: Iterable[Shapes]) -> None:
    """Tell when nothing of the file of obstacles stands at any field that was planned."""
    from geofield.known import any_reached

    standing = job.standing
    if job.obstacles is None or standing is None:
        return
    if not len(standing):
        say_note(f"{job.obstacles.name} holds no shape: NOTHING of it is avoided.")
    elif not any_reached(standing, outlines_lonlat):
        say_note(
            f"{job.obstacles.name}: {none_of(len(standing), 'obstacle').lower()} in it stands at a "
            "field that was planned, NOTHING of it is avoided. Is its CRS "
            f"{standing.crs.name}, as it says?"
        )
