"""Sound files of every format that geofield reads, to be damaged."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from geofield.imagery import write_scene
from geofield.pipeline import plan_field
from geofield.settings import Settings
from geofield.simulate import SimulationSettings, simulate_field

FORMATS = (
    *("gpkg", "geojson", "shapefile", "kml", "gpx", "isoxml", "agopengps", "flatgeobuf"),
    *("geoparquet", "rdf", "turtle", "jsonld", "ntriples"),
)
SETTINGS = """
[imagery]
size_m = 200.0
[tracks]
spacing_m = 4.0
direction = "longest_edge"
[export]
formats = ["gpkg", "geojson"]
[fetch.sources.county]
url = "https://tiles.example.org/{z}/{x}/{y}.jpg"
may_derive = true
"""
CAPABILITIES = """<?xml version="1.0"?>
<WMS_Capabilities version="1.3.0" xmlns:xlink="http://www.w3.org/1999/xlink"><Service>
<Title>t</Title></Service><Capability><Request><GetMap><Format>image/png</Format><DCPType><HTTP>
<Get><OnlineResource xlink:href="http://127.0.0.1:9/wms"/></Get></HTTP></DCPType></GetMap></Request>
<Layer><CRS>EPSG:3857</CRS><CRS>EPSG:32633</CRS><Layer><Name>ortho</Name></Layer></Layer>
</Capability></WMS_Capabilities>"""


@dataclass(frozen=True)
class Sample:
    """A file, or a folder of which one file is damaged, and the commands that read it.

    In a command ``FILE`` is the whole, ``OUT`` an empty folder and ``POINT`` the field's point.
    """

    kind: str
    path: Path
    commands: tuple[str, ...]


def make_corpus(folder: Path) -> tuple[list[Sample], str]:
    """Write the files; returns them and the options that name the field's point."""
    made = simulate_field(5, SimulationSettings(width_px=160, height_px=160, obstacles=3))
    picture = folder / "picture.tif"
    write_scene(made.scene, picture)
    plan = plan_field(
        made.scene, lat=made.lat, lon=made.lon, settings=Settings(tracks={"spacing_m": 8.0})
    )
    out = folder / "out"
    plan.write(out, formats=list(FORMATS))
    vector = ("import FILE -o OUT/new.gpkg", "validate FILE", "info FILE")
    samples = [
        Sample(
            "GeoTIFF",
            picture,
            (
                "info FILE",
                "tiles FILE POINT --size 64 -o OUT/new.tif",
                "field FILE POINT -o OUT/f.gpkg",
            ),
        ),
        Sample(
            "GeoPackage", out / "field.gpkg", (*vector, "tracks FILE --spacing 9 -o OUT/t.gpkg")
        ),
        Sample("settings", _text(folder / "own.toml", SETTINGS), ("sources --settings FILE",)),
        Sample(
            "capabilities",
            _text(folder / "caps.xml", CAPABILITIES),
            ("tiles FILE POINT -o OUT/new.tif",),
        ),
    ]
    for suffix, kind in _KINDS.items():
        # The field first: of the other layers alone nothing can be made.
        found = sorted(out.rglob(f"*{suffix}"), key=lambda path: (path.stem != "field", path))
        # GPX is written only; it can be validated.
        commands = vector[1:] if kind == "GPX" else vector
        samples += [Sample(kind, path, commands) for path in found[:2]]
    for kind, inside in (("ISOXML folder", "TASKDATA.XML"), ("AgOpenGPS", "Field.txt")):
        for file in sorted(out.rglob(inside)):
            samples.append(Sample(kind, file.parent, vector))
    for sample in [each for each in samples if each.kind == "ISOXML folder"][:1]:
        archive = shutil.make_archive(str(folder / "task"), "zip", sample.path)
        samples.append(Sample("archive", Path(archive), vector[:2]))
    shapes = sorted(out.rglob("*.shp"))
    samples += [Sample("Shapefile", each.parent, vector) for each in shapes[:1]]
    return samples, f"--lat {made.lat} --lon {made.lon}"


_KINDS = {
    ".geojson": "GeoJSON",
    ".kml": "KML",
    ".gpx": "GPX",
    ".fgb": "FlatGeobuf",
    ".parquet": "GeoParquet",
    ".rdf": "RDF/XML",
    ".ttl": "Turtle",
    ".jsonld": "JSON-LD",
    ".nt": "N-Triples",
}


def _text(path: Path, text: str) -> Path:
    path.write_text(text)
    return path
