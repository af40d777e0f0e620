"""What is written when all places have a status: files made from the whole farm."""

from __future__ import annotations

from geofield.farm.failed import write_failed
from geofield.farm.overview import write_overview
from geofield.farm.places import Places
from geofield.farm.stac import write_stac
from geofield.farm.store import Store
from geofield.farm.value import read_farm


def finish(store: Store, places: Places, *, overview: bool = True) -> list[str]:
    """Write what is made from the whole farm; the names of the files.

    Parameters
    ----------
    store : Store
    places : Places
        That were asked for.
    overview : bool
        Whether ``farm.gpkg`` and ``farm.qgz`` are written, where the farm lies on a disk.
    """
    return write_failed(store, places) + renew(store, overview=overview)


def renew(store: Store, *, overview: bool) -> list[str]:
    """Write again what shows the whole farm: its catalogue and its overview."""
    name = store.place.rstrip("/").rsplit("/", 1)[-1]
    files = write_stac(store, name=name)
    if overview and store.folder is not None:
        farm = read_farm(store.folder)
        files += [path.name for path in write_overview(farm, store.folder, name=name)]
    return files
