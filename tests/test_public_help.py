"""help() of every public name begins with an example that runs, and is short."""

from __future__ import annotations

import doctest
import inspect
import pydoc
from pathlib import Path

import pytest

import geofield as gf

ROOT = Path(__file__).parents[1]
NAMES = [name for name in gf.__all__ if name != "__version__"]
#: Lines of a screen.
SCREEN = 50


@pytest.mark.parametrize("name", NAMES)
def test_it_begins_with_an_example_that_runs(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = inspect.getdoc(getattr(gf, name)) or ""
    head = text.split("\nParameters\n")[0].split("\nAttributes\n")[0].split("\nReturns\n")[0]
    assert ">>> " in head
    monkeypatch.chdir(ROOT)
    names = {"gf": gf, name: getattr(gf, name)}
    examples = doctest.DocTestParser().get_doctest(text, names, name, None, None)
    told: list[str] = []
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    failed = doctest.DocTestRunner(optionflags=flags).run(examples, out=told.append)
    assert not failed.failed, "".join(told)


@pytest.mark.parametrize("name", NAMES)
def test_it_fits_two_screens(name: str) -> None:
    one = getattr(gf, name)
    # Of a class: its own words; its methods have theirs.
    text = inspect.getdoc(one) or ""
    shown = text if inspect.isclass(one) else pydoc.plain(pydoc.render_doc(one))
    assert len(shown.splitlines()) <= 2 * SCREEN
