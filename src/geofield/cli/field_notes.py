"""What the stages told of many fields: each kind of note once, with the fields that have it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from geofield.cli.console import say_note
from geofield.errors import GeofieldWarning
from geofield.notes import listening, warn
from geofield.wording import counted, some_of

if TYPE_CHECKING:
    from geofield.farm.places import Places
    from geofield.farm.store import Store

#: Kinds of notes that are told, and fields that are named of each beside the first.
_KINDS, _FIELDS = 10, 5
#: Between the notes of a field in a farm's status, each of which is a sentence.
_BETWEEN = re.compile(r"(?<=\.); ")
_NUMBER = re.compile(r"\d+(?:[.,]\d+)*")


def tell_fields(told: Iterable[tuple[str, Iterable[str]]], where: str) -> None:
    """Tell the notes of fields: a line for those that differ in nothing but their numbers.

    Parameters
    ----------
    told : iterable of (str, iterable of str)
        The name of each field, and its notes.
    where : str
        More kinds of notes than are told here are kept.
    """
    kinds: dict[str, tuple[str, dict[str, None]]] = {}
    for name, notes in told:
        for note in notes:
            _, names = kinds.setdefault(_NUMBER.sub("0", note), (f"{name}: {note}", {}))
            names[name] = None
    for first, names in list(kinds.values())[:_KINDS]:
        others = [*names][1:]
        say_note(f"{first} Likewise {some_of(others, _FIELDS)}." if others else first)
    if len(kinds) > _KINDS:
        left = counted(len(kinds) - _KINDS, "further kind of note is", "further kinds of notes are")
        say_note(f"{left} kept {where}.")


@contextmanager
def telling(kept: list[str]) -> Iterator[None]:
    """Keep what there is to tell of one field; it is told at the end of the block."""
    heard: list[GeofieldWarning] = []
    try:
        with listening() as heard:
            yield
    finally:
        kept += map(str, heard)
        for note in heard:
            warn(str(note), type(note))


def tell_farm(store: Store, places: Places, where: str = "in the farm's status") -> None:
    """Tell the notes of a farm's fields, those that a person reviewed first."""
    tell_fields(_of_farm(store, places), where)


def labels(places: Places) -> dict[str, str]:
    """What to call each place, by its id: its name, with an id that is given or tells it apart."""
    ids, names = places.ids.to_pylist(), places.names.to_pylist()
    count = Counter(names)
    return {
        one: f"{name} ({one})" if name != one and (places.ids_given or count[name] > 1) else name
        for one, name in zip(ids, names, strict=True)
    }


def remarks(places: Places) -> dict[str, str]:
    """What was told of single places before the work, by their ids."""
    return {places.ids[at].as_py(): words for at, words in places.remarks.items()}


def notes_in(words: str | None, remark: str = "") -> list[str]:
    """The notes of a field in a farm's status, without what was told of it before the work."""
    words = (words or "").removeprefix(remark).removeprefix("; ")
    return _BETWEEN.split(words) if words else []


def _of_farm(store: Store, places: Places) -> Iterator[tuple[str, list[str]]]:
    import pyarrow.compute as pc

    from geofield.farm.folder import STATUS, read_parts

    called = labels(places)
    # That parcels overlap was told before the work.
    known = remarks(places)
    rows: list[dict[str, Any]] = []
    for _, table in read_parts(store, STATUS, ["field_id", "notes", "reviewed", "place"]):
        rows += table.filter(pc.is_valid(table["notes"])).to_pylist()
    for row in sorted(rows, key=lambda row: (not row["reviewed"], row["place"])):
        one = row["field_id"]
        yield called.get(one, one), notes_in(row["notes"], known.get(one, ""))
