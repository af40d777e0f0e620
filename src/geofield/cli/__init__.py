"""The command line: a thin layer that parses, calls one library function and prints."""

from geofield.cli.main import main

__all__ = ["main"]
