"""What is written when all places have a status: files made from the whole farm."""

from __future__ import annotations

from geofield.farm.failed import write_failed
from geofield.farm.places import Places
from geofield.farm.store import Store


def finish(store: Store, places: Places) -> list[str]:
    """Write what is made from the whole farm; the names of the files.

    Parameters
    ----------
    store : Store
    places : Places
        That were asked for.
    """
    return write_failed(store, places)
