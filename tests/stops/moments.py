"""Stop a command at a random moment, and see what it left behind.

Products are whole when either every file is the one that lay there before, or every file that the
command writes is its own; each is then opened by a program that is not ours. A farm is made piece
by piece: it is whole when the same command goes on, and every byte is as if nobody had stopped it.
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
import warnings
import zipfile
from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree as ET

GEOFIELD = Path(sys.executable).with_name("geofield")
STOPS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGKILL)
STOPPED = "Stopped; nothing half-written is left."
GOES_ON = "The same command does what is missing."
#: After so long, a command that was stopped goes on for ever, seconds.
_ENDS_S = 120
#: The command's own hidden folders.
HIDDEN = ".geofield-"
EXPORTS = (
    *("geojson", "shapefile", "geoparquet", "flatgeobuf", "kml", "gpx", "csv", "fiboa", "dxf"),
    *("isoxml", "agopengps", "rdf", "turtle", "jsonld", "ntriples", "html", "report"),
)


@dataclass(frozen=True)
class Work:
    """A command whose products lie in a folder already, and what it replaces there.

    In its words ``OUT`` is that folder. One that goes on where it was stopped has the digests of
    all files whose bytes are always the same.
    """

    name: str
    words: tuple[str, ...]
    before: Path
    seconds: float
    written: frozenset[str]
    left: frozenset[str]
    digests: frozenset[tuple[str, str]] = frozenset()


@dataclass
class Stop:
    """What became of a command that was stopped."""

    work: str
    kind: str
    moment: str
    code: int
    #: ``old``, ``new``, or what is wrong with the products.
    products: str = ""
    #: The same before the next start, which finishes what a kill cut.
    at_once: str = ""
    faults: list[str] = field(default_factory=list)


def make_works(folder: Path, picture: Path, point: list[str]) -> list[Work]:
    """Run every command twice undisturbed: once for what lies there, once to see what it writes."""
    base, other = folder / "base", folder / "other"
    formats = [word for name in EXPORTS for word in ("-f", name)]

    def run(out: Path | str, spacing_m: int) -> list[str]:
        return ["run", str(picture), *point, "--spacing", str(spacing_m), "--out", str(out)]

    _sound(run(base, 8))
    _sound(run(other, 5))
    plans = {8: str(base / "field.gpkg"), 5: str(other / "field.gpkg")}
    exported, cut = folder / "exported", folder / "cut"
    _sound(["export", plans[8], *formats, "--out", str(exported)])
    cut.mkdir()
    _sound(["tiles", str(picture), *point, "--size", "80", "-o", str(cut / "scene.tif")])
    tiles = ["tiles", str(picture), *point, "--size", "120", "-o", "OUT/scene.tif", "--overwrite"]
    (folder / "nothing").mkdir()
    batch = [
        "batch",
        str(_parcels(folder)),
        "--spacing",
        "5",
        "--workers",
        "2",
        "--out",
        "OUT/farm",
    ]
    lines = [
        ("run", base, [*run("OUT", 5), "--overwrite"]),
        ("tracks", base, ["tracks", "OUT/field.gpkg", "--spacing", "5", "-o", "OUT/field.gpkg"]),
        ("export", exported, ["export", plans[5], *formats, "--out", "OUT", "--overwrite"]),
        ("tiles", cut, tiles),
        ("batch", folder / "nothing", batch),
    ]
    return [
        _work(name, words, before, folder / f"{name} undisturbed") for name, before, words in lines
    ]


def _parcels(folder: Path) -> Path:
    """Four fields side by side."""
    import geopandas as gpd
    import shapely

    west = range(500_000, 500_800, 200)
    shapes = [shapely.box(x, 5_500_000, x + 150, 5_500_100) for x in west]
    frame = gpd.GeoDataFrame({"id": ["a", "b", "c", "d"]}, geometry=shapes, crs=32632)
    frame.to_file(folder / "parcels.gpkg")
    return folder / "parcels.gpkg"


def _work(name: str, words: list[str], before: Path, out: Path) -> Work:
    shutil.copytree(before, out)
    was = _inodes(out)
    start = time.monotonic()
    _sound([word.replace("OUT", str(out)) for word in words])
    seconds = time.monotonic() - start
    now = _inodes(out)
    written = frozenset(each for each in now if now[each] != was.get(each))
    digests = _digests(out) if name == "batch" else frozenset()
    return Work(name, tuple(words), before, seconds, written, frozenset(now), digests)


def _digests(farm: Path) -> frozenset[tuple[str, str]]:
    """Names and digests of all files but the status, which tells seconds."""
    files = (each for each in farm.rglob("*") if each.is_file() and "status" not in each.parts)
    return frozenset(
        (str(each.relative_to(farm)), hashlib.sha256(each.read_bytes()).hexdigest())
        for each in files
    )


def _sound(words: list[str]) -> None:
    done = subprocess.run(
        [GEOFIELD, *words], capture_output=True, text=True, check=False, timeout=_ENDS_S
    )
    assert done.returncode == 0, (words, done.stderr)


def stop(work: Work, kind: signal.Signals, dice: random.Random, out: Path, *, aimed: bool) -> Stop:
    """Start a command, stop it at a moment that the dice choose, and look at what it left.

    Parameters
    ----------
    work : Work
    kind : Signals
    dice : Random
    out : Path
        A folder to make.
    aimed : bool
        Stop it while its files are moved into place, which takes a few milliseconds, instead of
        at any moment of its life.
    """
    shutil.copytree(work.before, out)
    was = _inodes(out)
    line = [word.replace("OUT", str(out)) for word in work.words]
    with subprocess.Popen(
        [GEOFIELD, *line],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            if aimed:
                wait_s = dice.uniform(0, 0.004)
                while process.poll() is None and not _moving(out):
                    time.sleep(0.0005)
            else:
                wait_s = dice.uniform(0.05, work.seconds)
            time.sleep(wait_s)
            process.send_signal(kind)
            _, told = process.communicate(timeout=_ENDS_S)
        except BaseException:
            # It would be waited for without end; its workers hold open what it says.
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            raise
    moment = "while moving" if aimed else f"{wait_s:.2f} s"
    found = Stop(work.name, kind.name, moment, process.returncode)
    found.at_once = _products(work, out, was)
    # A tenth of a second goes by before the command begins: until then it is Python that stops.
    began = found.at_once != "old" or "in main" in told or "Traceback" not in told[:10]
    silent = found.at_once == "old" and not told
    if not (process.returncode == -kind and (silent or not began)):
        found.faults = _said(process.returncode, told, kind)
    if work.digests:
        _sound(line)
        found.products = "new" if _digests(out) == work.digests else "other bytes"
    else:
        if kind != signal.SIGKILL and found.at_once not in ("old", "new"):
            found.faults.append(f"after {kind.name}: {found.at_once}")
        next_start(out)
        found.products = _products(work, out, was)
    if found.products not in ("old", "new"):
        found.faults.append(found.products)
    found.faults += [f"left behind: {each.name}" for each in out.rglob(HIDDEN + "*")]
    found.faults += unreadable(out)
    return found


def next_start(out: Path) -> None:
    """What every command does first with its folder, by one that writes other files there."""
    was = set(out.iterdir())
    _sound(["simulate", "--size", "64", "--fields", "1", "--out", str(out)])
    for each in set(out.iterdir()) - was:
        each.unlink()


def _moving(out: Path) -> bool:
    return any(any(each.glob(HIDDEN + "*/moving")) for each in (out, out / "farm"))


def _said(code: int, told: str, kind: signal.Signals) -> list[str]:
    """What is wrong with how a command ended."""
    if kind == signal.SIGKILL:
        return [] if code in (-kind, 0) else [f"exit code {code}"]
    if code == 0:  # it was done already
        return []
    if code == 1 and (STOPPED in told or GOES_ON in told) and "Traceback" not in told:
        return []
    return [f"exit code {code}: {told.strip().splitlines()[-1:]}"]


def _products(work: Work, out: Path, was: dict[str, int]) -> str:
    now = _inodes(out)
    changed = {each for each in now if now[each] != was.get(each)} | (set(was) - set(now))
    if not changed:
        return "old"
    if changed == work.written and set(now) == work.left:
        return "new"
    return f"mixed: {len(changed & work.written)} of {len(work.written)} files are new"


def _inodes(folder: Path) -> dict[str, int]:
    return {
        str(each.relative_to(folder)): each.stat().st_ino
        for each in folder.rglob("*")
        if each.is_file() and HIDDEN not in str(each.relative_to(folder))
    }


# -- foreign readers --------------------------------------------------------------------------


def unreadable(folder: Path) -> list[str]:
    """The products that other programs cannot read to their end."""
    found = []
    for file in sorted(each for each in folder.rglob("*") if each.is_file()):
        read = _READERS.get(file.suffix.lower())
        try:
            with warnings.catch_warnings(action="ignore"):
                if read is not None:
                    read(file)
        except Exception as error:  # noqa: BLE001  (whatever a reader has against it)
            found.append(f"{file.relative_to(folder)}: {type(error).__name__} {error}")
    return found


def _raster(file: Path) -> None:
    import rasterio

    with rasterio.open(file) as picture:
        picture.read()


def _database(file: Path) -> None:
    import fiona

    with closing(sqlite3.connect(file)) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    for layer in fiona.listlayers(file):
        with fiona.open(file, layer=layer) as rows:
            assert len(list(rows)) == len(rows)


def _vector(file: Path) -> None:
    import pyogrio

    for layer, _ in pyogrio.list_layers(file):
        pyogrio.read_dataframe(file, layer=layer)


def _linked(file: Path) -> None:
    import rdflib

    form = {".rdf": "xml", ".ttl": "turtle", ".nt": "nt", ".jsonld": "json-ld"}
    assert len(rdflib.Graph().parse(file, format=form[file.suffix])) > 0


def _picture(file: Path) -> None:
    from PIL import Image

    with Image.open(file) as image:
        image.load()


def _parquet(file: Path) -> None:
    import pyarrow.parquet

    pyarrow.parquet.read_table(file)


_READERS: dict[str, Callable[[Path], object]] = {
    ".tif": _raster,
    ".gpkg": _database,
    ".bak": _database,
    ".png": _picture,
    ".parquet": _parquet,
    ".qgz": lambda file: zipfile.ZipFile(file).testzip(),
    ".json": lambda file: json.loads(file.read_text()),
    ".geojson": _vector,
    ".shp": _vector,
    ".fgb": _vector,
    ".kml": _vector,
    ".gpx": _vector,
    ".dxf": _vector,
    ".xml": ET.parse,
    ".rdf": _linked,
    ".ttl": _linked,
    ".nt": _linked,
    ".jsonld": _linked,
}
