"""Names: stable IRIs of a field and its parts under a base the user sets.

::

    {base}field/{field_id}                     the field
    {field}/obstacle/3                         an obstacle, whoever planned the tracks
    {field}/track/7/segment/2                  a part of the plan
    {field}/plan/{plan}/track/7                the same part of another planner's plan
    {feature}/geometry                         its geometry in CRS84
    {feature}/geometry/EPSG-32636              its geometry in the metric CRS
"""

from __future__ import annotations

import re
from urllib.parse import quote

from geofield.errors import FormatError
from geofield.formats.rdf.namespaces import DEFAULT_BASE

#: What an IRI of this project's bases may hold: RFC 3986 characters, nothing to escape.
_BASE = re.compile(r"https?://[A-Za-z0-9._~:@\[\]-]+(?:/[A-Za-z0-9._~!$()*+,;=:@%-]*)*")
#: Characters that no RDF syntax allows inside an IRI.
NOT_IN_IRI = re.compile(r"[\x00-\x20<>\"{}|^`\\]")


def check_base(base: str | None) -> str:
    """A base as given by the user, ending in ``/``.

    Raises
    ------
    FormatError
        When it is not an absolute http(s) IRI without query, fragment and spaces.
    """
    if base is None or not base:
        return DEFAULT_BASE
    if not _BASE.fullmatch(base):
        raise FormatError(
            f"The base IRI {base!r} cannot name features.",
            hint="Use an absolute address without spaces, query or '#', for instance "
            "https://data.my-farm.example/.",
        )
    return base if base.endswith("/") else base + "/"


def path_part(text: str) -> str:
    """Any text as one path segment of an IRI; what is not plain is percent-encoded."""
    encoded = quote(text, safe="")
    # "." and ".." would be resolved away by every reader.
    return encoded.replace(".", "%2E") if set(encoded) <= {"."} else encoded


def field_iri(base: str, field_id: str) -> str:
    """The IRI of a field."""
    return f"{base}field/{path_part(field_id or 'field')}"


def plan_iri(field: str, plan: str) -> str:
    """Under which the parts of a plan are named: the field itself for geofield's own plan."""
    return f"{field}/plan/{path_part(plan)}" if plan else field
