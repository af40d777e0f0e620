"""ZIP archives, as Shapefiles and task data are passed on."""

from __future__ import annotations

import tempfile
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from geofield.errors import FormatError

#: ZIP knows no time before this.
_ZERO = (1980, 1, 1)
#: More than this is no archive of one field, bytes.
MAX_BYTES = 4 * 2**30
MAX_ENTRIES = 10_000
#: An archive that unpacks to more than this, and to so many times its size, is a bomb.
BOMB_BYTES, BOMB_RATIO = 100e6, 50
_YOURSELF = "Unpack it yourself if you trust it."


def archived(
    files: Iterable[Path], path: Path, *, day: str | None, below: Path | None = None
) -> Path:
    """Move files into an archive; byte-identical for the same files.

    Parameters
    ----------
    day : str or None
        ISO 8601; stamped on each entry.
    below : Path, optional
        Entries keep their folders below this one; without it they lie flat.
    """
    with zipfile.ZipFile(path, "w") as archive:
        for file in files:
            name = file.name if below is None else file.relative_to(below).as_posix()
            add(archive, name, file.read_bytes(), day)
            file.unlink()
    return path


def add(archive: zipfile.ZipFile, name: str, content: bytes, day: str | None) -> None:
    """Write an entry into an archive, stamped with a day (ISO 8601)."""
    date = max(tuple(map(int, day.split("-"))), _ZERO) if day else _ZERO
    info = zipfile.ZipInfo(name, (date[0], date[1], date[2], 0, 0, 0))
    archive.writestr(info, content, zipfile.ZIP_DEFLATED)


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """The innermost folder that holds all of an archive's content, for a block.

    Raises
    ------
    FormatError
        When it is no archive, encrypted, too large, or leads out of its folder.
    """
    try:
        with zipfile.ZipFile(path) as archive, tempfile.TemporaryDirectory() as name:
            # What has no name of its own is called after the folder.
            folder = Path(name) / path.stem
            folder.mkdir()
            entries = [entry for entry in archive.infolist() if not entry.is_dir()]
            size = sum(entry.file_size for entry in entries)
            if size > MAX_BYTES:
                raise FormatError(
                    f"{path} unpacks to more than {MAX_BYTES / 2**30:.0f} GB.", hint=_YOURSELF
                )
            if len(entries) > MAX_ENTRIES or (
                size > BOMB_BYTES and size > BOMB_RATIO * path.stat().st_size
            ):
                raise FormatError(
                    f"{path} unpacks to {len(entries)} files of {size / 1e6:.0f} MB, far more than "
                    "it holds: refused.",
                    hint=_YOURSELF,
                )
            for entry in entries:
                parts = PurePosixPath(entry.filename.replace("\\", "/")).parts
                if ".." in parts or PurePosixPath(entry.filename).is_absolute():
                    raise FormatError(
                        f"{path}: the entry {entry.filename!r} leads out of it.", hint=_YOURSELF
                    )
                if parts[0] == "__MACOSX":
                    continue
                entry.filename = "/".join(parts)
                archive.extract(entry, folder)
            try:
                yield _innermost(folder)
            except FormatError as error:  # where it was unpacked tells a person nothing
                error.message = error.message.replace(str(folder), str(path))
                raise
    # OSError: a place in the archive that is none, as a bad entry names it.
    except (zipfile.BadZipFile, zlib.error, RuntimeError, EOFError, OSError) as error:
        raise FormatError(f"{path} cannot be unpacked: {error}.", hint="Is it whole?") from error


def _innermost(folder: Path) -> Path:
    inside = list(folder.iterdir())
    while len(inside) == 1 and inside[0].is_dir() and inside[0].name.upper() != "TASKDATA":
        folder = inside[0]
        inside = list(folder.iterdir())
    return folder
