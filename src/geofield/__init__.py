"""geofield: from a point in a farm field and a picture of it to drivable geodata."""

__version__ = "0.1.0"
