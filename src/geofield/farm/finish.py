"""What is written at the end of a run: files made from the whole farm."""

from __future__ import annotations

from geofield.farm.edits import TAKEN, is_edited
from geofield.farm.failed import write_failed
from geofield.farm.folder import OVERVIEW
from geofield.farm.marks import CHANGED, WORK
from geofield.farm.overview import write_overview
from geofield.farm.places import Places
from geofield.farm.stac import COLLECTION, write_stac
from geofield.farm.store import Store
from geofield.farm.value import read_farm
from geofield.imagery.gdal import display_name


def finish(store: Store, places: Places, *, anew: bool = True, overview: bool = True) -> list[str]:
    """Write what is made from the whole farm; the names of the files.

    `anew` says whether the farm has changed since they were written: else only missing ones are.
    `overview` asks for ``farm.gpkg`` and ``farm.qgz``, where the farm lies on a disk.
    """
    there = store.names("")
    # A run that was killed here, or before it came here, left them as they were.
    anew = anew or store.get(CHANGED) is not None
    written = write_failed(store, places)
    if anew or COLLECTION not in there:
        written += _catalogue(store)
    if overview and (anew or OVERVIEW not in there):
        written += _overview(store)
    if overview or OVERVIEW not in there:
        _forget_change(store)
    return written


def renew(store: Store) -> None:
    """Write anew what is there of these files, when single plans have changed."""
    there = store.names("")
    if COLLECTION in there:
        _catalogue(store)
    if OVERVIEW in there:
        _overview(store)
    _forget_change(store)


def renew_unless_edited(store: Store) -> bool:
    """The same; not while the overview has edits that nobody asked to take in.

    The next run then takes these in first, and writes all anew.
    """
    if store.folder is not None and is_edited(store.folder, store.folder / OVERVIEW):
        return False
    renew(store)
    return True


def _forget_change(store: Store) -> None:
    store.remove(CHANGED)
    if not store.names(WORK):
        store.remove(WORK)


def _catalogue(store: Store) -> list[str]:
    return write_stac(store, name=display_name(store.shown))[:1]


def _overview(store: Store) -> list[str]:
    if store.folder is None:
        return []
    files = write_overview(read_farm(store.place), store.folder, name=store.folder.name)
    store.remove(TAKEN)
    return [file.name for file in files]
