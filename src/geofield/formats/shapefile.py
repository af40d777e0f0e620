"""ESRI Shapefiles: WGS 84, explicit short names, in the profiles that programs want."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pyproj import CRS

from geofield.errors import FormatError
from geofield.formats.foreign import RawLayer, files_in, read_foreign, read_vector
from geofield.formats.many import last_imagery_day, owner_of
from geofield.formats.shapefile_layer import (
    ShapefileLayer,
    check_limits,
    identified,
    merged,
    write_shapefile,
)
from geofield.formats.shapefile_profiles import GENERIC, PROFILES
from geofield.formats.zipped import archived
from geofield.model import Dataset

#: The user's columns by those that the generic profile makes of them.
_OWNER = {"CLIENT": "customer", "FARM": "farm"}


def write(
    datasets: Sequence[Dataset], folder: Path, *, stem: str, options: Mapping[str, Any]
) -> list[Path]:
    """Write Shapefiles; those of several fields hold the rows of all where the profile's names do.

    Options: ``profile`` (``generic``, ``tracklead`` or ``aggps``), ``customer`` and ``farm``
    (names for terminals), ``zip`` (true: one archive without sub-folders).
    """
    profile = str(options.get("profile", "generic"))
    if profile not in PROFILES:
        raise FormatError(
            f"There is no Shapefile profile {profile!r}.", hint=f"Profiles: {', '.join(PROFILES)}."
        )
    layers: list[ShapefileLayer] = []
    for dataset in datasets:
        customer, farm = owner_of(dataset, options)
        own = list(PROFILES[profile](dataset, customer, farm))
        layers += [identified(each, dataset) for each in own] if len(datasets) > 1 else own
    layers = merged(layers)
    for layer in layers:
        check_limits(layer)
    day = last_imagery_day(datasets)
    written: list[Path] = []
    for layer in layers:
        written += write_shapefile(layer, folder / layer.path, day)
    if options.get("zip"):
        return [archived(written, folder / f"{stem}_shapefile.zip", day=day)]
    return written


def read(path: Path, *, crs: CRS | None = None) -> Dataset:
    """The dataset in a Shapefile, or in all Shapefiles of a folder."""
    return read_foreign([_raw(file) for file in files_in(path, ".shp")], path, crs=crs)


def _raw(file: Path) -> RawLayer:
    frame = read_vector(file)
    layer = GENERIC.get(file.stem.lower())
    if layer is None:
        return RawLayer(file.stem, frame)
    back = {column.shapefile: column.name for column in layer.columns}
    if not set(frame.columns) >= set(back):
        return RawLayer(file.stem, frame)
    # Whose the field is stood in the user's own columns, or was said for the export.
    back |= {name: own for name, own in _OWNER.items() if name in frame and frame[name].any()}
    frame = frame.rename(columns=back).drop(columns=[*_OWNER, "FIELD"], errors="ignore")
    return RawLayer(layer.name, frame)
