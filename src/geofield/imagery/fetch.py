"""Fetching the tiles of a block: from the cache, else from the source, row by row.

Threads fetch and decode, with every check that keeps broken tiles out; this thread puts rows
together, keeps the cache and reports progress. A few rows are under way at a time, so memory does
not grow with the block.
"""

from __future__ import annotations

import contextlib
import io
import itertools
import warnings
import zlib
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import UTC, date, datetime

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from geofield.errors import ImageryError
from geofield.imagery.cache import TileCache
from geofield.imagery.client import BrokenBodyError, Client, GaveUpError, NotThereError
from geofield.imagery.sources.base import Tiles
from geofield.imagery.sources.mbtiles import MBTilesSource
from geofield.imagery.tiling import Block, Tile
from geofield.wording import counted

Progress = Callable[[int, int, str], None]

#: Red, green, blue (rows, columns, 3) and whether each pixel is there (None: all are).
Pixels = tuple[NDArray[np.uint8], NDArray[np.bool_] | None]
#: Side of the smallest tile that a source can have, pixels.
_LEAST_PX = 64
#: A small file that says it is a picture of gigabytes.
_BOMBS = (Image.DecompressionBombWarning, Image.DecompressionBombError)
#: After so many failures without one success the server is left in peace.
_HOPELESS = 24
#: Tiles under way at least, however short the rows are.
_AHEAD = 96


@dataclass
class FetchReport:
    """What happened while fetching, in tiles."""

    wanted: int = 0
    cached: int = 0
    downloaded: int = 0
    #: The source has nothing there.
    missing: int = 0
    #: The source has it, but never gave it whole.
    failed: int = 0
    #: Why tiles are absent, by message.
    reasons: Counter[str] = field(default_factory=Counter)
    #: Faults survived, by kind.
    troubles: Counter[str] = field(default_factory=Counter)
    #: How often each picture came: many sources answer with one where they have nothing.
    pictures: Counter[int] = field(default_factory=Counter)
    #: When the newest tile was fetched (UTC).
    newest: date | None = None

    @property
    def absent(self) -> int:
        """Tiles that are not in the product."""
        return self.missing + self.failed

    @property
    def alike(self) -> int:
        """Tiles that are the same picture as another one."""
        return sum(count for count in self.pictures.values() if count > 1)


#: The result of a worker: pixels, and the bytes to keep where they are new.
_Got = tuple[Pixels, bytes | None]
_Row = list[tuple[Tile, Future[_Got]]]


class TileFetcher:
    """Fetches blocks of one source; without a client, from the cache alone."""

    def __init__(
        self,
        source: Tiles,
        *,
        client: Client | None,
        cache: TileCache | None = None,
        threads: int = 16,
    ) -> None:
        self.source = source
        self.report = FetchReport()
        self._client = client
        self._cache = cache
        self._threads = threads

    def rows(
        self, block: Block, progress: Progress | None = None
    ) -> Generator[tuple[int, NDArray[np.uint8], NDArray[np.bool_] | None], None, None]:
        """The rows of tiles of a block, north to south: number, pixels, and which are there.

        Pixels (tile height, width, 3) are black where there is nothing, and their array is used
        again for the next row; the mask is None where every pixel is there.
        """
        self.report.wanted += block.count
        pending: deque[_Row] = deque()
        executor = ThreadPoolExecutor(self._threads, thread_name_prefix="tiles")
        ahead = max(2, -(-_AHEAD // block.columns) + 1)
        width, height = block.level.tile_px
        strip = np.empty((height, width * block.columns, 3), np.uint8)
        waiting = iter(range(block.rows))
        numbers = itertools.count(1)

        def one_arrived() -> None:
            if progress is not None:
                progress(next(numbers), block.count, "tiles")

        try:
            for row in range(block.rows):
                for further in itertools.islice(waiting, ahead - len(pending)):
                    pending.append(self._submitted(executor, block, further))
                valid = self._filled(strip, pending[0], one_arrived)
                pending.popleft()
                yield row, strip, valid
        except BaseException:
            if self._client is not None:
                self._client.stop()
            self._keep_finished(pending)
            raise
        finally:
            executor.shutdown(wait=True, cancel_futures=True)
            if self._client is not None:
                self.report.troubles = self._client.troubles

    # -- inside ----------------------------------------------------------------------------

    def _filled(
        self,
        strip: NDArray[np.uint8],
        futures: _Row,
        one_arrived: Callable[[], None],
    ) -> NDArray[np.bool_] | None:
        """Fill a strip with its row of tiles; where it has pixels, None when everywhere."""
        valid: NDArray[np.bool_] | None = None
        keep: list[tuple[int, int, int, bytes]] = []
        width = strip.shape[1] // len(futures)
        try:
            for i, (tile, future) in enumerate(futures):
                part = np.s_[:, i * width : (i + 1) * width]
                there: NDArray[np.bool_] | np.bool_ | None = np.False_
                try:
                    (strip[part], there), body = future.result()
                    if there is None or there.any():
                        self.report.pictures[zlib.crc32(strip[part].tobytes())] += 1
                except (NotThereError, GaveUpError, BrokenBodyError) as error:
                    self._absent(error)
                    strip[part], body = 0, None
                if body is not None:
                    keep.append((tile.zoom, tile.column, tile.row, body))
                    self.report.downloaded += 1
                if there is not None:
                    if valid is None:
                        valid = np.ones(strip.shape[:2], bool)
                    valid[part] = there
                one_arrived()
        finally:
            # Also when this stops here: a restart then fetches only the rest.
            if self._cache is not None:
                self._cache.put(keep)
        return valid

    def _submitted(self, executor: ThreadPoolExecutor, block: Block, row: int) -> _Row:
        tiles = list(block.tiles(row))
        kept: dict[int, tuple[bytes, int]] = {}
        if self._cache is not None:
            columns, stale = [tile.column for tile in tiles], self._client is None
            kept = self._cache.get_row(tiles[0].zoom, tiles[0].row, columns, stale=stale)
        days = [datetime.fromtimestamp(time_s, UTC).date() for _, time_s in kept.values()]
        self.report.cached += len(days)
        self.report.newest = max(filter(None, (self.report.newest, *days)), default=None)
        size = block.level.tile_px
        bodies = {column: body for column, (body, _) in kept.items()}
        return [
            (tile, executor.submit(self._get, tile, size, bodies.get(tile.column)))
            for tile in tiles
        ]

    def _get(self, tile: Tile, size_px: tuple[int, int], kept: bytes | None) -> _Got:
        """One tile, in a worker thread."""
        if kept is not None:
            # A tile damaged on disk is fetched anew.
            with contextlib.suppress(BrokenBodyError):
                return decode_tile(kept, "", size_px), None
        if isinstance(self.source, MBTilesSource):
            held = self.source.read(tile)
            if held is None:
                raise NotThereError("not in the file")
            return decode_tile(held, "", size_px), None
        if self._client is None:
            raise NotThereError("not in the cache (offline)")
        return self._client.get(
            self.source.address(tile),
            lambda body, kind: (decode_tile(body, kind, size_px), body),
            dict(self.source.headers),
        )

    def _absent(self, why: Exception) -> None:
        self.report.missing += isinstance(why, NotThereError)
        self.report.failed += not isinstance(why, NotThereError)
        self.report.reasons[str(why)] += 1
        hopeless = not (self.report.downloaded or self.report.cached)
        if hopeless and self.report.failed >= _HOPELESS:
            raise ImageryError(
                f"{self.source.name} gives nothing: the first {self.report.failed} tiles failed, "
                f"{self.report.reasons.most_common(1)[0][0]}.",
                hint="Check the key, the terms and the address; nothing more was asked for.",
            )

    def _keep_finished(self, pending: Iterable[_Row]) -> None:
        """Keep what had arrived when the work was stopped."""
        if self._cache is None:
            return
        done = (
            (tile, future.result()[1])
            for tile, future in itertools.chain.from_iterable(pending)
            if future.done() and not future.cancelled() and future.exception() is None
        )
        self._cache.put((t.zoom, t.column, t.row, body) for t, body in done if body is not None)


def decode_tile(body: bytes, kind: str, size_px: tuple[int, int]) -> Pixels:
    """The pixels of a PNG, JPEG or WebP tile of a size (width, height); `kind` is for the message.

    Raises
    ------
    BrokenBodyError
        Not a picture, or one that ends too early.
    ImageryError
        The tile is sound, but not of the size that the source is said to have.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            image: Image.Image = Image.open(io.BytesIO(body))
            if image.size != size_px:
                tile = image.width == image.height and image.width >= _LEAST_PX
                raise ImageryError(
                    f"The source sends tiles of {image.width} x {image.height} px, not "
                    f"{size_px[0]} x {size_px[1]} px.",
                    hint="Name it in the settings file, as [fetch.sources.NAME], with "
                    f"tile_px = {image.width}."
                    if tile
                    else None,
                )
            image.load()
    except UnidentifiedImageError:
        said = kind.partition(";")[0].strip() or "no type"
        raise BrokenBodyError(f"not a picture ({said})") from None
    except (OSError, SyntaxError, ValueError, *_BOMBS):
        raise BrokenBodyError("broken picture") from None
    if image.mode in ("RGBA", "LA", "PA") or "transparency" in image.info:
        rgba = np.asarray(image.convert("RGBA"))
        valid = rgba[..., 3] >= 128
        return np.ascontiguousarray(rgba[..., :3]), None if valid.all() else valid
    if image.mode.startswith("I;16"):
        image = image.point(lambda value: value / 257).convert("L")
    return np.asarray(image.convert("RGB")), None


def absence_error(source: Tiles, report: FetchReport, *, offline: bool) -> ImageryError:
    """The error for a product with holes, or with nothing in it."""
    parts = [f"{count} x {reason}" for reason, count in report.reasons.most_common(4)]
    told = (
        f"{report.absent} of {counted(report.wanted, 'tile')} of {source.name} could not be had "
        f"({report.missing} not there, {report.failed} failed): {'; '.join(parts)}."
    )
    if isinstance(source, MBTilesSource):
        hint = (
            "Check the place; --missing mask (of `geofield tiles`) leaves damaged ones as no-data."
        )
    else:
        repeat = "Work without --offline" if offline else "Repeat"
        hint = (
            f"{repeat} to fetch only these, or use --missing mask (of `geofield tiles`) to leave "
            "them as no-data."
        )
    return ImageryError(told, hint=hint)
