"""Finding a format: by its name, or by what a file or folder holds."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType

from geofield.errors import FormatError, MissingFileError, UnknownFormatError
from geofield.formats.catalogue import CATALOGUE
from geofield.formats.format import Drop, Format
from geofield.strangers import check_vector, is_geopackage, unreadable
from geofield.wording import command

__all__ = [
    "FORMATS",
    "Drop",
    "Format",
    "detect",
    "format_named",
    "product_files",
    "products",
    "task_file",
]

_TASK_DATA = b"ISO11783_TaskData"
_SHEETS = (".xlsx", ".xls", ".ods")

#: Every format by its name.
FORMATS: Mapping[str, Format] = MappingProxyType({each.name: each for each in CATALOGUE})

#: Of other programs, as GML and MapInfo: whatever GDAL finds shapes in is read, and never written.
OTHER = Format(
    "other",
    "vector file of another program",
    (),
    (),
    "",
    "geofield.formats.foreign:read_layers",
    asks_crs=True,
)
#: What a file is called that some format reads.
_READ = {suffix for each in CATALOGUE if each.reader for suffix in each.suffixes}


def format_named(name: str) -> Format:
    """The format of a name.

    Raises
    ------
    UnknownFormatError
        When there is none; says which name is nearest.
    """
    key = str(name).strip().lower()
    if key in FORMATS:
        return FORMATS[key]
    names = {each: each for each in FORMATS}
    names |= {suffix.lstrip("."): f.name for f in FORMATS.values() for suffix in f.suffixes}
    names |= {f.title.lower(): f.name for f in FORMATS.values()}
    near = difflib.get_close_matches(key, list(names), n=1, cutoff=0.5)
    hint = f"Did you mean {names[near[0]]!r}? " if near else ""
    raise UnknownFormatError(
        f"There is no format {name!r}.", hint=f"{hint}Formats: {', '.join(FORMATS)}."
    )


def detect(path: Path | str) -> Format:
    """The format of a file or folder, by its suffix and content.

    Raises
    ------
    FormatError
        When there is no such file, or nothing here reads it.
    """
    place = Path(path)
    if not place.exists():
        raise MissingFileError(f"There is no file {place}.", hint="Check the path.")
    if place.is_dir():
        return _detect_folder(place)
    for each in FORMATS.values():
        # Known by their names alone: a report is no GeoJSON.
        if each.reader is None and place.name in {Path(file).name for file in each.files}:
            return each
    suffix = place.suffix.lower()
    if suffix == ".xml" and _TASK_DATA in _head(place):
        return _isoxml_of(_head(place))
    for each in FORMATS.values():
        if suffix in each.suffixes:
            return each
    return _by_content(place)


def _by_content(place: Path) -> Format:
    """The format of a file whose suffix tells none."""
    if is_geopackage(place):
        return format_named("gpkg")
    if place.name in ("Field.txt", "Boundary.txt", "TrackLines.txt"):
        return format_named("agopengps")
    if _has_shapes(place):
        return OTHER
    if place.suffix.lower() in _SHEETS:
        raise FormatError(
            f"{place} is a spreadsheet.", hint="Save the sheet as a CSV file (UTF-8)."
        )
    raise FormatError(
        f"The format of {place} is not known.",
        hint=f"Read are {', '.join(sorted(_READ))}. Of what else GDAL reads, `ogr2ogr NAME.gpkg "
        "FILE` makes a GeoPackage.",
    )


def products(paths: Iterable[Path]) -> list[Path]:
    """Paths without other files that are read along with one before them."""
    first: dict[str, Path] = {}
    return [path for path in paths if first.setdefault(_product_of(path), path) == path]


def _product_of(file: Path) -> str:
    """What a file is a part of: the files of a product that lie side by side are read together."""
    text = str(file.absolute())
    for each in FORMATS.values():
        ends = each.files if each.reader and len(each.files) > 1 and not each.reads_folders else ()
        for end in ends:
            if text.endswith(end):
                return text.removesuffix(end)
    return text


def product_files(place: Path, found: Format) -> list[Path]:
    """What a format reads of a path: the path, or the one product in that folder.

    Its reader is given the first.

    Raises
    ------
    FormatError
        When the folder holds several.
    """
    if not place.is_dir() or found.reads_folders:
        return [place]
    files = files_of(place, found)
    if len(products(files)) != 1:
        told = f"{place} holds {len(files)} files ({found.title})."
        raise FormatError(told, hint="Name one of them.")
    return files


def files_of(folder: Path, found: Format) -> list[Path]:
    """The files of a folder that a format reads; a file geodatabase is one itself."""
    inside = sorted(folder.iterdir())
    if found.suffixes:
        return [file for file in inside if file.suffix.lower() in found.suffixes]
    if _has_shapes(folder):
        return [folder]
    # The .mif and .mid of MapInfo are one.
    return list({file.stem: file for file in inside if file.is_file() and _opens(file)}.values())


def refuse_no_rows(path: Path) -> None:
    """Refuse where rows are wanted a file or folder of a field that only `read_dataset` reads.

    Raises
    ------
    FormatError
    """
    try:
        found = detect(path)
    except FormatError:
        return
    if not found.tabular:
        raise FormatError(
            f"{path} ({found.title}) is not read as rows of fields or obstacles.",
            hint=f"Name the plan that `{command('import', path, '-o', 'field.gpkg')}` makes of it.",
        )


def passed_over(folder: Path, found: Format) -> list[str]:
    """The files of a folder that other formats than the one found read; beside a plan, none."""
    if found.name == "gpkg":
        return []  # they are its products
    others = _READ - set(found.suffixes)
    return sorted(file.name for file in folder.iterdir() if file.suffix.lower() in others)


def task_file(path: Path) -> Path:
    """The ``TASKDATA.XML`` that a path means: itself, in it, or in its ``TASKDATA`` folder."""
    if path.is_file():
        return path
    for folder in (path, *(p for p in sorted(path.iterdir()) if p.name.upper() == "TASKDATA")):
        for file in sorted(folder.iterdir()):
            if file.name.upper() == "TASKDATA.XML":
                return file
    raise FormatError(
        f"{path} holds no TASKDATA.XML.", hint="Name the folder TASKDATA of a terminal or stick."
    )


def _detect_folder(folder: Path) -> Format:
    names = {path.name.upper() for path in folder.iterdir()}
    if "TASKDATA.XML" in names or "TASKDATA" in names:
        return _isoxml_of(_head(task_file(folder)))
    deeper = (place for depth in ("*", "*/*") for place in folder.glob(f"{depth}/Field.txt"))
    if {"FIELD.TXT", "BOUNDARY.TXT"} & names or any(deeper):
        return format_named("agopengps")
    if "FARM.JSON" in names and "FARM.GPKG" not in names:
        raise FormatError(
            f"{folder} is a farm without its overview, farm.gpkg.",
            hint="The same `geofield batch` writes one; `geofield export` takes the farm as it is.",
        )
    suffixes = {Path(name).suffix.lower() for name in names}
    for each in FORMATS.values():
        if each.reader is not None and suffixes & set(each.suffixes):
            return each
    if files_of(folder, OTHER):
        return OTHER
    raise FormatError(
        f"{folder} holds no product that is known.", hint="Name one of its files instead."
    )


def _has_shapes(place: Path) -> bool:
    """Whether GDAL finds a layer with shapes in a file or folder, such as a file geodatabase."""
    import pyogrio

    check_vector(place)
    try:
        return any(kind is not None for _, kind in pyogrio.list_layers(place))
    except pyogrio.errors.DataSourceError:
        return False
    except pyogrio.errors.DataLayerError as error:  # of a kind of shapes that pyogrio does not know
        raise unreadable(place, error) from None


def _opens(file: Path) -> bool:
    """Whether shapes are found in a file, and nothing in it is refused."""
    try:
        return _has_shapes(file)
    except FormatError:
        return False


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(4096)


def _isoxml_of(head: bytes) -> Format:
    version = re.search(rb"""VersionMajor=["'](\d)""", head)
    old = version is not None and version.group(1) in (b"1", b"2", b"3")
    return format_named("isoxml-v3" if old else "isoxml")
