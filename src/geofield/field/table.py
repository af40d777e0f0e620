"""Table: the learned numbers of `tables/*.json`, which `benchmarks/field_choice.py` writes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib import resources
from typing import Any

from geofield.errors import FieldError


def read_table(name: str, rows: str, names: Sequence[str]) -> dict[str, Any]:
    """A table that has one row for each of the names, in their order.

    Parameters
    ----------
    name : str
        Its file's, without ending.
    rows : str
        The key of its rows.
    names : sequence of str

    Raises
    ------
    FieldError
        When the table is of another version.
    """
    text = (resources.files(__package__) / "tables" / f"{name}.json").read_text("utf-8")
    table: dict[str, Any] = json.loads(text)
    if [row["name"] for row in table[rows]] != list(names):
        raise FieldError(
            f"The table {name}.json is of another version.",
            hint="Run benchmarks/field_choice.py --write.",
        )
    return table
