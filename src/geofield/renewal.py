"""Products beside a plan: which of them are older than it, and writing them anew."""

from __future__ import annotations

import mmap
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from geofield.formats import FORMATS, Format, read_dataset, write_dataset
from geofield.formats.gpkg_read import scene_beside
from geofield.products import PLAN_FILE, write_report
from geofield.staging import staged_folder, written_ns

#: What is no product of the plan, but the plan itself and what it was made from.
_NOT_RENEWED = ("gpkg", "scene")
#: Both are written under the same names; which one lies there its first bytes tell.
_STUDY_MARK = b"www.DLC.org/Obstacle#"
#: Who made a product stands in it; a DXF has no place for that, but layers of its own.
_MADE_HERE = re.compile(rb"geofield[ /]\d|\nFIELD\r?\n")


def products_beside(plan_file: Path) -> dict[str, list[Path]]:
    """The products of a plan that lie in its folder, by format.

    They carry its name, or one that all plans give alike: those are of the main job's plan where
    it lies there, too. What has its name and was not written by geofield is a person's own, as the
    file that the plan was imported from.
    """
    found = {}
    for each in FORMATS.values():
        files = [] if each.name in _NOT_RENEWED else sorted(_files(each, plan_file))
        if files:
            found[each.name] = files
    if "rdf" in found and "rdf-study" in found:
        del found["rdf" if _is_study(found["rdf"][0]) else "rdf-study"]
    return found


def outdated(plan_file: Path) -> list[str]:
    """The products beside a plan that are older than it, by their names in the folder."""
    if not plan_file.is_file():
        return []
    plan_ns = written_ns(plan_file)
    files = [file for files in products_beside(plan_file).values() for file in files]
    old = [file for file in files if file.stat().st_mtime_ns < plan_ns]
    names = [file.relative_to(plan_file.parent) for file in old]
    return sorted({str(one.parts[0]) + ("/" if len(one.parts) > 1 else "") for one in names})


def renew(plan_file: Path) -> list[Path]:
    """Write all products that lie beside a plan anew, all or nothing; what was written."""
    present = products_beside(plan_file)
    dataset = replace(read_dataset(plan_file), scene_path=scene_beside(plan_file))
    said = dataset.provenance.settings.get("export", {})
    points = isinstance(said, dict) and bool(said.get("points"))
    options = {
        name: {"points": True} for name in present if points and "points" in FORMATS[name].options
    }
    folder = plan_file.parent
    products = [FORMATS[name].places(folder) for name in present]
    with staged_folder(folder, overwrite=True, inputs=[plan_file], products=products) as staging:
        names = [name for name in present if name != "report"]
        written = write_dataset(
            dataset, staging, names, stem=plan_file.stem, options=options, tell_drops=False
        )
        if "report" in present:
            formats = ["gpkg", *(name for name in names if not FORMATS[name].automatic)]
            written += write_report(dataset, staging, stem="", options={"formats": formats})
    return [folder / path.relative_to(staging) for path in written]


def _files(of: Format, plan_file: Path) -> Iterator[Path]:
    main = plan_file.with_name(PLAN_FILE)
    of_another = plan_file.name != PLAN_FILE and main.is_file()
    for given in of.files:
        if of_another and "{stem}" not in given:
            continue
        pattern = given
        for placeholder, text in (("{stem}", plan_file.stem), ("<layer>", "*"), ("<name>", "*")):
            pattern = pattern.replace(placeholder, text)
        named = "{stem}" in given
        for file in plan_file.parent.glob(pattern):
            if file.is_file() and (_is_made_here(file) or not named):
                yield file


def _is_made_here(file: Path) -> bool:
    if file.suffix == ".prj":  # of the DXF beside it; without one, of a person's Shapefile
        file = file.with_suffix(".dxf")
    with (
        suppress(OSError, ValueError),  # it is not there, or empty
        file.open("rb") as opened,
        mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) as whole,
    ):
        return _MADE_HERE.search(whole) is not None
    return False


def _is_study(file: Path) -> bool:
    with file.open("rb") as opened:
        return _STUDY_MARK in opened.read(4096)
