"""Run the command line: what ``geofield`` and ``python -m geofield`` start."""

import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    # While the command line loads nothing is begun: Ctrl+C ends the process as other signals do,
    # without a traceback of whatever was being imported.
    signal.signal(signal.SIGINT, signal.SIG_DFL)

from geofield.cli import main

if __name__ == "__main__":
    main()
