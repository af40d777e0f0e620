"""geofield in QGIS: from a point in a farm field to outline, obstacles and tracks.

The plugin imports nothing of geofield and installs nothing into the Python of QGIS: it runs the
`geofield` command as a process of its own.
"""


def classFactory(iface):
    """The plugin, as QGIS loads it."""
    from .plugin import GeofieldPlugin

    return GeofieldPlugin(iface)
