"""Plans of many places, one after the other, as they are ready."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import pandas as pd

from geofield.errors import (
    FieldWarning,
    FormatError,
    GeofieldError,
    ImageryError,
    refuse_other,
)
from geofield.farm.place_reader import read_places
from geofield.farm.places import Place, Places
from geofield.farm.work import Job, in_words, plan_place, told
from geofield.imagery import Imagery
from geofield.known import own_obstacles
from geofield.notes import listening, warn
from geofield.plan import Plan
from geofield.settings import Settings, with_values

#: Places per worker that wait in the scheduler.
_AHEAD = 4
_MAKE_TABLE = "Of shapes make a table: gpd.GeoDataFrame(geometry=shapes, crs=crs)."
_WRITE_IT = "Give the path of a file: table.to_file(path)."


def plan_fields(
    places: str | Path | pd.DataFrame | Places,
    imagery: str | Path | None = None,
    *,
    settings: Settings | None = None,
    obstacles: str | Path | None = None,
    client: Any = None,
    **by_name: Any,
) -> Iterator[Plan]:
    """Plan many fields; each plan is handed out as soon as it is ready.

    >>> for plan in gf.plan_fields("parcels.gpkg", spacing_m=4):      # doctest: +SKIP
    ...     print(plan.field.name, plan.tracks.statistics.length_m)

    A place that cannot be planned gives a warning with the reason, and the others go on.

    Parameters
    ----------
    places : path, DataFrame or Places
        Points (columns lat and lon, or geometry) or parcels, in a file or a table of pandas or
        geopandas; see `geofield batch`.
    imagery : path, optional
        A picture, a folder or an index of pictures. Parcels need none.
    settings : Settings, optional
        Columns of the places that are named like settings win over them.
    obstacles : path, optional
        A file of what to avoid; without one, and without a picture, what stands in the plans that
        the file of the places holds.
    client : distributed.Client, optional
        Of a Dask cluster, whose workers see the same files; here, one after the other, when not
        given. Plans of a cluster come in the order in which they are ready.
    **by_name
        Any setting by its own name: ``spacing_m=4``.

    Yields
    ------
    Plan
        With the place's `field_id`, name and columns.
    """
    settings = with_values(settings, **by_name)
    refuse_other(places, pd.DataFrame | str | Path | Places, "places", _MAKE_TABLE, FormatError)
    refuse_other(obstacles, str | Path | None, "obstacles", _WRITE_IT, FormatError)
    found = places if isinstance(places, Places) else read_places(places, settings=settings)
    if imagery is not None and "://" not in str(imagery) and not Path(imagery).exists():
        raise ImageryError(
            f"There is no picture {imagery}.",
            hint="For other sources use `geofield batch`, or fetch with `geofield tiles`.",
        )
    if obstacles is None and imagery is None:
        obstacles = own_obstacles(Path(found.path))
    job = Job(
        settings,
        None if imagery is None else Imagery(str(imagery)),
        None if obstacles is None else Path(obstacles),
    )
    _ = job.standing  # one that cannot be read is told at once, not for each place
    waiting = iter(found.take(found.order()))
    here = (_one(place, job) for place in waiting)
    for plan, why in here if client is None else _there(waiting, job, client):
        if plan is None:
            warn(why, FieldWarning)
        else:
            if why:
                warn(f"{plan.field.name}: {why}", FieldWarning)
            yield plan


def _one(place: Place, job: Job) -> tuple[Plan | None, str]:
    """A plan and what was told, or no plan and why."""
    with listening() as heard:
        try:
            plan = plan_place(place, job)
        except GeofieldError as error:
            said = in_words(error)
            return None, f"{place.name} ({place.field_id}): {said['error']} {said['hint']}".strip()
    return plan, told(place, heard)


def _there(places: Iterator[Place], job: Job, client: Any) -> Iterator[tuple[Plan | None, str]]:
    """On a cluster, never more than a few places per worker in the scheduler."""
    from distributed import Client, as_completed

    refuse_other(client, Client, "client", "Make one: distributed.Client(address).")
    ahead = max(_AHEAD, _AHEAD * sum(client.nthreads().values()))
    begun = (client.submit(_one, place, job, pure=False) for place in places)
    ready = as_completed(islice(begun, ahead), loop=client.loop)
    for future in ready:
        yield future.result()
        ready.update(islice(begun, 1))
