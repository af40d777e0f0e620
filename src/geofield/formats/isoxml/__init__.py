"""ISOXML (ISO 11783-10): task data of farm terminals, versions 3 and 4."""
