"""Ask forks for a process that runs these words with the caller's streams, and end as it does.

`asked_command.py ADDRESS WORD...`; it loads next to nothing, for it stands for a command.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
from pathlib import Path

from fork_server import called

with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as calls:
    request = {
        "words": sys.argv[2:],
        "folder": str(Path.cwd()),
        "environment": dict(os.environ),
        "without": [],
    }
    process = called(calls, sys.argv[1], request, [0, 1, 2])
    for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(each, lambda number, _: os.kill(process, number))
    sys.exit(int(calls.recv(20)))
