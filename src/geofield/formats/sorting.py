"""What other programs' layers are: the field's outline, obstacles, guidance lines.

Points are obstacles and lines guidance, but for fences and the like, by the layer's name or
their own. Of polygons, one that is alone is the field; among several, whole words of the layer's
name, their kinds and its columns say whether they are outlines or obstacles, and where they are
silent, the largest is the field and what lies in it obstacles. Nothing is left out or taken
without a word.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import shapely
from numpy.typing import NDArray
from pyproj import CRS

from geofield import schema
from geofield.crossings import in_words, largest_part, mended
from geofield.crs import LONLAT
from geofield.errors import FormatWarning
from geofield.formats.foreign_tables import field_table, line_tables, obstacle_table
from geofield.model.obstacles import numbered
from geofield.notes import warn
from geofield.parts import in_parts
from geofield.wording import counted

if TYPE_CHECKING:
    import geopandas as gpd


def _words(text: str) -> frozenset[str]:
    """The whole words of a text, lower case; ``AreaFeature`` is two, and one."""
    parted = re.sub(r"(?<=[a-zäöü])(?=[A-ZÄÖÜ])", " ", text)
    return frozenset(re.findall(r"[^\W_]+", f"{parted} {text}".lower()))


_OBSTACLE_WORDS = _words(
    """obstacle obstacles obstruction obstructions hindernis hindernisse tree trees baum baeume
    bäume arbre arbres exclusion exclusions hole holes interior inner flag flags pond ponds
    building buildings areafeature pointfeature fence fences zaun zäune hedge hedges hecke hecken
    ditch ditches graben gräben wire wires wall walls mauer mauern"""
)
_FIELD_WORDS = _words(
    """field fields boundary boundaries outline outlines border perimeter parcel parcels parzelle
    parzellen schlag feld felder acker farm grenze grenzen exterior outer"""
)
_GUIDANCE_WORDS = _words(
    """ab guidance track tracks curve curves swath swaths pass passes spur spuren fahrspur
    fahrspuren leitlinie leitlinien"""
)
#: Columns that say what a shape is; lines are often told apart by their names alone.
_KIND_COLUMNS = _words("kind type typ art class fclass category layer barrier waterway natural")
_NAME_COLUMNS = _words("name label title")
#: What is no guidance and no outline where the file has others: words by geometry.
_ASIDE_WORDS = {
    "Polygon": _words("headland headlands vorgewende"),
    "LineString": _words("turn turns route routes gap gaps headland headlands vorgewende"),
}
_OBSTACLE_COLUMNS = frozenset(["obstacle_no", "obst_no", "radius_m", "buffer_m"])
_FIELD_COLUMNS = frozenset(["field_id", "area_ha", "client", "farm", "field", "crop", "crop_name"])


@dataclass(frozen=True, slots=True)
class RawLayer:
    """A table as a file has it: any columns, any CRS, geometries that may be mixed."""

    name: str
    frame: gpd.GeoDataFrame

    @classmethod
    def of_rows(cls, name: str, rows: list[dict[str, Any]]) -> RawLayer:
        """A layer of rows, each with its `geometry` in longitude and latitude."""
        import geopandas as gpd

        return cls(name, gpd.GeoDataFrame(rows, geometry="geometry", crs=LONLAT))


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """The geometries of one kind in a layer."""

    layer: str
    kind: str
    frame: Any
    #: Whether each of its shapes says that it is an obstacle, whatever the layer is called.
    stands: bool = False

    @property
    def aside(self) -> bool:
        """Whether its name says that it is neither outline nor guidance."""
        words = _ASIDE_WORDS.get(self.kind, frozenset())
        return not self.stands and bool(_words(self.layer) & words)

    @property
    def role(self) -> str:
        """Of polygons, by name, else by columns; empty where neither says or both do."""
        if self.stands:
            return "obstacles"
        columns = {str(name).lower() for name in self.frame.columns}
        for obstacle, field in (
            (_words(self.layer) & _OBSTACLE_WORDS, _words(self.layer) & _FIELD_WORDS),
            (columns & _OBSTACLE_COLUMNS, columns & _FIELD_COLUMNS),
        ):
            if bool(obstacle) != bool(field):
                return "obstacles" if obstacle else "field"
        return ""

    def told(self, count: int, what: str) -> str:
        """A line for people."""
        thing = {"Polygon": "polygon", "LineString": "line", "Point": "point"}[self.kind]
        return f"{self.layer}: {counted(count, thing)} {what}"


def sort_out(
    layers: list[RawLayer],
    tables: dict[str, Any],
    metric: CRS,
    path: Path,
    *,
    inside: bool = False,
) -> list[str]:
    """Give every foreign geometry its place, and tell what was taken as what, or left out.

    Parameters
    ----------
    layers : list of RawLayer
        In the metric CRS.
    tables : dict
        The layers found already, by name; what is found here is added.
    path : Path
        For messages and names.
    inside : bool
        Whether all lies in the field of another file: no polygon is an outline.
    """
    parts = [part for layer in layers for part in _parts(layer)]
    notes: list[str] = []
    polygons = _without_asides([part for part in parts if part.kind == "Polygon"], tables, notes)
    outlines, within = _outlines(polygons, inside or "field" in tables, notes)
    points = [part for part in parts if part.kind == "Point"]
    notes += [part.told(len(part.frame), "taken as obstacles") for part in points]
    if outlines:
        whole = _repaired(_joined(outlines), path, slivers=False)
        tables["field"] = field_table(whole, metric, path)
    lines = [part for part in parts if part.kind == "LineString"]
    fences = [part for part in lines if part.stands or _words(part.layer) & _OBSTACLE_WORDS]
    notes += [part.told(len(part.frame), "taken as obstacles, by name") for part in fences]
    standing = [*(part.frame for part in (*points, *fences)), *within]
    if standing:
        found = obstacle_table(_repaired(_joined(standing), path), metric, path)
        if "obstacles" in tables:  # behind those that have numbers
            found["obstacle_no"] = pd.NA
            found = numbered(_joined([tables["obstacles"], found]))
        tables["obstacles"] = schema.conform(schema.OBSTACLES, found, extras=True)
    lines = [part for part in lines if part not in fences]
    lines = _with_length(_without_asides(lines, tables, notes), notes)
    taken = "left out, beside the plan's own tracks" if "tracks" in tables else "taken as guidance"
    notes += [part.told(len(part.frame), taken) for part in lines]
    if (rings := sum(int(part.frame.is_ring.sum()) for part in lines)) and "field" not in tables:
        each = counted(rings, "line that ends where it begins", "lines that end where they begin")
        notes.append(f"no field in {each}: `geofield field --boundary` makes one of such a line")
    if lines and "tracks" not in tables:
        drawn = _joined([part.frame for part in lines])
        tables["tracks"], tables["segments"] = line_tables(drawn, metric, extras=True)
    elif "segments" in tables and "tracks" not in tables:
        own = tables["segments"]
        tables["tracks"], tables["segments"] = line_tables(own, metric, extras=True)
    if "tracks" in tables and "segments" not in tables:
        tables["tracks"] = numbered(tables["tracks"], "track_no")
        known = ["track_no", *schema.own_columns(schema.TRACKS, tables["tracks"]), "geometry"]
        pieces = tables["tracks"][known].explode(ignore_index=True)
        tables["segments"] = line_tables(pieces, metric, extras=True)[1]
    return notes


def _parts(layer: RawLayer) -> list[_Part]:
    frame = in_parts(layer.frame).reset_index(drop=True)
    kinds = frame.geom_type.replace("LinearRing", "LineString")
    stands = np.zeros(len(frame), bool)
    for kind, columns, others in (
        ("Polygon", _KIND_COLUMNS, _FIELD_WORDS),
        ("LineString", _KIND_COLUMNS | _NAME_COLUMNS, _GUIDANCE_WORDS),
    ):
        mine = (kinds == kind).to_numpy()
        stands[mine] = _say_obstacle(frame[mine], columns, others)
    return [
        _Part(layer.name, kind, frame[these], each)
        for kind in ("Polygon", "LineString", "Point")
        for each in (False, True)
        if (these := (kinds == kind) & (stands == each)).any()
    ]


def _say_obstacle(
    frame: gpd.GeoDataFrame, columns: Collection[str], others: frozenset[str]
) -> NDArray[np.bool_]:
    """Whether each shape's own texts name an obstacle, and nothing else that it may be."""
    texts = [""] * len(frame)
    for name in frame.columns:
        if str(name).lower() in columns:
            texts = [f"{text} {value}" for text, value in zip(texts, frame[name], strict=True)]
    words = [_words(text) for text in texts]
    return np.array([bool(w & _OBSTACLE_WORDS) and not w & others for w in words], bool)


def _without_asides(parts: list[_Part], tables: dict[str, Any], notes: list[str]) -> list[_Part]:
    """The parts without headlands, turns and the like, where others are there."""
    there = {"Polygon": "field", "LineString": "tracks"}
    rest = [part for part in parts if not part.aside]
    if not rest and not any(there[part.kind] in tables for part in parts):
        return parts
    for part in parts:
        if part.aside:
            notes.append(part.told(len(part.frame), "left out, by the layer's name"))
    return rest


def _with_length(parts: list[_Part], notes: list[str]) -> list[_Part]:
    """The parts without lines that begin and end in one place."""
    kept = []
    for part in parts:
        long = part.frame.length > 0
        if not long.all():
            notes.append(part.told(int((~long).sum()), "left out, having no length"))
        if long.any():
            kept.append(replace(part, frame=part.frame[long]))
    return kept


def _outlines(parts: list[_Part], known: bool, notes: list[str]) -> tuple[list[Any], list[Any]]:
    """Frames of outlines, none where it is known, and frames of polygons that are obstacles."""
    if not parts:
        return [], []
    if known:
        notes += [part.told(len(part.frame), "taken as obstacles") for part in parts]
        return [], [part.frame for part in parts]
    if sum(len(part.frame) for part in parts) == 1:
        notes.append(parts[0].told(1, "taken as the field, being the only one"))
        return [parts[0].frame], []
    candidates = [part for part in parts if part.role == "field"]
    candidates = candidates or [part for part in parts if part.role != "obstacles"]
    if not candidates:
        notes += [part.told(len(part.frame), "taken as obstacles, by name") for part in parts]
        return [], [part.frame for part in parts]
    # A word is no more than a word: what all of them lie in is the field.
    largest = max(parts, key=lambda part: float(part.frame.area.max()))
    if largest not in candidates and _covers(largest, candidates):
        candidates = [largest, *candidates]
    whole = _joined([part.frame.assign(_part=number) for number, part in enumerate(candidates)])
    inside = _inside_largest(whole)
    outer, inner = whole[~inside], whole[inside]
    obstacles = [part for part in parts if part not in candidates]
    for rows, what in ((outer, "taken as the field"), (inner, "inside it taken as obstacles")):
        for number, count in sorted(Counter(rows["_part"]).items()):
            notes.append(candidates[number].told(count, what))
    notes += [part.told(len(part.frame), "taken as obstacles") for part in obstacles]
    frames = [inner.drop(columns="_part")] if len(inner) else []
    return [outer.drop(columns="_part")], frames + [part.frame for part in obstacles]


def _covers(part: _Part, others: list[_Part]) -> bool:
    """Whether the largest polygon of a part covers all of the others."""
    shape = part.frame.geometry.iloc[int(np.argmax(part.frame.area.to_numpy()))]
    outer = shapely.Polygon(shape.exterior)
    return all(other.frame.geometry.covered_by(outer).all() for other in others)


def _inside_largest(frame: gpd.GeoDataFrame) -> Any:
    """Which polygons lie in the largest, whatever holes that has."""
    largest = int(np.argmax(frame.area.to_numpy()))
    outer = shapely.Polygon(frame.geometry.iloc[largest].exterior)
    inside = np.asarray(shapely.covered_by(frame.geometry.to_numpy(), outer))
    inside[largest] = False
    return inside


def _repaired(frame: gpd.GeoDataFrame, path: Path, *, slivers: bool = True) -> gpd.GeoDataFrame:
    """The table with valid polygons, of several parts where they cross themselves.

    Without `slivers` what one part has nearly all of the area of is that part.
    """
    polygons = frame.geom_type == "Polygon"
    bad = polygons & ~frame.geometry.is_valid
    if not bad.any():
        return frame
    shapes = [mended(shape) for shape in frame.geometry[bad]]
    words = f"{path.name}: "
    words += counted(
        int(bad.sum()),
        "polygon crosses itself and was repaired",
        "polygons cross themselves and were repaired",
    )
    if not slivers:
        found = [largest_part(shape) for shape in shapes]
        shapes, left_m2 = [shape for shape, _ in found], [left for _, left in found]
        whole = all(isinstance(shape, shapely.Polygon) for shape in shapes)
        kept = f" ({in_words(sum(shape.area for shape in shapes), sum(left_m2))})"
        words += kept if whole else " into parts"
    sound = frame.copy()
    sound.loc[bad, sound.geometry.name] = np.array(shapes, dtype=object)
    warn(f"{words}; look at them.", FormatWarning)
    sound = sound.explode(index_parts=False)
    spurs = sound.index.isin(frame.index[bad]) & (sound.geom_type != "Polygon")
    return sound[~spurs].reset_index(drop=True)


def _joined(frames: list[Any]) -> Any:
    return pd.concat(frames, ignore_index=True)
