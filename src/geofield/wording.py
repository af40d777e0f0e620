"""Hints in the words of who reads them: options for the command line, names for Python.

And the nearest name for one that was mistyped.
"""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

_OPTION = re.compile(r"--([a-z][a-z0-9-]*)(?: ([A-Z0-9/](?:[\w:/+-]|\.(?=\w))*|mask\b))?")
#: What an option is called in Python, where that is not its own name with underscores.
_NAMES = {
    "fresh": "previous=None",
    "out": "the folder",
    "overwrite": "overwrite=True",
    "offline": "offline=True",
    "no-cache": "no cache",
    "acknowledge-terms": "acknowledged=True",
    "boundary": "boundary=",
    "boundary-name": "name=",
    "json": "the value itself",
}
_SOURCES: list[Callable[[], Mapping[str, str]]] = []


def nearest(given: str, names: Iterable[str], cutoff: float = 0.6) -> str:
    """A sentence with the nearest of some names, behind a space; nothing where none is near."""
    import difflib

    close = difflib.get_close_matches(given, list(names), n=1, cutoff=cutoff)
    return f" Did you mean {close[0]!r}?" if close else ""


#: What exchanges latitude and longitude in a file of shapes.
SWAP = 'ogr2ogr -ct "+proj=axisswap +order=2,1" NAME.gpkg FILE'


#: The next step where a file does not say its CRS.
NAME_CRS = "Name it: --crs EPSG:4326 for degrees, or, for instance, EPSG:32633 (UTM zone 33 north)."


def command(*words: str | Path) -> str:
    """A command of geofield that can be copied into a shell, whatever its paths are called.

    >>> command("farm", "put", Path("farm.gpkg"), Path("-My farm"))
    "geofield farm put farm.gpkg './-My farm'"
    """
    from subprocess import list2cmdline  # late: most commands tell no other

    # Of a path that begins with a dash an option would be made.
    plain = [
        f"./{word}" if isinstance(word, Path) and str(word).startswith("-") else str(word)
        for word in words
    ]
    return f"geofield {list2cmdline(plain) if os.name == 'nt' else shlex.join(plain)}"


def unlike(
    name: str,
    taken: set[str],
    joint: str,
    *,
    length: int | None = None,
    key: Callable[[str], str] = str.lower,
) -> str:
    """A name that is not taken, with a number behind it where it must have one; taken from now on.

    Parameters
    ----------
    taken : set of str
        Keys of the names that are taken; changed.
    joint : str
        Between name and number.
    length : int, optional
        What the name is cut to where a number comes behind it.
    key : callable
        What must differ; the name in small letters when not given.
    """
    unique, number = name, 1
    while key(unique) in taken:
        number += 1
        unique = f"{name[:length]}{joint}{number}"
    taken.add(key(unique))
    return unique


def cell_text(value: object) -> str:
    """A table's value as a person writes it: 7 in a column of numbers with a point, too.

    >>> cell_text(7.0), cell_text(7.5), cell_text("07")
    ('7', '7.5', '07')
    """
    return f"{value:.0f}" if isinstance(value, float) and value.is_integer() else str(value)


def counted(number: int, one: str, many: str | None = None) -> str:
    """A number and what is counted: its plural is `many`, or ends with an s.

    >>> counted(1, "edit"), counted(3, "edit"), counted(2, "doubt about it", "doubts about it")
    ('1 edit', '3 edits', '2 doubts about it')
    """
    return f"{number} {one if number == 1 else many or f'{one}s'}"


def none_of(number: int, one: str) -> str:
    """That something holds for none of so many.

    >>> none_of(1, "place"), none_of(3, "place")
    ('No place', 'None of the 3 places')
    """
    return f"No {one}" if number == 1 else f"None of the {counted(number, one)}"


def some_of(names: Sequence[str], most: int) -> str:
    """The first names, and how many more there are.

    >>> some_of("abc", 2), some_of("ab", 2)
    ('a, b and 1 more', 'a, b')
    """
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{', '.join(names[:most])}{more}"


def without_shape(rows: Sequence[int], what: str) -> str:
    """What becomes of rows of a file that have no shape, by their numbers from 1.

    >>> without_shape([2, 4], "left out")
    '2 rows have no shape and are left out: rows 2, 4.'
    """
    words = counted(len(rows), "row has no shape and is", "rows have no shape and are")
    which = "row" if len(rows) == 1 else "rows"
    return f"{words} {what}: {which} {some_of([str(row) for row in rows], 5)}."


def names_from(source: Callable[[], Mapping[str, str]]) -> None:
    """Tell who knows what more options are called; that is asked when a message names an option."""
    _SOURCES.append(source)


def in_python(text: str) -> str:
    """A message or hint with names of Python in place of options.

    >>> in_python("Add --layer NAME, or leave out --crs.")
    'Add layer="NAME", or leave out crs.'

    What stands between backticks is a command for a terminal, and stays one.
    """
    parts = text.split("`")
    return "`".join(
        part if number % 2 else _OPTION.sub(_name, part) for number, part in enumerate(parts)
    )


def _name(found: re.Match[str]) -> str:
    option, value = found.groups()
    known = dict(_NAMES)
    for source in _SOURCES:
        known.update(source())
    name = known.get(option, option.replace("-", "_"))
    if value is None:
        return name
    try:
        return f"{name}={float(value):g}" if "." not in value else f"{name}={float(value)}"
    except ValueError:
        return f'{name}="{value}"'
