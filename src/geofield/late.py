"""Names of a package whose modules load when they are first used, so that importing it is quick."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def late_names(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """What a package gives as its ``__getattr__`` (PEP 562).

    `package` is its ``__name__``, `homes` the names in each module as seen from the package.
    """
    home = {name: module for module, names in homes.items() for name in names.split()}

    def get(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        try:
            module = import_module(f".{home[name]}", package)
        except AttributeError as error:
            # Python would say that the package has no such name, and hide why.
            raise ImportError(f"{package}.{home[name]} does not load: {error}") from error
        # Kept, so that a submodule of the same name never stands before it.
        value = getattr(module, name)
        setattr(sys.modules[package], name, value)
        return value

    return get
