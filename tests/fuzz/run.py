"""One damaged file through the command line, in a child with limits."""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from .corpus import Sample
from .damage import damaged

MAX_S = 20.0
MAX_MB = 1024
#: What the child may map beyond what it inherits: a runaway ends in a MemoryError, not in swap.
_MORE_BYTES = 3 << 30


@dataclass(frozen=True)
class Outcome:
    """How a command took a file."""

    kind: str
    what: str
    command: str
    code: int
    seconds: float
    megabytes: float
    said: str
    written: tuple[str, ...]

    @property
    def faults(self) -> list[str]:
        """What is not as it must be."""
        found = []
        if self.code not in (0, 1, 2):
            found.append(f"exit code {self.code}")
        if "Traceback" in self.said:
            found.append("traceback: " + self.said.strip().splitlines()[-1][:200])
        if self.code and not self.said.strip():
            found.append("no message")
        if self.code and self.written:
            found.append(f"wrote {', '.join(self.written)}")
        if self.seconds > MAX_S:
            found.append(f"{self.seconds:.0f} s")
        if self.megabytes > MAX_MB:
            found.append(f"{self.megabytes:.0f} MB")
        return found


def fuzz(
    samples: list[Sample], point: str, folder: Path, *, seed: int, files: int
) -> Iterator[Outcome]:
    """Damage `files` files, every kind in turn, and read each with one of its commands."""
    others = [each.path for each in samples]
    for number in range(files):
        sample = samples[number % len(samples)]
        dice = random.Random(f"{seed} {number}")
        place = folder / str(number)
        place.mkdir()
        target = place / sample.path.name
        what = damaged(sample.path, target, dice, others)
        command = dice.choice(sample.commands)
        yield read(sample.kind, f"{number}: {what}", target, command, point)
        shutil.rmtree(place)


def read(kind: str, what: str, target: Path, command: str, point: str) -> Outcome:
    """Run a command on a file in a child process.

    The child is a fork of this process, which has everything imported: the files are read by
    the command line as it is, without the second that each start would cost. What other tests
    left in this process is no memory of the command's.
    """
    out = target.parent / "OUT"
    out.mkdir()
    log = target.parent / "said.txt"
    words = command.replace("POINT", point).split()
    words = [word.replace("FILE", str(target)).replace("OUT", str(out)) for word in words]
    left_mb = max(_resident_mb() - _imported_mb(), 0.0)
    start = time.monotonic()
    child = os.fork()
    if child == 0:
        _be_the_command(words, log)
    status, usage = _wait(child)
    return Outcome(
        kind,
        what,
        command,
        os.waitstatus_to_exitcode(status),
        time.monotonic() - start,
        usage.ru_maxrss / 1024 - left_mb,
        log.read_text(errors="replace") if log.exists() else "",
        tuple(path.name for path in out.iterdir()),
    )


def _resident_mb() -> float:
    """What a child inherits of this process at once: pages of files come as they are touched."""
    return _status_mb("RssAnon", Path("/proc/self/status").read_text())


@cache
def _imported_mb() -> float:
    """What a process takes at most that has just begun and imported everything.

    By its own memory: what `getrusage` tells of it holds that of the process which began it, too.
    """
    code = "import geofield.cli.main; print(open('/proc/self/status').read())"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return _status_mb("VmHWM", said.stdout)


def _status_mb(name: str, status: str) -> float:
    line = next(line for line in status.splitlines() if line.startswith(f"{name}:"))
    return float(line.split()[1]) / 1024


def _wait(child: int) -> tuple[int, resource.struct_rusage]:
    until = time.monotonic() + 3 * MAX_S
    while True:
        done, status, usage = os.wait4(child, os.WNOHANG)
        if done:
            return status, usage
        if time.monotonic() > until:
            os.kill(child, signal.SIGKILL)
            return os.wait4(child, 0)[1:]
        time.sleep(0.002)


def _be_the_command(words: list[str], log: Path) -> None:
    code = 99
    try:
        with log.open("w") as file:
            os.dup2(file.fileno(), 2)
            os.dup2(file.fileno(), 1)
        sys.stdout = os.fdopen(1, "w", closefd=False)
        sys.stderr = os.fdopen(2, "w", closefd=False)
        mapped = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (mapped + _MORE_BYTES, mapped + _MORE_BYTES))
        resource.setrlimit(resource.RLIMIT_CPU, (int(MAX_S), int(MAX_S) + 5))
        os.chdir(log.parent)
        from geofield.cli.main import main

        main(words)
        code = 0
    except SystemExit as stop:
        code = stop.code if isinstance(stop.code, int) else 1 if stop.code else 0
    except BaseException:  # noqa: BLE001  (whatever it is, it is what is looked for)
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
