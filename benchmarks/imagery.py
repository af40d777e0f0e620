"""Imagery: fetching 1600 tiles, memory, a window of a 4 GB COG, faults survived.

    python benchmarks/imagery.py            everything (some minutes, 12 GB in the temp folder)
    python benchmarks/imagery.py --quick    without the 4 GB file and the large mosaic

Tiles are cut from the project's own sample and served on loopback by a small server in a
process of its own, so each figure includes the server's share of the same two cores.
"""

from __future__ import annotations

import argparse
import asyncio
import hashlib
import io
import multiprocessing
import os
import random
import statistics
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from common import machine, write_page

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

LAT, LON, ZOOM = 35.075373, 33.531142, 18
SIDE = 40
THREADS = 16


# -- a quick server in its own process ---------------------------------------------------------


def sample_tiles(form: str) -> list[bytes]:
    """Tiles of 256 px cut from the sample's picture."""
    from PIL import Image

    from geofield.imagery import read_scene

    rgb = read_scene(ROOT / "sample_data" / "field_1.tif").rgb
    height, width = rgb.shape[:2]
    bodies = []
    for row in range(0, height - 255, 96):
        for column in range(0, width - 255, 96):
            image = Image.fromarray(
                np.ascontiguousarray(rgb[row : row + 256, column : column + 256])
            )
            buffer = io.BytesIO()
            image.save(buffer, form, **({"quality": 85} if form == "JPEG" else {}))
            bodies.append(buffer.getvalue())
    return bodies


def _serve(form: str, ready: multiprocessing.Queue[int]) -> None:
    bodies = sample_tiles(form)
    head = (
        f"HTTP/1.1 200 OK\r\nContent-Type: image/{form.lower()}\r\nConnection: keep-alive\r\n"
    ).encode()
    answers = [head + f"Content-Length: {len(b)}\r\n\r\n".encode() + b for b in bodies]

    class Tiles(asyncio.Protocol):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            self.transport: Any = transport
            self.rest = b""

        def data_received(self, data: bytes) -> None:
            self.rest += data
            while b"\r\n\r\n" in self.rest:
                request, _, self.rest = self.rest.partition(b"\r\n\r\n")
                path = request.split(b" ", 2)[1].split(b".")[0].strip(b"/").split(b"/")
                column, row = int(path[1]), int(path[2])
                self.transport.write(answers[(column * 7 + row * 13) % len(answers)])

    async def main() -> None:
        server = await asyncio.get_running_loop().create_server(Tiles, "127.0.0.1", 0)
        ready.put(server.sockets[0].getsockname()[1])
        await server.serve_forever()

    asyncio.run(main())


@contextmanager
def tile_server(form: str) -> Iterator[str]:
    context = multiprocessing.get_context("spawn")
    ready = context.Queue()
    process = context.Process(target=_serve, args=(form, ready), daemon=True)
    process.start()
    try:
        yield f"http://127.0.0.1:{ready.get(timeout=60)}/{{z}}/{{x}}/{{y}}.{form.lower()}"
    finally:
        process.terminate()
        process.join()


# -- 1600 tiles ------------------------------------------------------------------------------


def bare(template: str, tiles: list[tuple[int, int]]) -> None:
    """What nobody can do without: concurrent requests and decoding."""
    import urllib3
    from PIL import Image

    pool = urllib3.PoolManager(maxsize=THREADS, headers={"User-Agent": "benchmark"})

    def one(tile: tuple[int, int]) -> np.ndarray:
        url = template.format(z=ZOOM, x=tile[0], y=tile[1])
        return np.asarray(Image.open(io.BytesIO(pool.request("GET", url).data)).convert("RGB"))

    with ThreadPoolExecutor(THREADS) as executor:
        for pixels in executor.map(one, tiles):
            assert pixels.shape == (256, 256, 3)
    pool.clear()


def timed(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def timed_cpu(work: Callable[[], object]) -> tuple[float, float]:
    """Seconds on the clock, and of this process's threads on the processors."""
    begun, used = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - begun, time.process_time() - used


def fetch_speed(folder: Path, form: str, repeats: int) -> list[str]:
    import contextily

    from geofield.imagery import FetchOptions, Where, acquire
    from geofield.imagery.client import Client
    from geofield.imagery.fetch import TileFetcher
    from geofield.imagery.sources.xyz import XYZSource
    from geofield.imagery.terms import Terms
    from geofield.imagery.tiling import TilePyramid

    size = SIDE * 256 - 300  # touches SIDE x SIDE tiles when centred on one
    block = TilePyramid.web_mercator().block_around(
        ZOOM, lat=LAT, lon=LON, size_px=size, whole_tiles=True
    )
    block = replace(block, columns=SIDE, rows=SIDE)
    tiles = [(t.column, t.row) for r in range(block.rows) for t in block.tiles(r)]
    left, top = block.grid.to_native(0, 0)
    right, bottom = block.grid.to_native(block.grid.width_px, block.grid.height_px)
    # contextily takes every tile that the box touches: stay inside the outermost ones.
    west, south, east, north = left + 1, bottom + 1, right - 1, top - 1

    with tile_server(form) as template:
        source = XYZSource("bench", template, terms=Terms(may_cache=True))

        def rows_only() -> None:
            client = Client(FetchOptions(threads=THREADS))
            for _ in TileFetcher(source, client=client, threads=THREADS).rows(block):
                pass
            client.close()

        def to_array() -> None:
            client = Client(FetchOptions(threads=THREADS))
            whole = np.empty((SIDE * 256, SIDE * 256, 3), np.uint8)
            for row, strip, _ in TileFetcher(source, client=client, threads=THREADS).rows(block):
                whole[row * 256 : (row + 1) * 256] = strip
            client.close()

        where = Where(lat=LAT, lon=LON, zoom=ZOOM, size_px=size)

        def product(cache: Path | None) -> None:
            options = FetchOptions(cache_dir=cache, threads=THREADS)
            acquire(source, where, folder / "product.tif", options=options, overwrite=True)

        def cached() -> None:
            target = folder / f"cache{random.random()}"
            product(target)

        def peer_array() -> None:
            contextily.bounds2img(
                west,
                south,
                east,
                north,
                zoom=ZOOM,
                source=template,
                n_connections=THREADS,
                use_cache=False,
            )

        def peer_raster() -> None:
            contextily.bounds2raster(
                west, south, east, north, str(folder / "peer.tif"), zoom=ZOOM, source=template,
                n_connections=THREADS, use_cache=False,
            )  # fmt: skip

        works: dict[str, Callable[[], None]] = {
            "bare requests and decoding": lambda: bare(template, tiles),
            "geofield, rows checked and joined": rows_only,
            "geofield, one array": to_array,
            "contextily `bounds2img`, one array": peer_array,
            "geofield, whole product (COG, overviews)": lambda: product(None),
            "geofield, whole product, filling the cache": cached,
            "contextily `bounds2raster` (plain GeoTIFF)": peer_raster,
        }
        seconds: dict[str, list[tuple[float, float]]] = {name: [] for name in works}
        bare(template, tiles)  # warms the server
        for _ in range(repeats):
            for name, work in works.items():
                seconds[name].append(timed_cpu(work))
    medians = {
        name: [statistics.median(column) for column in zip(*values, strict=True)]
        for name, values in seconds.items()
    }
    clock, processor = medians["bare requests and decoding"]
    lines = [
        f"| {form} tiles, median of {repeats} | s | ratio to bare | processor s | ratio |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, (wall, cpu) in medians.items():
        lines.append(
            f"| {name} | {wall:.2f} | {wall / clock:.2f} | {cpu:.2f} | {cpu / processor:.2f} |"
        )
    return [*lines, ""]


# -- memory --------------------------------------------------------------------------------


def _large(template: str, folder: str, answer: multiprocessing.Queue[tuple[float, float]]) -> None:
    from geofield.imagery import FetchOptions, Where, acquire
    from geofield.imagery.sources.xyz import XYZSource

    begun = time.perf_counter()
    where = Where(lat=LAT, lon=LON, zoom=ZOOM, size_px=20_000)
    source = XYZSource("bench", template)
    acquire(source, where, Path(folder) / "large.tif", options=FetchOptions(threads=THREADS))
    # Not ru_maxrss: that starts with the parent's size.
    status = Path("/proc/self/status").read_text()
    peak = int(status.partition("VmHWM:")[2].split()[0]) / 1024
    answer.put((peak, time.perf_counter() - begun))


def memory(folder: Path) -> list[str]:
    context = multiprocessing.get_context("spawn")
    answer = context.Queue()
    with tile_server("JPEG") as template:
        process = context.Process(target=_large, args=(template, str(folder), answer))
        process.start()
        peak, seconds = answer.get(timeout=1200)
        process.join()
    size = (folder / "large.tif").stat().st_size / 2**20
    (folder / "large.tif").unlink()
    return [
        f"Mosaic of 20 000 x 20 000 px (1.2 GB of pixels, {size:.0f} MB COG): peak memory of the "
        f"process {peak:.0f} MB, {seconds:.0f} s.",
        "",
    ]


# -- a window of a 4 GB COG ---------------------------------------------------------------------


def make_large_cog(folder: Path, side: int = 36_000) -> Path:
    """A COG of noise that hardly compresses."""
    import rasterio
    import rasterio.shutil
    from affine import Affine
    from rasterio.windows import Window

    plain, cog = folder / "plain.tif", folder / "large_cog.tif"
    noise = np.random.default_rng(1).integers(0, 256, (3, 512, 4096), dtype=np.uint8)
    with rasterio.Env(GDAL_CACHEMAX=256):
        with rasterio.open(
            plain, "w", driver="GTiff", width=side, height=side, count=3, dtype="uint8",
            crs="EPSG:32636", transform=Affine(0.2, 0, 540_000, 0, -0.2, 3_890_000), tiled=True,
            blockxsize=512, blockysize=512, photometric="RGB", interleave="pixel", BIGTIFF="YES",
        ) as file:  # fmt: skip
            for row in range(0, side, 512):
                for column in range(0, side, 4096):
                    w, h = min(4096, side - column), min(512, side - row)
                    part = np.roll(noise, row + column, axis=2)[:, :h, :w]
                    file.write(part, window=Window(column, row, w, h))
        rasterio.shutil.copy(
            str(plain), str(cog), driver="COG", BLOCKSIZE=512, COMPRESS="DEFLATE", LEVEL=1,
            PREDICTOR="YES", NUM_THREADS="ALL_CPUS", BIGTIFF="YES",
        )  # fmt: skip
    plain.unlink()
    return cog


def large_window(folder: Path) -> list[str]:
    import rasterio
    from rasterio.windows import Window

    from geofield.imagery import open_reader, read_scene

    cog = make_large_cog(folder)
    size = cog.stat().st_size / 1e9
    grid = open_reader(str(cog)).grid
    places = random.Random(3)
    ours: dict[str, list[float]] = {"cold": [], "warm": []}
    theirs: dict[str, list[float]] = {"cold": [], "warm": []}

    def forget() -> None:
        with cog.open("rb") as file:
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)

    os.sync()
    for _ in range(15):
        x, y = places.uniform(2000, 34000), places.uniform(2000, 34000)
        lon, lat = grid.to_lonlat(x, y)
        for state in ("cold", "warm"):
            if state == "cold":
                forget()
            ours[state].append(timed(partial(read_scene, cog, lat=lat, lon=lon, size_px=640)))

        def peer(x: float = x, y: float = y) -> None:
            with rasterio.open(cog) as file:
                file.read(window=Window(int(x) - 320, int(y) - 320, 640, 640))

        for state in ("cold", "warm"):
            if state == "cold":
                forget()
            theirs[state].append(timed(peer))
    cog.unlink()
    lines = [
        f"A window of 640 x 640 px at random places of a COG of {size:.1f} GB "
        "(cold: the file dropped from the page cache first):",
        "",
        "| | cold, median s | warm, median s | slowest s |",
        "| --- | --- | --- | --- |",
    ]
    for name, values in (
        ("geofield `read_scene`", ours),
        ("rasterio, opening and reading", theirs),
    ):
        cold, warm = statistics.median(values["cold"]), statistics.median(values["warm"])
        lines.append(f"| {name} | {cold:.3f} | {warm:.3f} | {max(map(max, values.values())):.3f} |")
    return [*lines, ""]


# -- faults ---------------------------------------------------------------------------------


def faults(folder: Path) -> list[str]:
    from tests.imagery import tile_server as server_module
    from tests.imagery.tile_server import TileServer, chosen, first_time, serving

    from geofield.errors import NetworkError
    from geofield.imagery import Acquired, FetchOptions, Where, acquire
    from geofield.imagery.sources.xyz import XYZSource
    from geofield.imagery.terms import Terms

    where = Where(lat=LAT, lon=LON, zoom=ZOOM, size_px=19 * 256)
    options = FetchOptions(backoff_s=0.02, timeout_s=1.0)

    def run(server: TileServer, chosen_options: FetchOptions) -> Acquired:
        source = XYZSource("server", server.template, terms=Terms(may_cache=True))
        target = folder / "fault.tif"
        return acquire(source, where, target, options=chosen_options, overwrite=True)

    def digest(done: Acquired) -> str:
        return hashlib.sha256(done.path.read_bytes()).hexdigest()

    with serving() as server:
        sound = digest(run(server, options))
    lines = [
        "| fault | tiles | hit by it | lost | bytes equal to the fault-free product |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, act in server_module.TRANSIENT.items():
        with serving(first_time(act, 0.05)) as server:
            done = run(server, options)
            hit = sum(chosen(tile, 0.05) for tile in server.asked)
        equal = "yes" if digest(done) == sound else "NO"
        lines.append(f"| {name} | {done.report.wanted} | {hit} | {done.report.absent} | {equal} |")
    with serving(server_module.no_agent) as server:
        done = run(server, options)
        equal = "yes" if digest(done) == sound else "NO"
        counts = f"{done.report.wanted} | 0 | {done.report.absent}"
        lines.append(f"| 403 without User-Agent | {counts} | {equal} |")
    with serving(server_module.hole) as server:
        done = run(server, replace(options, missing="mask"))
        holes = sum(chosen(tile, 0.05, salt=1) for tile in server.asked)
        lines.append(
            f"| 404 holes, `--missing mask` | {done.report.wanted} | {holes} | "
            f"{done.report.missing} masked | (has holes) |"
        )

    def dies(handler: server_module.Handler, tile: tuple[int, int, int], attempt: int) -> bool:
        if sum(handler.server.asked.values()) > 200:
            handler.server.dead = True
        return False

    cached = replace(options, cache_dir=folder / "fault_cache", attempts=3)
    with serving(dies) as server:
        try:
            run(server, cached)
            said = "NO ERROR"
        except NetworkError:
            said = "stopped with a message"
        server.dead, server.fault = False, None
        server.asked.clear()
        done = run(server, cached)
        equal = "yes" if digest(done) == sound else "NO"
        lines.append(
            f"| server dies half-way ({said}), restarted | {done.report.wanted} | "
            f"{done.report.cached} kept, {len(server.asked)} fetched again | "
            f"{done.report.absent} | {equal} |"
        )
    return [*lines, ""]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory(prefix="geofield-bench-") as name:
        folder = Path(name)
        lines = [*machine("urllib3", "pillow", "contextily"), ""]
        lines += [f"## {SIDE * SIDE} tiles from loopback, {THREADS} threads", ""]
        for form in ("PNG", "JPEG"):
            lines += fetch_speed(folder, form, arguments.repeats)
        if not arguments.quick:
            lines += ["## Memory", "", *memory(folder)]
            lines += ["## A window of a 4 GB COG", "", *large_window(folder)]
        lines += ["## Faults", "", *faults(folder)]
    write_page("imagery", "Imagery", lines)


if __name__ == "__main__":
    main()
