"""Tracks: the lines to drive, their segments and gaps, and the points along them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray
from pyproj import CRS
from shapely import Polygon

from geofield import schema
from geofield.crs import LONLAT, ground_scale_of, transformer
from geofield.grid import Grid
from geofield.model.card import card, field_drawn, tracks_drawn, words
from geofield.model.lost_numbers import known_by_shape
from geofield.model.map_words import heading_in_words
from geofield.model.obstacles import ObstacleShapes
from geofield.model.rows import Rows, rows_of, tables_when_asked
from geofield.model.track_edits import TrackEdits, changed_twice, edits_in
from geofield.model.track_statistics import ObstacleLoss, TrackStatistics, worked
from geofield.model.tracks_written import TracksWritten, track_numbers
from geofield.wording import counted

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import geopandas as gpd


def points_per_segment(length_m: NDArray[np.float64], step_m: float) -> NDArray[np.int64]:
    """How many points segments get: one every `step_m` from the start, and the end."""
    # A rest shorter than a millionth of a step is rounding, not a further point.
    return np.asarray(np.ceil(length_m / step_m - 1e-6).clip(min=1), dtype=np.int64) + 1


@tables_when_asked(
    lines=schema.TRACKS,
    segments=schema.SEGMENTS,
    gaps=schema.GAPS,
    headland=schema.HEADLAND,
    headland_tracks=schema.HEADLAND_TRACKS,
    route=schema.ROUTE,
    turns=schema.TURNS,
)
@dataclass(frozen=True, eq=False, repr=False)
class Tracks:
    """Planned tracks of one field.

    >>> field = gf.read_plan("sample_data/field_1.gpkg").field
    >>> tracks = gf.plan_tracks(field, spacing_m=6)
    >>> len(tracks.lines), tracks.statistics.coverage_percent > 95
    (31, True)

    Attributes
    ----------
    lines, segments, gaps : GeoDataFrame
        Layers `tracks`, `segments`, `gaps` of `geofield.schema`, in the metric CRS.
    heading_deg : float
        Of track 1, degrees clockwise from true north, 0 <= heading < 180.
    spacing_m : float
        Between neighbouring tracks, ground metres.
    width_m : float or None
        What a machine works along a track; the spacing where it is not known.
    step_m : float
        Between track points along a segment; both ends are always points.
    grid : Grid or None
        Gives the points their pixel position.
    notes : tuple of str
        What the planner had to tell.
    direction_why : str
        Why the tracks run this way, where geofield chose it, and what `fewest` would save.
    outline : shapely.Polygon or None
        The field planned in, metric CRS; None where it is not known.
    blocked_count : int
        Tracks of the layout that obstacles leave nothing of, or only pieces that are too short;
        their numbers stay free.
    losses : tuple of ObstacleLoss
        What each obstacle costs.
    shapes : ObstacleShapes or None
        What was avoided.
    headland, headland_tracks, route, turns : GeoDataFrame or None
        The optional layers of the same names, where they were planned.
    edits : TrackEdits
        What a person changed of the layout, as it was planned with.
    written : TracksWritten or None
        The segments as they were planned; None where they are those.
    """

    lines: gpd.GeoDataFrame
    segments: gpd.GeoDataFrame
    gaps: gpd.GeoDataFrame
    heading_deg: float
    spacing_m: float
    step_m: float = 1.0
    grid: Grid | None = None
    notes: tuple[str, ...] = ()
    direction_why: str = ""
    outline: Polygon | None = None
    blocked_count: int = 0
    losses: tuple[ObstacleLoss, ...] = ()
    shapes: ObstacleShapes | None = None
    headland: gpd.GeoDataFrame | None = None
    headland_tracks: gpd.GeoDataFrame | None = None
    route: gpd.GeoDataFrame | None = None
    turns: gpd.GeoDataFrame | None = None
    edits: TrackEdits = field(default_factory=TrackEdits)
    written: TracksWritten | None = None
    width_m: float | None = None

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        """Whether all tables, the outline and what is known besides are the same."""
        if not isinstance(other, Tracks):
            return NotImplemented
        mine, theirs = self.tables(), other.tables()
        return (
            (self.outline, self.evidence()) == (other.outline, other.evidence())
            and mine.keys() == theirs.keys()
            and all(mine[name].equals(theirs[name]) for name in mine)
        )

    def __repr__(self) -> str:
        return words(f"Tracks: {len(self.lines)}", self._facts())

    def _repr_html_(self) -> str:
        drawn = [tracks_drawn(self.segments.geometry)]
        if self.outline is not None:
            drawn.insert(0, field_drawn(self.outline))
        return card(counted(len(self.lines), "track"), self._facts(), drawn)

    def _facts(self) -> dict[str, str]:
        facts = {
            "segments": str(len(self.segments)),
            "length": f"{self.segments['length_m'].sum() / 1000:.2f} km",
            "spacing": f"{self.spacing_m:g} m",
            "heading": f"{heading_in_words(self.heading_deg)} degrees",
        }
        if self.turns is not None:
            unfit = int((self.turns["fits"] == "no").sum())
            facts["turns"] = f"{len(self.turns)} ({unfit} do not fit)"
        return facts

    @property
    def crs(self) -> CRS:
        """The metric CRS."""
        return CRS(self.rows()[schema.SEGMENTS.name].crs)

    def tables(self) -> dict[str, gpd.GeoDataFrame]:
        """All layers but the track points, by name; optional ones only where planned."""
        return {name: rows.frame for name, rows in self.rows().items()}

    def rows(self) -> dict[str, Rows]:
        """The same without making tables of rows that nobody asked for yet."""
        return rows_of(self)

    def edits_since(self, known: TrackEdits) -> TrackEdits:
        """What a person changed of the tracks until now, `known` before these were written."""
        if self.written is None:
            return known
        return edits_in(self.lines, self.segments, self.written, known)

    @property
    def emptied(self) -> tuple[str, ...]:
        """The layers in which a person left no row of any track that was planned."""
        if self.written is None or not self.written.rows:
            return ()
        layers = {schema.TRACKS.name: self.lines, schema.SEGMENTS.name: self.segments}
        return tuple(name for name, rows in layers.items() if not any(track_numbers(rows)))

    @property
    def partial(self) -> set[int]:
        """The planned tracks of which another program lost what stood in columns."""
        found: set[int] = set()
        for of, rows in ((schema.TRACKS, self.lines), (schema.SEGMENTS, self.segments)):
            lost = rows[of.column_names].isna().any(axis=1)
            if lost.any():
                found.update(track_numbers(rows[lost]))
        return found if self.written is None else found & set(self.written.segments)

    @property
    def changed_twice(self) -> tuple[int, ...]:
        """The tracks that a person changed in both layers, in each another way."""
        if self.written is None or self.written.are(self.lines, self.segments):
            return ()
        return changed_twice(self.lines, self.segments, self.written)

    def _written(self) -> TracksWritten:
        if self.written is not None:
            return self.written
        segments = self.rows()[schema.SEGMENTS.name]
        middle = (0.0, 0.0)
        if self.outline is not None:
            middle = (self.outline.centroid.x, self.outline.centroid.y)
        elif len(segments):
            middle = tuple(shapely.get_coordinates(segments.geometry[0])[0].tolist())
        return TracksWritten.of(
            segments.column("track_no"),
            segments.geometry,
            heading_deg=self.heading_deg,
            spacing_m=self.spacing_m,
            middle=middle,
        )

    def evidence(self) -> dict[str, Any]:
        """What the tables do not say, as plain JSON values."""
        return {
            "heading_deg": self.heading_deg,
            "spacing_m": self.spacing_m,
            "step_m": self.step_m,
            "notes": list(self.notes),
            "direction_why": self.direction_why,
            "blocked_count": self.blocked_count,
            "losses": [[each.obstacle_no, each.length_m, each.percent] for each in self.losses],
            "written": self._written().to_json(),
            **({} if self.width_m is None else {"width_m": self.width_m}),
        }

    @staticmethod
    def lie_in(tables: Mapping[str, gpd.GeoDataFrame], evidence: Mapping[str, Any]) -> bool:
        """Whether `tables` and `evidence` hold what :meth:`from_tables` needs.

        A person may have deleted a layer.
        """
        needed = (schema.TRACKS.name, schema.SEGMENTS.name, schema.GAPS.name)
        return "tracks" in evidence and all(name in tables for name in needed)

    @classmethod
    def from_tables(
        cls,
        tables: Mapping[str, gpd.GeoDataFrame],
        evidence: Mapping[str, Any],
        *,
        grid: Grid | None = None,
        outline: Polygon | None = None,
    ) -> Tracks:
        """The tracks that :meth:`tables` (`tables`) and :meth:`evidence` (`evidence`) wrote.

        `grid` gives the points their pixels, `outline` (metric CRS) the field for the figures.
        """
        written = TracksWritten.from_json(evidence["written"]) if evidence.get("written") else None
        lines, segments = tables[schema.TRACKS.name], tables[schema.SEGMENTS.name]
        if written is not None:
            lines = known_by_shape(schema.TRACKS, lines, written)
            segments = known_by_shape(schema.SEGMENTS, segments, written)
        return cls(
            lines=lines,
            segments=segments,
            gaps=tables[schema.GAPS.name],
            heading_deg=float(evidence["heading_deg"]),
            spacing_m=float(evidence["spacing_m"]),
            step_m=float(evidence["step_m"]),
            grid=grid,
            notes=tuple(evidence.get("notes", ())),
            direction_why=str(evidence.get("direction_why", "")),
            outline=outline,
            blocked_count=int(evidence.get("blocked_count", 0)),
            losses=tuple(ObstacleLoss(*loss) for loss in evidence.get("losses", ())),
            written=written,
            headland=tables.get(schema.HEADLAND.name),
            headland_tracks=tables.get(schema.HEADLAND_TRACKS.name),
            route=tables.get(schema.ROUTE.name),
            turns=tables.get(schema.TURNS.name),
            width_m=evidence.get("width_m"),
        )

    @cached_property
    def ground_scale(self) -> float:
        """Units of the CRS per metre on the ground, at the field's middle."""
        if self.outline is not None:
            return float(ground_scale_of(self.outline, self.crs))
        if not len(self.segments):
            return 1.0
        return float(ground_scale_of(shapely.box(*self.segments.total_bounds), self.crs))

    @cached_property
    def statistics(self) -> TrackStatistics:
        """Counts, lengths and areas, computed when first asked for."""
        scale = self.ground_scale
        length = self.segments["length_m"].to_numpy(dtype=np.float64)
        gap = self.gaps["length_m"].to_numpy(dtype=np.float64)
        nan = float("nan")
        area = once = every = nan
        if self.outline is not None:
            area = float(self.outline.area)
            width = (self.width_m or self.spacing_m) * scale
            once, every = worked(self.segments, self.headland_tracks, self.outline, width, scale)
        return TrackStatistics(
            track_count=len(self.lines),
            segment_count=len(length),
            gap_count=len(gap),
            point_count=int(self.lines["point_count"].sum()),
            blocked_count=self.blocked_count,
            length_m=float(length.sum()),
            gap_length_m=float(gap.sum()),
            mean_segment_m=float(length.mean()) if len(length) else nan,
            longest_segment_m=float(length.max()) if len(length) else nan,
            shortest_segment_m=float(length.min()) if len(length) else nan,
            area_ha=area / scale**2 / 10_000.0,
            worked_ha=once / scale**2 / 10_000.0,
            coverage_percent=100.0 * once / area,
            overlap_percent=100.0 * max(0.0, every - once) / area,
            losses=self.losses,
        )

    @cached_property
    def points(self) -> gpd.GeoDataFrame:
        """Layer `track_points`, computed when first asked for."""
        import pandas as pd

        chunks = list(self.point_chunks())
        if not chunks:
            return schema.empty(schema.TRACK_POINTS, self.crs)
        return pd.concat(chunks, ignore_index=True)

    def point_chunks(self, rows: int = 200_000) -> Iterator[gpd.GeoDataFrame]:
        """The track points in tables of about `rows` rows, for streaming."""
        lines = np.asarray(self.segments.geometry.to_numpy(), dtype=object)
        length = shapely.length(lines) / self.ground_scale
        counts = points_per_segment(length, self.step_m)
        track_no = self.segments["track_no"].to_numpy(dtype=np.int64)
        segment_no = self.segments["segment_no"].to_numpy(dtype=np.int64)
        batches = np.cumsum(counts) // rows
        done = 0
        for batch in np.unique(batches):
            part = np.flatnonzero(batches == batch)
            number = counts[part]
            total = int(number.sum())
            first = np.repeat(np.cumsum(number) - number, number)
            along = np.minimum(
                (np.arange(total) - first) * self.step_m, np.repeat(length[part], number)
            )
            if (shapely.get_num_coordinates(lines[part]) == 2).all() and length[part].all():
                ends = shapely.get_coordinates(lines[part]).reshape(-1, 2, 2)
                direction = (ends[:, 1] - ends[:, 0]) / length[part, None]
                xy = np.repeat(ends[:, 0], number, axis=0)
                xy += along[:, None] * np.repeat(direction, number, axis=0)
            else:
                # A person bent a segment, or left one without a length.
                xy = shapely.get_coordinates(
                    shapely.line_interpolate_point(
                        np.repeat(lines[part], number), along * self.ground_scale
                    )
                )
            lon, lat = transformer(self.crs, LONLAT).transform(xy[:, 0], xy[:, 1])
            columns = {
                "point_no": np.arange(done + 1, done + total + 1),
                "track_no": np.repeat(track_no[part], number),
                "segment_no": np.repeat(segment_no[part], number),
                "lat": lat,
                "lon": lon,
            }
            if self.grid is not None:
                x_px, y_px = self.grid.from_crs(xy[:, 0], xy[:, 1], self.crs)
                columns |= {"x_px": x_px, "y_px": y_px}
            yield schema.table(schema.TRACK_POINTS, columns, shapely.points(xy), self.crs)
            done += total
