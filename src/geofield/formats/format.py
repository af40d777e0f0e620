"""What a format is: its names, what it carries and drops, who writes, reads and checks it.

Nothing heavy is imported before a format is used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path, PurePath
from pkgutil import resolve_name
from typing import Any, Literal

from geofield import schema
from geofield.errors import FormatError
from geofield.model import Dataset

Writer = Callable[..., list[Path]]
Reader = Callable[..., Dataset]
Validator = Callable[[Path], Iterable[Any]]

#: The parts of a Shapefile, and the index that other programs put beside it.
_BESIDE_SHP = (".shx", ".dbf", ".prj", ".cpg", ".qix")


@dataclass(frozen=True, slots=True)
class Drop:
    """Something that a format cannot carry.

    Attributes
    ----------
    words : str
        For people: "the confidence of obstacles".
    when : str
        Which datasets have it: a layer (``gaps``), a column with values
        (``obstacles.confidence``), ``provenance``, ``polygons`` (obstacles that are not
        circles), ``passed`` (obstacles that are not driven around), ``outside`` (those of
        which no part lies in the field), ``own`` (columns that are not geofield's;
        ``tracks.own`` those of a layer) or ``parts`` (a headland that leaves the field in several).
    """

    words: str
    when: str

    def __str__(self) -> str:
        return self.words


@dataclass(frozen=True, slots=True)
class Format:
    """One product format.

    Attributes
    ----------
    name : str
        As the user writes it.
    title : str
        For people.
    files : tuple of str
        What is written, relative to the output folder; ``{stem}`` is the product's name.
    layers : tuple of str
        The layers of `geofield.schema` that it carries.
    writer : str
        ``module:function`` with the signature
        ``write(dataset, folder, *, stem, options) -> list[Path]``: writes into the empty
        staging folder and returns what it wrote.
    reader : str or None
        ``module:function`` with the signature ``read(path) -> Dataset``; None where the
        format cannot be imported.
    several : str or None
        ``module:function`` with the signature ``several(path) -> list of (name, read)``: the
        fields in a file, each with what reads it, where the reader alone takes a lone field.
    suffixes : tuple of str
        By which a file is recognised; with the dot, lower case.
    drops : tuple of Drop
        What it cannot carry, besides the layers that are not in `layers`.
    precision_m : float or None
        How far a coordinate may move on the way out and back, metres; None where there is
        no way back.
    crs : str
        ``metric`` or ``WGS 84``.
    options : tuple of str
        The options its writer understands.
    asks_crs : bool
        Whether its reader takes a ``crs`` for files that do not say theirs.
    tabular : bool
        Whether GDAL and others read its files as tables of rows, each of which may be a field.
    reads_folders : bool
        Whether its reader takes a folder of files; else a folder must hold just one.
    automatic : bool
        Whether every run writes it, asked or not.
    fields : {"one", "apart", "many", "joined"}
        How several fields get into it: one product each, the writer being told one name for all
        (``one``) or writing each under its own (``apart``); all in one by the writer, which
        then takes a sequence of datasets (``many``); all in one as a dataset with ``field_id``
        in every row (``joined``).
    steers : bool
        Whether machines are steered along its lines: of tracks that run through an obstacle it is
        not written.
    pictured : bool
        Whether it shows the picture of a plan.
    drawn_by : str or None
        A library that draws it and is not installed with geofield: it comes with the extra `plot`.
    validator : str or None
        ``module:function`` with the signature ``check(path) -> Iterable[Finding]``: the rules
        of the format itself. A `FormatError` is a finding, too.
    """

    name: str
    title: str
    files: tuple[str, ...]
    layers: tuple[str, ...]
    writer: str
    reader: str | None = None
    suffixes: tuple[str, ...] = ()
    drops: tuple[Drop, ...] = ()
    precision_m: float | None = None
    crs: str = "WGS 84"
    options: tuple[str, ...] = ()
    asks_crs: bool = False
    validator: str | None = None
    tabular: bool = True
    reads_folders: bool = False
    automatic: bool = False
    fields: Literal["one", "apart", "many", "joined"] = "one"
    steers: bool = False
    several: str | None = None
    pictured: bool = False
    drawn_by: str | None = None

    def places(self, folder: Path) -> set[Path]:
        """The files of a product in a folder that all plans give one name, by their layers."""
        names = {
            file.replace("<layer>", layer.name)
            for file in self.files
            if "{stem}" not in file and "<name>" not in file
            for layer in schema.LAYERS
        }
        beside = {
            str(PurePath(name).with_suffix(suffix))
            for name in names
            if name.endswith(".shp")
            for suffix in _BESIDE_SHP
        }
        return {folder / name for name in names | beside}

    def refuse_undrawn(self) -> None:
        """Refuse what nothing here draws, before any work is done.

        Raises
        ------
        FormatError
        """
        if self.drawn_by is not None and find_spec(self.drawn_by) is None:
            raise FormatError(
                f"{self.title} needs {self.drawn_by}.", hint="pip install 'geofield[plot]'"
            )

    def load_writer(self) -> Writer:
        """The writer, imported.

        Raises
        ------
        FormatError
            When a library that it draws with is not installed.
        """
        self.refuse_undrawn()
        return resolve_name(self.writer)  # type: ignore[no-any-return]

    def load_reader(self) -> Reader:
        """The reader, imported.

        Raises
        ------
        FormatError
            When the format cannot be imported.
        """
        if self.reader is None:
            raise FormatError(
                f"{self.title} can be written, not read.",
                hint="`geofield formats` lists what can be read. Of what else GDAL reads, "
                "`ogr2ogr NAME.gpkg FILE` makes a GeoPackage (-a_srs EPSG:CODE where it does not "
                "say its CRS).",
            )
        return resolve_name(self.reader)  # type: ignore[no-any-return]

    def readers(self, path: Path) -> list[tuple[str, Callable[[], Dataset]]]:
        """What reads each field in a file, with its name; none where only a lone one is read."""
        return [] if self.several is None else list(resolve_name(self.several)(path))

    def load_validator(self) -> Validator | None:
        """The check of the format's own rules, imported; None where there is none."""
        return None if self.validator is None else resolve_name(self.validator)
