"""A worker process of the pool: reads tasks from its standard input until that ends.

``python -m geofield.farm.worker`` is started by `geofield.farm.pool`; messages are pickles, one
behind the other.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import sys
import threading
from typing import Any, BinaryIO

#: The other side has gone, perhaps amid a message.
ENDED = (EOFError, pickle.UnpicklingError)


def send(stream: BinaryIO, value: Any) -> None:
    """Write a message."""
    stream.write(pickle.dumps(value))
    stream.flush()


def main() -> None:
    """Plan chunks until nobody wants more."""
    if hasattr(signal, "SIGINT"):
        # Ctrl+C is for the main process, which lets chunks end.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    # Whatever a library prints must not stand between the answers.
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    tasks: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def read() -> None:
        try:
            while True:
                tasks.put(pickle.load(sys.stdin.buffer))  # noqa: S301 - from our own parent
        except ENDED:
            # The main process has gone: a chunk that is half done does not count.
            os._exit(0)

    threading.Thread(target=read, name="tasks", daemon=True).start()
    from geofield.farm.chunk import plan_chunk
    from geofield.farm.engine import one_thread

    one_thread()
    send(answers, "ready")
    orders = tasks.get()
    while True:
        task = tasks.get()
        try:
            answer: Any = plan_chunk(task, orders)
        except Exception as error:  # noqa: BLE001 - told where the run was started
            answer = error
        send(answers, answer)


if __name__ == "__main__":
    main()
