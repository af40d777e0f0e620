"""The inner side of `forks.Forks`: a process that has loaded all forks for each request.

It has two ways in: a socket that listens, and its standard input, at whose end it ends.
"""

from __future__ import annotations

import json
import os
import select
import socket
import sys
import warnings
from contextlib import suppress
from typing import Any

_LARGEST_BYTES = 1_000_000


def called(calls: socket.socket, address: str, request: dict[str, Any], files: list[int]) -> int:
    """Ask for a process; its number. What it ended with comes next on the socket."""
    calls.connect(address)
    socket.send_fds(calls, [json.dumps(request).encode()], files)
    return int(calls.recv(20))


def served() -> list[str] | None:
    """Serve the socket whose number is the first argument; its address is the second.

    Returns, in a new process for each request, the words of that request, and None at the end.
    """
    with socket.socket(fileno=int(sys.argv[1])) as door, warnings.catch_warnings():
        # A thread of an allocator, which knows of forks, is no reason to warn of them.
        warnings.simplefilter("ignore", DeprecationWarning)
        waiters: set[int] = set()
        while True:
            ready, _, _ = select.select([door, sys.stdin], [], [])
            waiters -= {each for each in waiters if os.waitpid(each, os.WNOHANG)[0]}
            if door not in ready:
                return None
            calls, _ = door.accept()
            with calls:
                waiter = os.fork()
                if waiter == 0:
                    return _answered(calls)
                waiters.add(waiter)


def _answered(calls: socket.socket) -> list[str]:
    """Fork once more, and tell the caller what becomes of that process; in it, its words."""
    text, files, _, _ = socket.recv_fds(calls, _LARGEST_BYTES, 3)
    request = json.loads(text)
    process = os.fork()
    if process == 0:
        _become(request, files)
        return list(request["words"])
    for file in files:
        os.close(file)
    calls.send(str(process).encode())
    _, status = os.waitpid(process, 0)
    with suppress(BrokenPipeError):  # who asked for it has been ended
        calls.send(str(os.waitstatus_to_exitcode(status)).encode())
    os._exit(0)


def _become(request: dict[str, Any], files: list[int]) -> None:
    """Be a process that the caller started: its folder, environment and streams."""
    for number, file in enumerate(files):
        os.dup2(file, number)
        os.close(file)
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.modules.update(dict.fromkeys(request["without"]))  # type: ignore[arg-type]
