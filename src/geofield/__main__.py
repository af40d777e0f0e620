"""Run the command line with ``python -m geofield``."""

from geofield.cli import main

main()
