"""Errors and warnings: one base, one-line children, messages with a next step.

A message says what was wrong and where; ``hint`` says what to do next. The command line
prints both and exits with code 1; it never shows a traceback for a :class:`GeofieldError`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial
from math import isfinite, isinf, isnan, nan
from numbers import Real
from typing import Any, get_args

from geofield.wording import in_python

#: As far as anything reaches in a field, metres: more is a slip, and overflows somewhere.
FARTHEST_M = 1000.0


class GeofieldError(Exception):
    """Base of every error that geofield raises on purpose.

    >>> try:
    ...     gf.read_plan("missing.gpkg")
    ... except gf.GeofieldError as error:
    ...     print(error)
    There is no file missing.gpkg. Check the path.

    Parameters
    ----------
    message : str
        What was wrong, and where.
    hint : str, optional
        The next step for the user.
    """

    #: Of the command line: 1 for work that failed, 2 for wrong usage.
    exit_code = 1

    def __init__(self, message: str, *, hint: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        # Whoever reads this text is at Python; the command line takes message and hint.
        return in_python(f"{self.message} {self.hint}" if self.hint else self.message)

    def __reduce__(self) -> tuple[object, ...]:
        # Keyword-only arguments are lost by the default, and pools pickle errors.
        return partial(type(self), hint=self.hint), (self.message,)


def refuse_other(
    value: object, kind: Any, name: str, hint: str, error: type[GeofieldError] = GeofieldError
) -> None:
    """Refuse an argument that is of another kind than a class, or than all of a union."""
    if not isinstance(value, kind):
        wanted, *_ = get_args(kind) or (kind,)
        raise error(f"`{name}` must be a {wanted.__name__}, not {type(value).__name__}.", hint=hint)


def refuse_unknown(
    error: type[GeofieldError], what: str, value: object, choices: Collection[str]
) -> None:
    """Refuse a value that is none of some choices; `what` it would be is told."""
    if value not in choices:
        raise error(f"Unknown {what} {value!r}.", hint=f"Choose one of {', '.join(choices)}.")


def refuse_no_number(
    error: type[GeofieldError],
    wanted: str = "",
    *,
    none_too: bool = False,
    whole: bool = False,
    **values: Any,
) -> None:
    """Refuse arguments, by their names, that are no finite numbers: text, truth, NaN.

    `wanted` says what they are, behind "a number"; `none_too` lets None pass, `whole` no fraction.
    """
    for name, value in values.items():
        endless = is_number(value) and isinf(value)
        known = is_number(value) and not endless and not (whole and value % 1)
        if not (known or (none_too and value is None)):
            kind = "a whole number" if whole else "a finite number" if endless else "a number"
            raise error(
                f"{name} is {value!r}; it must be {kind}{wanted and f', {wanted}'}.",
                hint=f"Write {name}={value}." if _is_written(value) else None,
            )


def is_number(value: Any) -> bool:
    """Whether a value, of Python or an array's, is a number, which True and NaN are not."""
    if not isinstance(value, Real):
        kind = getattr(getattr(value, "dtype", None), "kind", None)
        if getattr(value, "ndim", None) != 0 or kind not in ("i", "u", "f"):
            return False
    return not is_truth(value) and not isnan(value)


def plain_number(value: Any) -> float:
    """A number as a float; not a number for true and false, which nobody means as 1 and 0."""
    return nan if is_truth(value) else float(value)


def is_truth(value: object) -> bool:
    """Whether a value is true or false, of Python or an array's."""
    return isinstance(value, bool) or getattr(getattr(value, "dtype", None), "kind", None) == "b"


def _is_written(value: object) -> bool:
    """Whether text is a number but for its quotes."""
    try:
        return isinstance(value, str) and isfinite(float(value))
    except ValueError:
        return False


class SettingsError(GeofieldError):
    """A setting is unknown, of the wrong type or out of its range."""

    exit_code = 2


class CRSError(GeofieldError):
    """A coordinate reference system is missing, unknown or unfit."""


class CRSMismatchError(CRSError):
    """Two values that must share a coordinate reference system do not."""


class GridError(GeofieldError):
    """A raster's shape or transform is impossible."""


class PointOutsideError(GeofieldError):
    """The point lies outside the picture, or where the picture has no data."""


class ImageryError(GeofieldError):
    """A picture cannot be found, read or used."""


class TermsError(ImageryError):
    """The terms of an imagery source forbid this."""


class NetworkError(ImageryError):
    """A server cannot be reached, or does not give what it should."""


class FieldError(GeofieldError):
    """No field can be taken from the scene at the point."""


class ObstacleError(GeofieldError):
    """Obstacles cannot be detected or understood."""


class TrackError(GeofieldError):
    """Tracks cannot be planned as asked."""


class FormatError(GeofieldError):
    """A product cannot be written, read or validated."""


class ChangedError(FormatError):
    """Another program changed a file since it was read."""


class SeveralFieldsError(FormatError):
    """A file holds several fields where one is wanted.

    `as_obstacles` makes the dataset in which they are obstacles, where another file may have the
    field that they lie in.
    """

    as_obstacles: Callable[[], Any] | None = None


class EmptyFileError(FormatError):
    """A file holds no geometries."""


class UnknownFormatError(FormatError):
    """A format was named that is not there: wrong usage, not work that failed."""

    exit_code = 2


class MissingFileError(FormatError, ImageryError):
    """A file, picture or query was named that is not there: wrong usage, not work that failed."""

    exit_code = 2


class OutputExistsError(FormatError):
    """The product is there already and overwriting was not asked for."""


class GeofieldWarning(UserWarning):
    """Base of every warning that geofield gives.

    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore", gf.GeofieldWarning)
    ...     scene = gf.read_scene("sample_data/field_1.tif")
    """


class ImageryWarning(GeofieldWarning):
    """Imagery is incomplete or was guessed at, or a cache file had to be rebuilt."""


class FieldWarning(GeofieldWarning):
    """The outline of a field should not be trusted unseen."""


class ObstacleWarning(GeofieldWarning):
    """Detection ran outside the range in which it is known to work."""


class TrackWarning(GeofieldWarning):
    """The tracks are valid but not all that was asked for."""


class FormatWarning(GeofieldWarning):
    """A format cannot carry something, or a file leaves room for doubt."""
