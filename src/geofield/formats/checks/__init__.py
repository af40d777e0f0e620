"""The rules of each format, as checks of a file: `geofield.formats.validation` runs them."""
