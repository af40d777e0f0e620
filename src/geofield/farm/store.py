"""Where a farm lies: a folder on a disk, or a prefix in an object store.

Every file comes into place whole: by a rename on a disk, by its upload in an object store.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from uuid import uuid4

from geofield.errors import FormatError
from geofield.staging import cannot_write

#: What a file is called while it is written, behind a name of chance.
_HALF = ".tmp"
_RIGHTS = "Look at the permissions of the store, and at the key you gave it."


@dataclass(frozen=True)
class Store:
    """A folder of files with names such as ``tracks/chunk=0007/part-0.parquet``."""

    #: Path, or an address of an object store (``s3://bucket/farm``).
    place: str

    @classmethod
    def of(cls, place: str | Path) -> Store:
        """The store at a path or address; a path becomes absolute, workers may live elsewhere."""
        text = str(place)
        return cls(text.rstrip("/") if "://" in text else str(Path(text).absolute()))

    @property
    def folder(self) -> Path | None:
        """The folder on this machine's disks; None for an object store."""
        return None if "://" in self.place else Path(self.place)

    @cached_property
    def _remote(self) -> tuple[Any, str]:
        """The file system of pyarrow and the prefix in it."""
        from pyarrow import ArrowInvalid, fs

        try:
            system, prefix = fs.FileSystem.from_uri(self.place)
        except (ArrowInvalid, OSError) as error:
            raise FormatError(
                f"{self.shown} is no object store that can be reached: {error}.",
                hint="Give a folder, s3://BUCKET/FOLDER or gs://BUCKET/FOLDER.",
            ) from None
        return system, prefix

    @property
    def shown(self) -> str:
        """The place for people: an address without keys in it."""
        return re.sub(r"//[^/@]*@", "//", self.place.partition("?")[0])

    def __getstate__(self) -> dict[str, str]:
        return {"place": self.place}

    def put(self, name: str, data: bytes | memoryview) -> None:
        """Write a file, whole or not at all.

        Raises
        ------
        FormatError
            When the place cannot be written or is full.
        """
        if self.folder is None:
            system, prefix = self._remote
            try:
                with system.open_output_stream(f"{prefix}/{name}") as stream:
                    stream.write(data)
            except OSError as error:
                raise FormatError(
                    f"{self.shown} cannot be written: {_short(error)}",
                    hint=_RIGHTS,
                ) from None
            return
        target = self.folder / name
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            # Readers pass over names that begin with a dot.
            half = target.with_name(f".{uuid4().hex}{_HALF}")
            try:
                with half.open("xb") as stream:
                    stream.write(data)
                    stream.flush()
                    os.fsync(stream.fileno())
                half.replace(target)
            except BaseException:
                half.unlink(missing_ok=True)
                raise
        except OSError as error:
            raise cannot_write(target, error) from error

    def sweep(self, folder: str) -> None:
        """Remove what a process that was killed had begun to write in a folder."""
        if self.folder is not None:
            for half in (self.folder / folder).glob(f".*{_HALF}"):
                half.unlink(missing_ok=True)

    def get(self, name: str) -> bytes | None:
        """The content of a file; None where there is none."""
        try:
            if self.folder is not None:
                return (self.folder / name).read_bytes()
            system, prefix = self._remote
            with system.open_input_file(f"{prefix}/{name}") as stream:
                data: bytes = stream.read()
                return data
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            raise FormatError(
                f"{self.shown}/{name} cannot be read: {_short(error)}", hint=_RIGHTS
            ) from None

    def note(self, name: str, value: Any) -> None:
        """Keep a JSON value as a file."""
        self.put(name, json.dumps(value, sort_keys=True).encode())

    def noted(self, name: str) -> Any:
        """The JSON value that a file keeps; an empty mapping where there is none."""
        return json.loads(self.get(name) or b"{}")

    def names(self, folder: str) -> list[str]:
        """The names in a folder, sorted; none where there is no such folder."""
        if self.folder is not None:
            here = self.folder / folder
            found = here.iterdir() if here.is_dir() else ()
            return sorted(each.name for each in found if not each.name.startswith("."))
        from pyarrow import fs

        system, prefix = self._remote
        where = fs.FileSelector(f"{prefix}/{folder}".rstrip("/"), allow_not_found=True)
        try:
            return sorted(info.base_name for info in system.get_file_info(where))
        except OSError as error:
            raise FormatError(
                f"{self.shown} cannot be read: {_short(error)}", hint=_RIGHTS
            ) from None

    def remove(self, name: str) -> None:
        """Remove a file or a folder with all that is in it; none is none."""
        if self.folder is not None:
            here = self.folder / name
            if here.is_dir() and not here.is_symlink():
                shutil.rmtree(here, ignore_errors=True)
            else:
                here.unlink(missing_ok=True)
            return
        from pyarrow import fs

        system, prefix = self._remote
        info = system.get_file_info(f"{prefix}/{name}")
        if info.type == fs.FileType.Directory:
            system.delete_dir(info.path)
        elif info.type == fs.FileType.File:
            system.delete_file(info.path)


def _short(error: OSError) -> str:
    return str(error).split("\n", maxsplit=1)[0][:300]
