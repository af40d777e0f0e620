"""Staging: what keeps a person's files safe while commands write, are stopped, or meet each other.

What comes in is a folder, or a file in it; what goes out is a hidden folder beside the products,
whose files come into place together when the work ends well. Begin at `staged`, the one way in
which products are written; `claims` is who works on a folder, `leftovers` are the hidden folders
of those who were killed, `generations` the plan before the last run, `folders` how a folder is
made, why it or a file in it cannot be written, and what belongs to a file in it.
"""

from geofield.staging.claims import claimed
from geofield.staging.folders import cannot_write, log_of, refuse_locked, written_ns
from geofield.staging.leftovers import unstopped
from geofield.staging.staged import staged_file, staged_folder

__all__ = [
    "cannot_write",
    "claimed",
    "log_of",
    "refuse_locked",
    "staged_file",
    "staged_folder",
    "unstopped",
    "written_ns",
]
