"""Programs that load much: loaded once, and forked into a process of its own for each run."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from fork_server import called


class Forks:
    """A program that calls `fork_server.served`, started.

    Parameters
    ----------
    line : sequence of str
        Its command line; the number of a socket and its address are added.
    environment : mapping
        What its libraries may read while they load.
    """

    def __init__(self, line: Sequence[str], environment: Mapping[str, str]) -> None:
        self.environment = dict(environment)
        self._folder = tempfile.TemporaryDirectory(prefix="forks-")
        #: Where a process is asked for.
        self.address = str(Path(self._folder.name) / "door")
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as door:
            door.bind(self.address)
            door.listen()
            self._process = subprocess.Popen(
                [*line, str(door.fileno()), self.address],
                env=self.environment,
                pass_fds=[door.fileno()],
                stdin=subprocess.PIPE,  # ends with this process
                stdout=subprocess.DEVNULL,
            )

    @property
    def are_alive(self) -> bool:
        """Whether they can run something."""
        return self._process.poll() is None

    def run(
        self,
        words: Sequence[str],
        *,
        folder: Path | None = None,
        environment: Mapping[str, str] | None = None,
        without: Sequence[str] = (),
        timeout_s: float = 300,
    ) -> subprocess.CompletedProcess[str]:
        """Run the program with these words, as `subprocess.run` would; nothing is on its stdin.

        Parameters
        ----------
        words : sequence of str
            Its arguments.
        folder : Path, optional
            Where it runs.
        environment : mapping, optional
            Other variables than the first ones.
        without : sequence of str
            Modules that it cannot import.
        timeout_s : float
            It may not take longer.
        """
        request = {
            "words": list(words),
            "folder": str(folder or Path.cwd()),
            "environment": dict(self.environment if environment is None else environment),
            "without": list(without),
        }
        with ExitStack() as around:
            nothing = around.enter_context(Path(os.devnull).open())
            out, err = (
                around.enter_context(tempfile.TemporaryFile("w+", encoding="utf-8"))
                for _ in range(2)
            )
            code = self._code(request, [each.fileno() for each in (nothing, out, err)], timeout_s)
            said = []
            for stream in (out, err):
                stream.seek(0)
                said.append(stream.read())
        return subprocess.CompletedProcess(list(words), code, *said)

    def _code(self, request: dict[str, Any], files: list[int], timeout_s: float) -> int:
        """The exit code of a run; negative, the signal that ended it."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as calls:
            calls.settimeout(timeout_s)
            process = called(calls, self.address, request, files)
            try:
                return int(calls.recv(20))
            except BaseException:
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
                raise

    def end(self) -> None:
        """No more runs."""
        self._process.communicate()
        self._folder.cleanup()
