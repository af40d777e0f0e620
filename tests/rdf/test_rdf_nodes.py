"""Columns of texts joined into lists of values."""

from __future__ import annotations

import pyarrow as pa

from geofield.formats.rdf.nodes import join_values


def test_join_values_keeps_rows_without_any_value() -> None:
    first, second = pa.array(["a", None, "b"]), pa.array([None, None, "c"])
    assert join_values([first, second], ", ").to_pylist() == ["a", None, "b, c"]
    assert join_values([first], ", ").to_pylist() == ["a", None, "b"]
