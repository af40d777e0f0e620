"""GPX 1.1: one ``trk`` per track with one ``trkseg`` per segment, a waypoint per obstacle.

The format knows no areas: of a line that goes round one its reader makes it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import numpy as np
import shapely

from geofield import schema
from geofield.formats.antimeridian import unwrapped
from geofield.formats.arrow import exact_geometry, to_lonlat
from geofield.formats.foreign import RawLayer, layer_names, read_foreign, read_vector
from geofield.formats.origin import lineage
from geofield.formats.terminal import avoided
from geofield.formats.xml import node, write_xml
from geofield.model import Dataset
from geofield.wording import counted

if TYPE_CHECKING:
    import geopandas as gpd

GPX = "http://www.topografix.com/GPX/1/1"
_SCHEMA = "http://www.w3.org/2001/XMLSchema-instance"
DECIMALS = 9
#: How far from its start a line that goes round an area may end, share of its length.
_CLOSED = 0.05
#: What it goes round, to a circle of that length: less is the way there and back.
_ROUND = 0.05
#: A waypoint as it is written here.
_OBSTACLE = r"Obstacle (?P<obstacle_no>\d+)"
_SAID = (
    r"(?P<kind>\w+)(?:, radius (?P<radius_m>[\d.]+) m)?(?:, safety margin (?P<buffer_m>[\d.]+) m)?"
)


def write(dataset: Dataset, folder: Path, *, stem: str, options: Mapping[str, Any]) -> list[Path]:
    """Write ``{stem}.gpx``."""
    day = dataset.provenance.source.day
    metadata = [node("name", dataset.name), node("desc", lineage(dataset))]
    metadata += [node("time", f"{day}T00:00:00Z")] if day is not None else []
    about = {
        "version": "1.1",
        "creator": dataset.provenance.software or "geofield",
        "xmlns": GPX,
        "xmlns:xsi": _SCHEMA,
        "xsi:schemaLocation": f"{GPX} {GPX}/gpx.xsd",
    }
    root = node("gpx", about, node("metadata", *metadata), *_waypoints(dataset), *_tracks(dataset))
    path = folder / f"{stem}.gpx"
    write_xml(root, path)
    return [path]


def _waypoints(dataset: Dataset) -> Iterator[ET.Element]:
    obstacles = avoided(dataset)
    centres = shapely.centroid(np.asarray(obstacles.geometry.to_numpy(), dtype=object))
    places = shapely.get_coordinates(to_lonlat(centres, dataset.crs))
    for row, (lon, lat) in zip(obstacles.to_dict("records"), places, strict=True):
        name = node("name", f"Obstacle {row['obstacle_no']}")
        yield node("wpt", _position(lon, lat), name, node("desc", _describe(row)))


def _tracks(dataset: Dataset) -> Iterator[ET.Element]:
    table = dataset.table(schema.TRACKS.name)
    shapes = to_lonlat(exact_geometry(schema.TRACKS, table), dataset.crs)
    for number, shape in zip(table["track_no"], shapes, strict=True):
        segments = (
            node("trkseg", *(node("trkpt", _position(lon, lat)) for lon, lat in part.coords))
            for part in shape.geoms
        )
        yield node("trk", node("name", f"Track {number}"), node("number", str(number)), *segments)


def _position(lon: float, lat: float) -> dict[str, str]:
    # GPX has no longitude 180, only -180.
    lon = (round(lon, DECIMALS) + 180.0) % 360.0 - 180.0
    return {"lat": f"{lat:.{DECIMALS}f}", "lon": f"{lon:.{DECIMALS}f}"}


def _describe(row: Mapping[str, Any]) -> str:
    words = [str(row["kind"]) if isinstance(row["kind"], str) else "obstacle"]
    if np.isfinite(row["radius_m"]):
        words.append(f"radius {row['radius_m']:.2f} m")
    if np.isfinite(row["buffer_m"]):
        words.append(f"safety margin {row['buffer_m']:.2f} m")
    return ", ".join(words)


def read(path: Path) -> Dataset:
    """The dataset in a GPX file, of its waypoints, routes and tracks."""
    frames = [read_vector(path, name) for name in layer_names(path)]
    drawn = [frame.assign(geometry=_with_areas(frame)) for frame in frames]
    # What the layers are called is the same in every file; what this one is called is said.
    dataset = read_foreign([RawLayer(path.stem, _with_sizes(each)) for each in drawn], path)
    areas = sum(int((each.geom_type == "Polygon").sum()) for each in drawn)
    if not areas:
        return dataset
    told = counted(areas, "line ends where it began: it is", "lines end where they began: they are")
    many = "an area" if areas == 1 else "areas"
    return replace(dataset, notes=(f"{told} taken as {many}", *dataset.notes))


def _with_sizes(frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """A layer with the numbers and sizes that our own names and descriptions tell."""
    if not {"name", "desc"} <= set(frame.columns):
        return frame
    number, said = (
        frame[c].str.extract(rf"^{p}$") for c, p in (("name", _OBSTACLE), ("desc", _SAID))
    )
    if number.join(said)[["obstacle_no", "kind"]].isna().any(axis=None):
        return frame
    return frame.drop(columns=["name", "desc"]).join([number, said])


def _with_areas(frame: gpd.GeoDataFrame) -> list[Any]:
    """The shapes of a layer, of lines that go round an area the area."""
    shapes = unwrapped(np.asarray(frame.geometry.to_numpy(), dtype=object))
    return [_area_in(shape) if shapely.get_dimensions(shape) == 1 else shape for shape in shapes]


def _area_in(line: Any) -> Any:
    # Several parts are one recording with pauses.
    places = shapely.get_coordinates(line)
    if len(places) < 4:
        return line
    shrunk = places * (np.cos(np.radians(places[0, 1])), 1.0)
    steps = np.hypot(*np.diff(shrunk, axis=0).T).sum()
    gap = np.hypot(*(shrunk[-1] - shrunk[0]))
    is_round = 4.0 * np.pi * shapely.Polygon(shrunk).area >= _ROUND * steps**2
    return shapely.Polygon(places) if gap <= _CLOSED * steps and is_round else line
