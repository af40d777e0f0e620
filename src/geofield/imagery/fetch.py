"""Fetching the tiles of a block: from the cache, else from the source, row by row.

Threads fetch and decode; this thread puts rows together, keeps the cache and reports
progress. A few rows are under way at a time, so memory does not grow with the block.
"""

from __future__ import annotations

import contextlib
import itertools
from collections import Counter, deque
from collections.abc import Callable, Generator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from geofield.errors import ImageryError
from geofield.imagery.cache import CachedTile, TileCache
from geofield.imagery.client import BrokenBodyError, Client, GaveUpError, NotThereError
from geofield.imagery.decode import Pixels, decode_tile
from geofield.imagery.sources.base import LocalTiles, TileSource
from geofield.imagery.tiling import Block, Tile

Missing = Literal["error", "mask"]
Progress = Callable[[int, int, str], None]

#: After so many failures without one success the server is left in peace.
_HOPELESS = 24
#: Tiles under way at least, however short the rows are.
_AHEAD = 96


@dataclass
class FetchReport:
    """What happened while fetching.

    Attributes
    ----------
    wanted, cached, downloaded : int
        Tiles.
    missing : int
        The source has nothing there.
    failed : int
        The source has it, but never gave it whole.
    reasons : Counter
        Why, by message.
    troubles : Counter
        Faults survived, by kind.
    newest : date or None
        When the newest tile was fetched (UTC).
    """

    wanted: int = 0
    cached: int = 0
    downloaded: int = 0
    missing: int = 0
    failed: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    troubles: Counter[str] = field(default_factory=Counter)
    newest: date | None = None

    @property
    def absent(self) -> int:
        """Tiles that are not in the product."""
        return self.missing + self.failed


#: The result of a worker: pixels or None, the bytes to keep or None, the reason of absence.
_Got = tuple[Pixels | None, bytes | None, str, bool]


class TileFetcher:
    """Fetches blocks of one source.

    Parameters
    ----------
    source : TileSource or LocalTiles
    client : Client or None
        None works from the cache alone.
    cache : TileCache or None
    threads : int
    """

    def __init__(
        self,
        source: TileSource | LocalTiles,
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
        """The rows of tiles, north to south.

        Yields
        ------
        row : int
            Within the block.
        strip : uint8 array (tile height, width, 3)
            Black where there is nothing; it is used again for the next row.
        valid : bool array (tile height, width) or None
            None where every pixel is there.
        """
        self.report.wanted += block.count
        pending: deque[tuple[int, list[tuple[Tile, Future[_Got]]]]] = deque()
        executor = ThreadPoolExecutor(self._threads, thread_name_prefix="tiles")
        ahead = max(2, -(-_AHEAD // block.columns) + 1)
        width, height = block.level.tile_px
        strip = np.empty((height, width * block.columns, 3), np.uint8)
        submitted = 0
        numbers = itertools.count(1)

        def one_arrived() -> None:
            if progress is not None:
                progress(next(numbers), block.count, "tiles")

        try:
            while pending or submitted < block.rows:
                while submitted < block.rows and len(pending) < ahead:
                    pending.append((submitted, self._submitted(executor, block, submitted)))
                    submitted += 1
                row, futures = pending[0]
                valid = self._filled(strip, futures, one_arrived)
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
        futures: list[tuple[Tile, Future[_Got]]],
        one_arrived: Callable[[], None],
    ) -> NDArray[np.bool_] | None:
        """Fill a strip with its row of tiles; where it has pixels, None when everywhere."""
        valid: NDArray[np.bool_] | None = None
        keep: list[tuple[int, int, int, bytes]] = []
        width = strip.shape[1] // len(futures)
        try:
            for i, (tile, future) in enumerate(futures):
                pixels, body, reason, is_hole = future.result()
                part = np.s_[:, i * width : (i + 1) * width]
                if body is not None:
                    keep.append((tile.zoom, tile.column, tile.row, body))
                    self.report.downloaded += 1
                if pixels is None:
                    self._absent(reason, is_hole)
                strip[part] = 0 if pixels is None else pixels[0]
                if pixels is None or pixels[1] is not None:
                    if valid is None:
                        valid = np.ones(strip.shape[:2], bool)
                    valid[part] = False if pixels is None else pixels[1]
                one_arrived()
        finally:
            # Also when this stops here: a restart then fetches only the rest.
            if self._cache is not None:
                self._cache.put(keep)
        return valid

    def _submitted(
        self, executor: ThreadPoolExecutor, block: Block, row: int
    ) -> list[tuple[Tile, Future[_Got]]]:
        tiles = list(block.tiles(row))
        kept: dict[int, CachedTile] = {}
        if self._cache is not None:
            kept = self._cache.get_row(
                tiles[0].zoom,
                tiles[0].row,
                [tile.column for tile in tiles],
                stale=self._client is None,
            )
        for tile in kept.values():
            self._seen(datetime.fromtimestamp(tile.time_s, UTC).date())
        size = block.level.tile_px
        return [
            (tile, executor.submit(self._get, tile, size, kept.get(tile.column))) for tile in tiles
        ]

    def _get(self, tile: Tile, size_px: tuple[int, int], kept: CachedTile | None) -> _Got:
        """One tile, in a worker thread."""
        if kept is not None:
            # A tile damaged on disk is fetched anew.
            with contextlib.suppress(BrokenBodyError):
                return decode_tile(kept.body, "", size_px), None, "", False
        if isinstance(self.source, LocalTiles):
            return _of_file(self.source.read(tile), size_px)
        if self._client is None:
            return None, None, "not in the cache (offline)", True
        request = self.source.request(tile)

        def accept(body: bytes, kind: str) -> tuple[Pixels, bytes]:
            return decode_tile(body, kind, size_px), body

        try:
            pixels, body = self._client.get(request.url, accept, dict(request.headers))
        except NotThereError as error:
            return None, None, str(error), True
        except GaveUpError as error:
            return None, None, str(error), False
        return pixels, body, "", False

    def _absent(self, reason: str, is_hole: bool) -> None:
        if is_hole:
            self.report.missing += 1
        else:
            self.report.failed += 1
        self.report.reasons[reason] += 1
        hopeless = not (self.report.downloaded or self.report.cached)
        if hopeless and self.report.failed >= _HOPELESS:
            raise ImageryError(
                f"{self.source.name} gives nothing: the first {self.report.failed} tiles failed, "
                f"{self.report.reasons.most_common(1)[0][0]}.",
                hint="Check the key, the terms and the address; nothing more was asked for.",
            )

    def _seen(self, day: date) -> None:
        self.report.cached += 1
        if self.report.newest is None or day > self.report.newest:
            self.report.newest = day

    def _keep_finished(self, pending: deque[tuple[int, list[tuple[Tile, Future[_Got]]]]]) -> None:
        """Keep what had arrived when the work was stopped."""
        if self._cache is None:
            return
        keep = []
        for _, futures in pending:
            for tile, future in futures:
                if future.done() and not future.cancelled() and future.exception() is None:
                    body = future.result()[1]
                    if body is not None:
                        keep.append((tile.zoom, tile.column, tile.row, body))
        self._cache.put(keep)


def _of_file(body: bytes | None, size_px: tuple[int, int]) -> _Got:
    if body is None:
        return None, None, "not in the file", True
    try:
        return decode_tile(body, "", size_px), None, "", False
    except BrokenBodyError as error:
        return None, None, str(error), False


def absence_error(name: str, report: FetchReport, *, offline: bool) -> ImageryError:
    """The error for a product with holes."""
    repeat = "Work without --offline" if offline else "Repeat"
    parts = [f"{count} x {reason}" for reason, count in report.reasons.most_common(4)]
    return ImageryError(
        f"{report.absent} of {report.wanted} tiles of {name} could not be had "
        f"({report.missing} are not there, {report.failed} failed): {'; '.join(parts)}.",
        hint=f"{repeat} to fetch only these, or use --missing mask to leave them as no-data.",
    )
