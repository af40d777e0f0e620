"""Exit codes of every command as a process: 0 done, 1 the work failed, 2 wrong usage.

One line of each command starts from nothing; for the others libraries are loaded once.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import rasterio

from geofield.cli.main import COMMANDS, main
from geofield.simulate import SimulatedField
from geofield_command import run_geofield

GEOFIELD = Path(sys.executable).with_name("geofield")


@dataclass(frozen=True)
class Place:
    """A folder with one finished plan, and what commands need to name."""

    folder: Path
    picture: Path
    lat: float
    lon: float

    def geofield(
        self, line: str, *, from_nothing: bool = False
    ) -> subprocess.CompletedProcess[str]:
        """Run a command line whose words may name files of this place."""
        names = {"PICTURE": str(self.picture), "POINT": f"--lat {self.lat} --lon {self.lon}"}
        for name, value in names.items():
            line = line.replace(name, value)
        if not from_nothing:
            return run_geofield(*line.split(), folder=self.folder)
        return subprocess.run(
            [GEOFIELD, *line.split()],
            cwd=self.folder,
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )


@pytest.fixture(scope="module")
def place(
    simulated: SimulatedField, simulated_tif: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Place]:
    folder = tmp_path_factory.mktemp("codes")
    made = Place(folder, simulated_tif, simulated.lat, simulated.lon)
    (folder / "text.tif").write_text("no picture")
    (folder / "text.gpkg").write_text("no plan")
    (folder / "wrong.geojson").write_text('{"type": "FeatureCollection", "features": [{}]}')
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
        assert made.geofield("run PICTURE POINT --spacing 8 --out out").returncode == 0
        yield made


#: By command: lines that succeed, that fail at their work, that are wrong usage.
LINES: dict[str, tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]] = {
    "run": (
        ("run PICTURE POINT --spacing 8 --out out --overwrite",),
        (
            "run text.tif POINT --out new",
            "run PICTURE --lat 1 --lon 1 --out new",
            "run PICTURE POINT --out out",
        ),
        ("run PICTURE --out new", "run PICTURE POINT --out new --holes no", "run --nothing"),
    ),
    "tiles": (
        ("tiles PICTURE POINT --size 64 -o cut.tif",),
        ("tiles PICTURE --lat 1 --lon 1 -o new.tif",),
        ("tiles PICTURE -o new.tif", "tiles PICTURE POINT --zoom often -o new.tif"),
    ),
    "field": (
        ("field PICTURE POINT -o field.gpkg",),
        ("field text.tif POINT -o new.gpkg", "field PICTURE --lat 1 --lon 1 -o new.gpkg"),
        ("field PICTURE POINT", "field PICTURE POINT -o new.gpkg --method best"),
    ),
    "obstacles": (
        ("obstacles PICTURE out/field.gpkg -o obstacles.gpkg",),
        ("obstacles text.tif out/field.gpkg -o new.gpkg", "obstacles PICTURE text.gpkg -o n.gpkg"),
        ("obstacles PICTURE out/field.gpkg", "obstacles PICTURE missing.gpkg -o new.gpkg"),
    ),
    "tracks": (
        ("tracks out/field.gpkg --spacing 9 -o tracks.gpkg",),
        ("tracks text.gpkg -o new.gpkg", "tracks out/field.gpkg --spacing 5000 -o new.gpkg"),
        ("tracks out/field.gpkg", "tracks out/field.gpkg --spacing wide -o new.gpkg"),
    ),
    "batch": (
        ("batch out/field.gpkg --spacing 9 --workers 1 --out farm",),
        (
            "batch text.gpkg --out new",
            "batch out/field.gpkg --spacing 5 --out farm",
        ),
        ("batch out/field.gpkg", "batch out/field.gpkg --out new --workers no"),
    ),
    "farm": (
        (),
        ("farm get out F -o new.gpkg", "farm put out/field.gpkg out"),
        ("farm get farm", "farm put missing.gpkg farm", "farm nothing"),
    ),
    "undo": (
        (
            "tracks out/field.gpkg --spacing 9 -o undone.gpkg",
            "tracks undone.gpkg --spacing 8 -o undone.gpkg",
            "undo undone.gpkg",
        ),
        ("undo text.gpkg",),
        ("undo", "undo missing.gpkg"),
    ),
    "refresh": (
        ("refresh out/field.gpkg", "refresh out/field.gpkg --json"),
        ("refresh text.gpkg",),
        ("refresh", "refresh missing.gpkg"),
    ),
    "export": (
        ("export out/field.gpkg -f kml --out export",),
        ("export text.gpkg -f kml --out new",),
        (
            "export out/field.gpkg -f gpgk --out n",
            "export out/field.gpkg -f kml",
            "export out/field.gpkg -f shapefile --profile x --out n",
        ),
    ),
    "import": (
        ("import out/geojson/field.geojson -o import.gpkg",),
        ("import text.gpkg -o new.gpkg",),
        ("import -o new.gpkg", "import out/geojson/field.geojson"),
    ),
    "validate": (
        ("validate out/field.gpkg", "validate out/field.gpkg out/geojson/field.geojson --json"),
        ("validate wrong.geojson", "validate out/field.gpkg wrong.geojson --json"),
        ("validate", "validate out/field.gpkg --strictly"),
    ),
    "query": (
        ("query out/field.rdf out/obstacles.rdf obstacles-larger-than", "query --list"),
        ("query text.gpkg obstacles-larger-than",),
        ("query", "query out/field.rdf out/obstacles.rdf obstacles-larger-than --set radius"),
    ),
    "info": (
        ("info out/field.gpkg", "info PICTURE --json"),
        ("info text.gpkg", "info text.tif"),
        ("info", "info out/field.gpkg --deep"),
    ),
    # It serves until it is stopped: what it does then is tested in tests/review.
    "review": (
        (),
        ("review text.gpkg --no-browser",),
        ("review", "review out/field.gpkg --port x"),
    ),
    "live": (("live",), (), ("live all",)),
    "ready": (("ready",), (), ("ready now",)),
    "settings": (("settings", "settings --json"), (), ("settings tracks",)),
    "formats": (("formats", "formats --json"), (), ("formats gpkg",)),
    "sources": (("sources --json",), (), ("sources naip",)),
    "cache": (
        ("cache info", "cache clear --yes"),
        ("cache clear nothing-of-this-name",),
        ("cache fill",),
    ),
    "evaluate": (
        ("evaluate out/field.gpkg out/field.gpkg --truth-layer obstacles --json",),
        ("evaluate text.gpkg out/field.gpkg", "evaluate out/field.gpkg out/field.gpkg --layer no"),
        ("evaluate out/field.gpkg", "evaluate out/field.gpkg out/field.gpkg --distance 0"),
    ),
    "doctor": (("doctor --json",), (), ("doctor please",)),
    "simulate": (
        ("simulate --size 96 --trees 1 --out sim",),
        ("simulate --size 96 --trees 1 --out sim",),
        ("simulate", "simulate --fields 0 --out new"),
    ),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_exit_codes(place: Place, command: str) -> None:
    """A message on stderr goes with every failure, and nothing is written."""
    # What fails at its work has begun most and ends early.
    alone = LINES[command][1 if LINES[command][1] else 2][0]
    for code, lines in enumerate(LINES[command]):
        for line in lines:
            before = sorted(place.folder.iterdir())
            done = place.geofield(line, from_nothing=line == alone)
            assert done.returncode == code, f"{line}: {done.returncode}\n{done.stderr}"
            assert "Traceback" not in done.stderr, line
            if code:
                assert done.stderr.strip() or "--json" in line, line
                assert sorted(place.folder.iterdir()) == before, line
            if "--json" in line and code < 2:
                json.loads(done.stdout)


#: By command: lines that name as input what is not there; none where a command reads no file.
MISSING: dict[str, tuple[str, ...]] = {
    "run": ("run missing.tif POINT --out new", "run naip2 POINT --out new"),
    "tiles": ("tiles missing.tif POINT -o new.tif", "tiles missing.mbtiles POINT -o new.tif"),
    "field": ("field missing.tif POINT -o n.gpkg",),
    "obstacles": (
        "obstacles missing.tif out/field.gpkg -o n.gpkg",
        "obstacles PICTURE missing.gpkg -o n.gpkg",
    ),
    "tracks": ("tracks missing.gpkg --spacing 9 -o n.gpkg",),
    "batch": (
        "batch missing.csv --out new",
        "batch out/field.gpkg missing.tif --out new",
    ),
    "farm": (
        "farm put missing.gpkg farm",
        "farm get missing F -o n.gpkg",
        "farm put out/field.gpkg missing",
    ),
    "review": ("review missing.gpkg --no-browser",),
    "undo": ("undo missing.gpkg",),
    "live": (),
    "ready": (),
    "refresh": ("refresh missing.gpkg",),
    "export": ("export missing.gpkg -f kml --out new",),
    "import": ("import missing.shp -o n.gpkg", "import missing.zip -o n.gpkg"),
    "validate": ("validate missing.gpkg", "validate out/field.gpkg missing.rdf --json"),
    "query": (
        "query missing.rdf obstacles-larger-than",
        "query out/field.rdf no-such-query",
        "query out/field.rdf missing.rq",
    ),
    "info": ("info missing.tif", "info missing.gpkg", "info GPKG:missing.gpkg:JULY"),
    "settings": (),
    "formats": (),
    "sources": (),
    "cache": (),
    "evaluate": (
        "evaluate missing.gpkg out/field.gpkg",
        "evaluate out/field.gpkg missing.gpkg",
    ),
    "doctor": (),
    "simulate": (),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_an_input_that_is_not_there_is_wrong_usage(place: Place, command: str) -> None:
    """One rule for all: it was 1 or 2, by whether click or a reader looked first."""
    before = sorted(place.folder.iterdir())
    for line in MISSING[command]:
        done = place.geofield(line)
        assert done.returncode == 2, f"{line}: {done.returncode}\n{done.stderr}"
        assert "Traceback" not in done.stderr, line
        assert any(name in done.stderr for name in ("missing", "naip2", "no-such")), line
    assert sorted(place.folder.iterdir()) == before


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no full device")
def test_no_room_for_what_is_printed() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [GEOFIELD, "formats"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 1
    assert done.stderr.startswith("Error: The disk is full")


@pytest.mark.skipif(os.name != "posix", reason="needs a shell that closes streams")
@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_streams_that_are_closed(sample: Path, tmp_path: Path, closed: str) -> None:
    """As cron jobs and services have them: no file gets what would have been printed."""
    picture, out = sample / "field_1.tif", tmp_path / "cut.tif"
    point = "--lat 35.075373 --lon 33.531142 --size-m 60"
    for line in ("formats", f"tiles {picture} {point} -o {out}"):
        done = subprocess.run(
            f"{GEOFIELD} {line} {closed}",
            shell=True,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert "Traceback" not in done.stderr
    with rasterio.open(out) as cut:
        assert cut.read().std() > 1
        assert cut.checksum(1)


@pytest.mark.parametrize("code_page", ["cp1252", "cp866"])
def test_letters_that_a_code_page_lacks_end_no_work(
    sample: Path, tmp_path: Path, code_page: str
) -> None:
    """As a pipe on Windows has one: a name was the end of `info`, in a traceback."""
    plan = tmp_path / "Höfe ł 農場.gpkg"
    shutil.copyfile(sample / "field_1.gpkg", plan)
    environment = {**os.environ, "PYTHONIOENCODING": code_page}
    said = [
        subprocess.run(
            [GEOFIELD, *words], env=environment, capture_output=True, check=True
        ).stdout.decode(code_page)
        for words in (["info", plan], ["info", plan, "--json"], ["formats"])
    ]
    assert r"\u0142 \u8fb2\u5834.gpkg" in said[0]
    assert json.loads(said[1])["file"] == str(plan)


@pytest.mark.skipif(os.name != "posix", reason="needs a shell")
def test_a_reader_that_goes_away(sample: Path) -> None:
    line = f"{GEOFIELD} info {sample / 'field_1.gpkg'} | true"
    done = subprocess.run(line, shell=True, capture_output=True, text=True, check=False)
    assert done.stderr == ""


#: What C++ of a library does when it is taken apart while a thread of its own still runs, and what
#: Python does at an exit.
ABORTING = """
import atexit, ctypes, pathlib
libc = ctypes.CDLL(None)
ended = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(lambda _: libc.abort())
libc.__cxa_atexit(ended, None, None)
atexit.register(pathlib.Path("ended").touch)
"""


@pytest.mark.parametrize(("line", "code"), [("formats", 0), ("info none.gpkg", 2), ("nope", 2)])
def test_a_library_that_ends_badly_takes_no_exit_code_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, code: int
) -> None:
    (tmp_path / "sitecustomize.py").write_text(ABORTING)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    done = subprocess.run(
        [GEOFIELD, *line.split()], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stderr
    assert "GeoPackage" in done.stdout if code == 0 else done.stderr
    assert (tmp_path / "ended").exists()


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--resolution", "0,5", "'0,5' is no number: write 0.5."),
        ("--resolution", "2m", "'2m' is no number: write 2."),
        ("--lat", "N35", "'N35' is no number, such as 4.5."),
        ("--fields", "2.5", "'2.5' is no whole number, such as 4."),
    ],
)
def test_what_is_no_number_is_told_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str, value: str, words: str
) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["simulate", option, value, "--out", str(tmp_path / "new")])
    assert words in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("name", "code", "told"),
    [
        ("long" * 80 + ".gpkg", 1, "File name too long."),
        ("fl\udce4che.gpkg", 2, r"b'fl\xe4che.gpkg' is no UTF-8: rename the file"),
    ],
)
def test_a_name_that_the_system_or_libraries_refuse(name: str, code: int, told: str) -> None:
    """They ended in a traceback, as a folder did that may not be looked into."""
    done = run_geofield("info", name)
    assert done.returncode == code
    assert told in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("option", "code", "told"),
    [
        ("--crs hello", 1, "Unknown coordinate reference system 'hello'."),
        ("--bands=", 2, "--bands: it is empty: leave it out, or name one"),
        ("--format=", 2, "--format: it is empty: leave it out, or name one"),
    ],
)
def test_what_is_mistyped_is_refused_though_the_picture_says_it_itself(
    sample: Path, tmp_path: Path, option: str, code: int, told: str
) -> None:
    """An empty --bands took all bands for ground of any kind: 3.73 ha instead of 3.65."""
    line = f"run field_1.tif --lat 35.075373 --lon 33.531142 --out {tmp_path / 'o'} {option}"
    done = run_geofield(*line.split(), folder=sample)
    assert done.returncode == code
    assert told in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="no file is called so there")
def test_a_folder_below_a_file(sample: Path) -> None:
    line = "field field_1.tif --lat 35.075373 --lon 33.531142 --list --pictures /dev/null/new"
    done = run_geofield(*line.split(), folder=sample)
    assert done.returncode == 1
    assert "/dev/null/new: Not a directory." in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
@pytest.mark.parametrize("line", ["info field.gpkg", "import field.gpkg -o new.gpkg"])
def test_a_link_that_leads_to_itself(tmp_path: Path, line: str) -> None:
    (tmp_path / "field.gpkg").symlink_to("field.gpkg")
    done = run_geofield(*line.split(), folder=tmp_path)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "line", ["tiles {} --lat 35 --lon 33 -o t.tif", "obstacles {} PLAN -o o.gpkg"]
)
def test_an_address_that_is_none(sample: Path, tmp_path: Path, line: str) -> None:
    words = line.replace("PLAN", str(sample / "field_1.gpkg")).format("http://[host").split()
    done = run_geofield(*words, folder=tmp_path)
    assert done.returncode == 1
    assert done.stderr.startswith("Error: http://[host is no address: ")
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("boundary", "hint"),
    [
        (".", "It is a folder: name a file in it."),
        ("field_1.tif", "Give the picture to `geofield run`"),
        ("field_1.gpkg --boundary-layer none", "name one with --boundary-layer."),
    ],
)
def test_what_is_wrong_with_a_boundary_is_told_with_its_own_next_step(
    sample: Path, tmp_path: Path, boundary: str, hint: str
) -> None:
    line = f"run field_1.tif --boundary {boundary} --out {tmp_path / 'out'}"
    done = run_geofield(*line.split(), folder=sample)
    assert done.returncode == 1
    assert hint in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="no folder is removed there while in use")
def test_a_folder_that_is_gone_is_told(tmp_path: Path) -> None:
    (tmp_path / "gone").mkdir()
    words = 'rmdir ../gone && exec "$@"'
    line = [sys.executable, "-P", "-m", "geofield", "info", "field.gpkg"]
    done = subprocess.run(["sh", "-c", words, "sh", *line], cwd=tmp_path / "gone",
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 1
    assert "The folder that this was started in is gone." in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "line",
    [
        "import URL -o x.gpkg",
        "tracks URL --spacing 4 -o x.gpkg",
        "run PICTURE POINT --boundary URL --spacing 4 --out x",
        "obstacles PICTURE URL -o x.gpkg",
    ],
)
def test_vector_files_are_not_read_from_addresses(place: Place, line: str) -> None:
    done = place.geofield(line.replace("URL", "https://example.org/a.geojson"))
    assert done.returncode == 2
    assert "https://example.org/a.geojson is an address" in done.stderr
    assert "download the file" in done.stderr
