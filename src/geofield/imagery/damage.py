"""Damage that GDAL reads over: what it only warns of, and blocks whose checksum is wrong."""

from __future__ import annotations

import logging
import re
import threading
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from rasterio.windows import Window

#: Warnings after which pixels are made up. Bytes that are too many harm none.
_MADE_UP = re.compile(
    r"Corrupt JPEG data: (?!\d+ extraneous)|Premature end of JPEG|to avoid buffer overrun"
    r"|does not end with EOC"
)
_LOGGERS = ("rasterio._err", "rasterio._env")
_CHUNK = 1 << 20


@contextmanager
def made_up() -> Iterator[list[str]]:
    """What GDAL says, in this thread, of pixels that it made up for damaged ones."""
    thread, said = threading.get_ident(), list[str]()

    def heard(record: logging.LogRecord) -> bool:
        text = record.getMessage()
        if record.thread != thread or not _MADE_UP.search(text):
            return True
        said.append(re.sub(r"^CPLE_\w+:| \(this warning.*", "", text))
        return False

    with ExitStack() as stack:
        for logger in map(logging.getLogger, _LOGGERS):
            logger.addFilter(heard)
            stack.callback(logger.removeFilter, heard)
        yield said


def check_blocks(dataset: Any, window: Window) -> None:
    """Look whether the blocks of a window are what was written; of a DEFLATE GeoTIFF alone.

    Its blocks end with a checksum. GDAL never comes to it where damage makes more pixels of a
    block than it has: it takes what fits, and the rest of the block is another picture.

    Raises
    ------
    OSError
        A block is damaged.
    """
    file = Path(dataset.name)
    deflate = dataset.tags(ns="IMAGE_STRUCTURE").get("COMPRESSION") == "DEFLATE"
    if dataset.driver != "GTiff" or not deflate or not file.is_file():
        return
    height, width = dataset.block_shapes[0]
    right, lower = window.col_off + window.width, window.row_off + window.height
    checked = set[int]()
    with file.open("rb") as stream:
        for row in range(int(window.row_off // height), int(-(-lower // height))):
            for column in range(int(window.col_off // width), int(-(-right // width))):
                for offset, size in _places(dataset, column, row):
                    if offset not in checked and not _is_whole(stream, offset, size):
                        raise OSError(f"the block at column {column}, row {row} is damaged")
                    checked.add(offset)


def _places(dataset: Any, column: int, row: int) -> Iterator[tuple[int, int]]:
    """Where a block of all bands lies in its file, and its size; bands may share it."""
    for band in dataset.indexes:
        offset, size = (
            dataset.get_tag_item(f"BLOCK_{what}_{column}_{row}", "TIFF", bidx=band)
            for what in ("OFFSET", "SIZE")
        )
        if offset is not None and size is not None:  # else it was never written
            yield int(offset), int(size)


def _is_whole(stream: BinaryIO, offset: int, size: int) -> bool:
    """Whether a block can be unpacked to its end, and its checksum is right."""
    stream.seek(offset)
    packed, unpack = stream.read(size), zlib.decompressobj()
    try:
        while packed and not unpack.eof:
            unpack.decompress(packed, _CHUNK)
            packed = unpack.unconsumed_tail
    except zlib.error:
        return False
    return unpack.eof
