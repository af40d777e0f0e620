"""PROJ's data for what GDAL asks PROJ without saying where they lie."""

from __future__ import annotations

import ctypes
from pathlib import Path

import rasterio

_NAMES = ("internal_proj_context_set_search_paths", "proj_context_set_search_paths")


def find_proj_data() -> None:
    """Tell the PROJ that comes with rasterio where its data are.

    rasterio tells it to GDAL's own contexts alone. What reads the units of a GeoTIFF makes another
    one, which complained on stderr ("Cannot find proj.db") of kilometres. A variable of the
    environment would tell the PROJ of other libraries, too, whose data may be of another version.
    """
    package = Path(rasterio.__file__).parent
    data = package / "proj_data"
    if not data.is_dir():
        return  # a build that has PROJ from elsewhere, which knows its own
    libraries = [package.with_name("rasterio.libs"), package / ".dylibs"]
    for file in [path for folder in libraries for path in folder.glob("*proj*")]:
        library = ctypes.CDLL(str(file))  # loaded already: it is the same one
        setter = next((getattr(library, name) for name in _NAMES if hasattr(library, name)), None)
        if setter is not None:
            setter.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.POINTER(ctypes.c_char_p)]
            setter.restype = None
            # Of the default context, which every further one is a copy of.
            setter(None, 1, (ctypes.c_char_p * 1)(str(data).encode()))
