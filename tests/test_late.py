"""Names that load when they are first used."""

from __future__ import annotations

from pathlib import Path

import pytest

LATE = """from geofield.late import late_names
__getattr__ = late_names(__name__, {"good": "one", "broken": "two"})
"""


def test_why_a_module_does_not_load_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "late_package"
    package.mkdir()
    (package / "__init__.py").write_text(LATE)
    (package / "good.py").write_text("one = 1\n")
    (package / "broken.py").write_text("import math\ntwo = math.no_such_thing\n")
    monkeypatch.syspath_prepend(tmp_path)
    import late_package  # type: ignore[import-not-found]

    assert late_package.one == 1
    with pytest.raises(ImportError, match=r"late_package\.broken does not load: .*no_such_thing"):
        from late_package import two  # noqa: F401
    with pytest.raises(AttributeError, match="no attribute 'three'"):
        _ = late_package.three
