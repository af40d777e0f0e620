"""What the stages told of many fields: each kind of note once, with the fields that have it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from geofield.cli.console import say_note
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


def _of_farm(store: Store, places: Places) -> Iterator[tuple[str, list[str]]]:
    import pyarrow.compute as pc

    from geofield.farm.folder import STATUS, read_parts

    called = labels(places)
    # That parcels overlap was told before the work.
    known = {places.ids[at].as_py(): words for at, words in places.remarks.items()}
    rows: list[dict[str, Any]] = []
    for _, table in read_parts(store, STATUS, ["field_id", "notes", "reviewed", "place"]):
        rows += table.filter(pc.is_valid(table["notes"])).to_pylist()
    for row in sorted(rows, key=lambda row: (not row["reviewed"], row["place"])):
        words = row["notes"].removeprefix(known.get(row["field_id"], "")).removeprefix("; ")
        if words:
            yield called.get(row["field_id"], row["field_id"]), _BETWEEN.split(words)
