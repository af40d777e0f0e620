"""QGIS: styles and a project that a person can work with at once."""
