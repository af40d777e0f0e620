"""Stops: signals end the work, and what is half written is taken away first.

They are Ctrl+C, SIGTERM and, unless `nohup` has it ignored, SIGHUP of a terminal that is closed.

A stop is a `KeyboardInterrupt` in the main thread. It can come where a library passes over it: in
a destructor, while C code is loaded, behind a bare ``except``. It is raised again until it is on
its way, so that none is lost.
"""

from __future__ import annotations

import _thread
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from geofield.stop_signals import STOP_SIGNALS

#: Programs say a stop in two ways at once, as they may not know which one is heard.
_SAME_STOP_S = 1.0
_AGAIN_S = 0.1
#: So many errors are looked through for a stop that lies behind them.
_DEEPEST = 100
#: Asks what became of a stop: Ctrl+C may have another handler meanwhile.
_ASKS = signal.SIGTERM
#: When this command was asked to stop, seconds; without those that were heard.
_STOPS: list[float] = []
#: Whether the next of these signals only asks.
_ASKED: list[bool] = []
#: Held while somebody asks.
_ASKING = _thread.allocate_lock()


class _Stop(KeyboardInterrupt):
    """A stop; not the bare class.

    Where that one leaves text given to `exec`, as in every dataclass that is loaded, `python -m`
    ends by the signal instead of the exit code, though it was caught since.
    """


@contextmanager
def stoppable(*, whole_process: bool) -> Iterator[None]:
    """Let other signals end the work of the block as Ctrl+C does.

    Parameters
    ----------
    whole_process : bool
        Whether nothing comes behind the block: then there is nothing to stop any more. Otherwise
        the program that called is stopped as it was before, and so is whatever it starts: a
        process inherits which signals are ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _STOPS.clear()
    hooks = sys.unraisablehook, sys.excepthook
    usual = {kind: signal.signal(kind, _stop) for kind in STOP_SIGNALS if not _ignored(kind)}
    try:
        yield
    finally:
        stop_no_more()
        if not whole_process:
            _STOPS.clear()
            with _ASKING:  # its last question would end the program
                _ASKED.clear()
            sys.unraisablehook, sys.excepthook = hooks
            for kind, handler in usual.items():
                signal.signal(kind, handler or signal.SIG_DFL)


def _ignored(kind: signal.Signals) -> bool:
    """Whether the work is to outlive its terminal; a shell's background jobs ignore Ctrl+C, too."""
    return kind.name == "SIGHUP" and signal.getsignal(kind) == signal.SIG_IGN


def stop_heard() -> None:
    """Whoever caught a stop goes on to the end of the work: the next one is a new one."""
    _STOPS.clear()


def stop_no_more() -> None:
    """All is written and said, only Python itself is taken down: there is nothing to stop."""
    for kind in STOP_SIGNALS:
        signal.signal(kind, signal.SIG_IGN)


def was_stopped() -> bool:
    """Whether a stop came: a library that was calling back may have made another error of it."""
    return bool(_STOPS)


def stop_main(kind: signal.Signals = signal.SIGINT) -> None:
    """Ctrl+C for the main thread, from another one: it also wakes from waiting for a server."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, kind)
    else:
        signal.raise_signal(kind)


def _stop(kind: int, _: Any) -> None:
    now_s = time.monotonic()
    if _ASKED and kind == _ASKS:
        _ASKED.clear()
        if not _STOPS or _on_its_way():
            return
    elif _STOPS and now_s - _STOPS[-1] < _SAME_STOP_S:
        return  # said twice; what it leaves is being taken away
    else:
        if not _STOPS:
            # `threading` has locks, one of which may be held where this came.
            _thread.start_new_thread(_ask, ())
        _STOPS.append(now_s)
    sys.unraisablehook = _say_no_unheard
    sys.excepthook = _say_no_stop
    raise _Stop


def _ask() -> None:
    """Ask what became of the stop, until somebody heard it."""
    with _ASKING:
        time.sleep(_AGAIN_S)
        while _STOPS:
            _ASKED.append(True)
            stop_main(_ASKS)
            time.sleep(_AGAIN_S)


def _on_its_way() -> bool:
    """Whether what the main thread does now is to clean up behind a stop."""
    error = sys.exc_info()[1]
    for _ in range(_DEEPEST):  # libraries that set contexts can make a ring of them
        if error is None or isinstance(error, _Stop):
            break
        error = error.__context__
    return isinstance(error, _Stop)


def _say_no_stop(kind: type[BaseException], error: BaseException, trace: Any) -> None:
    """A library's C code that is loaded while a stop comes prints it, then fails to load."""
    if not issubclass(kind, KeyboardInterrupt):
        sys.__excepthook__(kind, error, trace)


def _say_no_unheard(unheard: Any) -> None:
    """What a destructor does not hear is no news: it comes again."""
    if not issubclass(unheard.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unheard)
