"""What the bands of a picture show: red, green, blue, near infrared, grey, mask.

Given roles win, then band descriptions, then the file's colour interpretation, then the
number of bands. A band marked as alpha is believed only when its values look like a mask:
four-band aerial imagery often carries its near infrared band under that mark.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from geofield.errors import ImageryError
from geofield.wording import nearest

#: A mask is opaque or transparent nearly everywhere; feathered edges are thin.
_MASK_SHARE = 0.9
#: What an opaque pixel of a mask holds, whatever the type of the bands beside it.
OPAQUE = (1, 255, 32767, 65535)

_SPELLINGS = {
    "red": "red r",
    "green": "green g",
    "blue": "blue b",
    "nir": "nir nir1 n near_infrared nearinfrared infrared near_ir",
    "alpha": "alpha mask",
    "grey": "gray grey pan panchromatic",
}
_WORDS = {word: role for role, words in _SPELLINGS.items() for word in words.split()}
#: What the values of a band without a name look like; flat is one value everywhere, as of no mask,
#: empty is 0 everywhere: as a mask it hides the whole picture, which the file has to say itself.
Look = Literal["picture", "mask", "flat", "empty"]
_ROLES = ("red", "green", "blue", "nir", "grey", "alpha", "other")
_SENTINEL_2 = {"b02": "blue", "b03": "green", "b04": "red", "b08": "nir"}
#: Other satellites have bands 2, 3 and 4, too; those of Sentinel 2 go with band 8.
_SHORT = {name.replace("0", ""): role for name, role in _SENTINEL_2.items()}
#: What programs call a band that has no name.
_NUMBERED = re.compile(r"(band|layer|channel)?_?\d+")
_HOW = "name them with --bands (bands= in Python) where this is wrong"


@dataclass(frozen=True, slots=True)
class BandRoles:
    """What each band of a file shows."""

    #: One of `geofield.model.scene.ROLES`, or ``alpha``, per band of the file.
    roles: tuple[str, ...]
    #: What had to be decided or assumed.
    notes: tuple[str, ...] = ()

    @property
    def alpha(self) -> int | None:
        """The 0-based band that masks the others, or None."""
        return self.roles.index("alpha") if "alpha" in self.roles else None

    @property
    def shown(self) -> tuple[int, ...]:
        """The 0-based bands that a scene keeps, in the file's order."""
        kept = tuple(i for i, role in enumerate(self.roles) if role not in ("alpha", "other"))
        return kept or tuple(i for i, role in enumerate(self.roles) if role != "alpha")


def find_roles(
    descriptions: Sequence[str | None],
    interpretation: Sequence[str],
    looks: Sequence[Look],
    given: Sequence[str] | None = None,
) -> BandRoles:
    """Decide what each band shows, by the file's words, GDAL's interpretation and its looks.

    `given` are roles from the user, in the order of the bands; further bands are ``other``.

    Raises
    ------
    ImageryError
        When the given roles are unknown, repeated or more than the bands.
    """
    count = len(interpretation)
    if given:
        names = [text or name for text, name in zip(descriptions, interpretation, strict=True)]
        return BandRoles(_checked(given, names))
    notes: list[str] = []
    described = _from_descriptions(descriptions)
    words = described
    if any(described) and _is_consistent(described):
        if {"red", "green", "blue", "grey", "nir"} & set(described):
            return BandRoles(tuple(role or "other" for role in described))
        described = [""] * count
    roles = [_WORDS.get(name, "") for name in interpretation]
    for i, role in enumerate(roles):
        if role == "alpha" and looks[i] not in ("mask", "empty"):
            roles[i] = ""
            if not words[i]:
                notes.append(
                    f"Band {i + 1} is marked as alpha, but its values are no mask's: not used as "
                    "mask."
                )
        if not roles[i] and described[i] not in roles:
            roles[i] = described[i]
    colours = [role for role in roles if role in ("red", "green", "blue")]
    named = len(set(colours)) == len(colours) == 3
    roles, more = (_complete_colour if named else _from_count)(roles, looks)
    unheard = any(word not in ("", "other", role) for word, role in zip(words, roles, strict=True))
    if unheard or not any(words):
        more = _unheard(descriptions, roles) or more
    return BandRoles(tuple(roles), (*notes, *more))


def look_of(values: NDArray[Any]) -> Look:
    """What a band's values look like: a mask is 0 or one opaque value nearly everywhere."""
    if values.dtype.kind == "f":
        values = values[np.isfinite(values)]
    if values.size == 0:
        return "picture"
    top = values.max()
    if top == values.min() == 0:
        return "empty"
    if top in OPAQUE or (values.dtype.kind in "ui" and top == np.iinfo(values.dtype).max):
        binary = np.count_nonzero((values == 0) | (values == top))
        if binary >= _MASK_SHARE * values.size:
            return "mask"
    return "flat" if values.min() == top else "picture"


def kept_roles(given: Sequence[str]) -> tuple[str, ...]:
    """Of roles as the user gives them those of the bands that a scene keeps."""
    roles = (_WORDS.get(_key(role), "") for role in given)
    return tuple(role for role in roles if role not in ("", "alpha"))


def _checked(given: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """Roles as the user gives them, of bands that the file calls `names`."""
    count = len(names)
    roles = [
        _WORDS.get(_key(role), "other" if role in ("other", "", "-") else "") for role in given
    ]
    has = f"the picture has {count} band{'s' if count != 1 else ''} ({', '.join(names)})"
    if "" in roles:
        unknown = given[roles.index("")]
        raise ImageryError(
            f"Unknown band role {unknown!r}.{nearest(_key(unknown), _WORDS)}",
            hint=f"Use {', '.join(_ROLES)}, in the order of the bands: {has}.",
        )
    repeated = [role for role in roles if role != "other" and roles.count(role) > 1]
    if repeated:
        raise ImageryError(
            f"Two bands are said to be {repeated[0]}.", hint=f"Name each one once: {has}."
        )
    if len(roles) > count:
        raise ImageryError(
            f"{len(roles)} band roles were given, but {has}.", hint=f"Name at most {count}."
        )
    if all(role in ("other", "alpha") for role in roles) and len(roles) >= count:
        raise ImageryError(
            "No band of the picture is left to look at.",
            hint="Name at least one of red, green, blue, nir, grey.",
        )
    return (*roles, *["other"] * (count - len(roles)))


def _key(text: str) -> str:
    return re.sub(r"[\s\-]+", "_", text.strip().lower())


def _from_descriptions(descriptions: Sequence[str | None]) -> list[str]:
    """The role that each band's name tells, "" where it tells none."""
    keys = [_key(text or "") for text in descriptions]
    if set(_SHORT) <= set(keys):
        return [_SHORT.get(key, "") for key in keys]
    return [_from_description(text) for text in descriptions]


def _unheard(descriptions: Sequence[str | None], roles: Sequence[str]) -> tuple[str, ...]:
    """That the names of three bands or more were not gone by, where they have names."""
    names = [text for text in descriptions if text and not _NUMBERED.fullmatch(_key(text))]
    if not names or len(roles) < 3:
        return ()
    return (
        f"The bands' names ({', '.join(names)}) do not tell which is which: taken as "
        f"{', '.join(roles)}; {_HOW}.",
    )


def _from_description(text: str | None) -> str:
    if not text:
        return ""
    key = _key(text)
    if key in _WORDS:
        return _WORDS[key]
    if key in _SENTINEL_2:
        return _SENTINEL_2[key]
    # "Band 1: Red", "B4 (red)"; but not "red edge".
    words = set(re.split(r"[^a-z0-9]+", key.replace("_", " ")))
    if "edge" in words or "rededge" in words:
        return "other"
    found = {_WORDS[word] for word in words if word in _WORDS and len(word) > 2}
    if {"near", "infrared"} <= words or {"near", "ir"} <= words:
        found = {"nir"}
    return found.pop() if len(found) == 1 else ""


def _is_consistent(roles: Sequence[str]) -> bool:
    named = [role for role in roles if role and role != "other"]
    return len(named) == len(set(named)) and (
        {"red", "green", "blue"} <= set(named) or "grey" in named or len(roles) < 3
    )


def _complete_colour(roles: list[str], looks: Sequence[Look]) -> tuple[list[str], tuple[str, ...]]:
    """Bands beside red, green and blue: the first that is a picture is near infrared.

    The last of them is a mask when it looks like one.
    """
    notes: tuple[str, ...] = ()
    if "alpha" not in roles and not roles[-1] and looks[-1] == "mask":
        roles[-1] = "alpha"
    for i in [i for i, role in enumerate(roles) if not role]:
        roles[i] = "other"
        if looks[i] == "picture" and "nir" not in roles and len(roles) - ("alpha" in roles) == 4:
            roles[i] = "nir"
            notes = (f"Band {i + 1} is taken as near infrared; {_HOW}.",)
    return roles, notes


def _from_count(roles: list[str], looks: Sequence[Look]) -> tuple[list[str], tuple[str, ...]]:
    """No colours are named: red, green, blue, near infrared is the common order."""
    pictures = [i for i, role in enumerate(roles) if role != "alpha"]
    # The last of two or four bands without a name is a mask when it looks like one.
    last = pictures[-1] if pictures else 0
    if "alpha" not in roles and len(pictures) in (2, 4) and looks[last] == "mask":
        roles[last] = "alpha"
        pictures = pictures[:-1]
    count = len(pictures)
    is_nir = count == 4 and looks[pictures[3]] not in ("flat", "empty")
    order = ["red", "green", "blue", *["nir"] * is_nir] if count > 2 else ["grey"]
    for n, i in enumerate(pictures):
        roles[i] = order[n] if n < len(order) else "other"
    if count == 2:
        return roles, ("The first of two bands is taken as brightness.",)
    if count > 4:
        return roles, (
            f"The first three of {count} unnamed bands are taken as red, green, blue; {_HOW}.",
        )
    if is_nir:
        return roles, (f"Four unnamed bands are taken as red, green, blue, near infrared; {_HOW}.",)
    return roles, ()
