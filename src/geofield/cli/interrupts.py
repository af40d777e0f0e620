"""Interrupts of a long run: the first lets what is begun end, the second stops at once."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from geofield.cli.console import say_note


@contextmanager
def two_interrupts() -> Iterator[threading.Event]:
    """What the first Ctrl+C sets; the second, and any other stop, end the block."""
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def first(number: int, frame: Any) -> None:
        signal.signal(signal.SIGINT, before)
        stop.set()
        say_note("What is begun is finished; again Ctrl+C stops at once.")

    # Asked first: the handler can be called before a value that is handed back has its name.
    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, first)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)
