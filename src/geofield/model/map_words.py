"""What stands on a map besides its lines: figures, credit, scale, and where a field goes on."""

from __future__ import annotations

import math

import shapely

from geofield import schema
from geofield.model.dataset import Dataset
from geofield.model.frame import along_frame
from geofield.model.obstacles import active
from geofield.wording import counted


def figures_in_words(dataset: Dataset) -> list[str]:
    """Name and area, obstacles, tracks: one line each."""
    field = dataset.table("field").iloc[0]
    obstacles, tracks = dataset.table("obstacles"), dataset.table("tracks")
    lines = [f"{dataset.name}   {field['area_ha']:.2f} ha"]
    certainty = field["certainty"]
    if math.isfinite(certainty):
        lines[0] += f"   outline {certainty:.0%} certain"
    idle = {s: int((obstacles["status"] == s).sum()) for s in schema.NOT_AVOIDED}
    others = [f"{n} {status}" for status, n in idle.items() if n]
    lines.append(", ".join([counted(len(active(obstacles)), "obstacle"), *others]))
    if len(tracks):
        facts = [
            counted(len(tracks), "track"),
            counted(int(tracks["segment_count"].sum()), "segment"),
            f"{tracks['length_m'].sum() / 1000:.2f} km",
        ]
        if math.isfinite(field["heading_deg"]):  # of imported tracks nobody recorded it
            facts.append(f"heading {heading_in_words(field['heading_deg'])}\N{DEGREE SIGN}")
        lines.append(", ".join(facts))
    return lines


def doubts_in_words(dataset: Dataset) -> list[str]:
    """What speaks against the outline, and what was not seen of obstacles: one line each."""
    doubts = dataset.table("field")["doubts"].iloc[0]
    told = [f"Check the outline: {doubts}"] if isinstance(doubts, str) and doubts else []
    return [*told, *(f"Obstacles: {each}" for each in dataset.provenance.obstacle_doubts)]


def credit_in_words(dataset: Dataset) -> str:
    """Whose picture it is, under which licence, and when it was taken."""
    source = dataset.provenance.source
    credit = "  ".join(t for t in (source.attribution or source.name, source.licence) if t)
    return f"{credit}  taken {source.date}".strip() if source.date else credit.strip()


def frame_lines(dataset: Dataset) -> list[shapely.LineString]:
    """Where the outline is the picture's edge; a parcel of the user's own is whole."""
    field = dataset.table("field")
    polygons = shapely.get_parts(field.geometry.to_numpy())
    if not len(polygons) or field["method"].iloc[0] == "boundary":
        return []
    shown_px = dataset.provenance.shown_px
    return [
        line for each in polygons for line in along_frame(each, dataset.crs, dataset.grid, shown_px)
    ]


def heading_in_words(heading_deg: float) -> str:
    """A track's heading to a tenth of a degree, from 0.0 to 179.9: 179.97 is north, as 0 is."""
    return f"{round(heading_deg, 1) % 180.0:.1f}"


def round_length_m(longest_m: float) -> float:
    """The largest round length, 1, 2 or 5 times a power of ten, that is not longer."""
    power = 10.0 ** math.floor(math.log10(longest_m))
    return max(step * power for step in (1, 2, 5) if step * power <= longest_m)


def length_in_words(length_m: float) -> str:
    """Metres, or kilometres from 1000 on."""
    return f"{length_m:g} m" if length_m < 1000 else f"{length_m / 1000:g} km"
