"""The signals that ask a program to stop: Ctrl+C, a polite end, a terminal that is closed."""

import signal

STOP_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
