"""Plan: field, obstacles, tracks, settings and provenance; what is written and read back."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geofield import __version__, schema
from geofield.crs import ground_scale_of
from geofield.errors import FormatError, refuse_other
from geofield.field_rows import alternatives_rows, field_from_row
from geofield.grid import Grid
from geofield.model.card import card, field_drawn, obstacles_drawn, tracks_drawn, words
from geofield.model.dataset import Dataset, Provenance
from geofield.model.evidence import Evidence
from geofield.model.field import Field
from geofield.model.frame import along_frame, with_outside
from geofield.model.rows import Rows
from geofield.model.scene import ImagerySource, Scene
from geofield.model.track_edits import TrackEdits
from geofield.model.tracks import Tracks

if TYPE_CHECKING:
    import geopandas as gpd
    import rdflib
    from matplotlib.axes import Axes
    from shapely import LineString

    from geofield.settings import Settings
    from geofield.web.html import PlanPage

_NAME_FORMATS = 'Name them: formats=["gpkg", "isoxml"].'
_NAME_OPTIONS = 'Name their format: options={"isoxml": {"farm": "Hill"}}.'
SOFTWARE = f"geofield {__version__}"


@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """All that is known of one field; stages that have not run are None.

    >>> plan = gf.read_plan("sample_data/field_1.gpkg")
    >>> plan.obstacles["status"].unique().tolist(), plan.tracks
    (['confirmed'], None)

    Attributes
    ----------
    field : Field
    obstacles : GeoDataFrame or None
        Layer `obstacles`.
    tracks : Tracks or None
    settings : Settings or None
        Of the run; None where nobody recorded them.
    source : ImagerySource
    grid : Grid or None
        Of the picture: gives pixel columns their meaning.
    evidence : Evidence
        What the stages recorded.
    scene : Scene or None
        The picture itself, where it is at hand; no part of equality.
    changes : tuple of str
        What the last run changed of an earlier plan, in words; no part of equality.
    """

    field: Field
    obstacles: gpd.GeoDataFrame | None = None
    tracks: Tracks | None = None
    settings: Settings | None = None
    source: ImagerySource = dataclasses.field(default_factory=ImagerySource)
    grid: Grid | None = None
    evidence: Evidence = dataclasses.field(default_factory=Evidence)
    scene: Scene | None = None
    changes: tuple[str, ...] = ()

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return words(f"Plan of field {self.field.name!r}", self._figures())

    def _repr_html_(self) -> str:
        drawn = [field_drawn(self.field.polygon)]
        if self.tracks is not None:
            drawn.append(tracks_drawn(self.tracks.segments.geometry))
        if self.obstacles is not None:
            drawn += obstacles_drawn(self.obstacles)
        return card(f"Plan of {self.field.name}", self._figures(), drawn)

    def _figures(self) -> dict[str, str]:
        figures = {"area": f"{self.field.area_ha:.2f} ha"}
        if self.field.certainty is not None:
            figures["certainty"] = f"{self.field.certainty:.2f}"
        if self.obstacles is None:
            figures["obstacles"] = "not looked for"
        else:
            statuses = self.obstacles["status"].value_counts().sort_index()
            figures["obstacles"] = " + ".join(f"{n} {s}" for s, n in statuses.items()) or "none"
        if self.tracks is None:
            figures["tracks"] = "not planned"
        else:
            length_m = float(self.tracks.segments["length_m"].sum())
            figures["tracks"] = f"{len(self.tracks.lines)} of {length_m / 1000:.2f} km"
        return figures

    def __eq__(self, other: object) -> bool:
        """Whether field, obstacles, tracks, settings, source, grid and evidence are the same.

        Other outlines that were merely proposed do not count.
        """
        if not isinstance(other, Plan):
            return NotImplemented
        facts = ("field", "provenance", "grid", "tracks")
        mine, theirs = self.obstacles, other.obstacles
        return all(getattr(self, name) == getattr(other, name) for name in facts) and (
            mine is theirs if mine is None or theirs is None else mine.equals(theirs)
        )

    @property
    def provenance(self) -> Provenance:
        """Where the plan comes from: software, picture, settings, and what the stages recorded."""
        tracks = None if self.tracks is None else self.tracks.evidence()
        evidence = self.evidence.to_json(self.field, tracks)
        settings = self.settings.model_dump(mode="json") if self.settings else {}
        return Provenance(SOFTWARE, self.source, settings, evidence)

    @property
    def outline_edited(self) -> bool:
        """Whether a person moved the outline since a stage wrote it."""
        return self.evidence.moved(self.field.polygon)

    @property
    def track_edits(self) -> TrackEdits:
        """What a person changed of the tracks: taken away, shortened, drawn."""
        known = self.evidence.track_edits
        return known if self.tracks is None else self.tracks.edits_since(known)

    @property
    def doubts(self) -> tuple[str, ...]:
        """What speaks against the outline, in words; that it goes on outside is always told."""
        told = () if self.outline_edited else self.field.doubts
        return with_outside(told, self.field.polygon, self.frame_lines)

    @property
    def frame_lines(self) -> list[LineString]:
        """Where the outline is the picture's edge; a parcel of the user's own is whole."""
        one = self.field
        if one.method == "boundary" and not self.outline_edited:
            return []
        return along_frame(one.polygon, one.crs, self.grid, self.evidence.shown_px)

    @property
    def point(self) -> tuple[float, float]:
        """Latitude and longitude that the field was looked for at, or of a place in it."""
        if self.evidence.point is not None:
            return self.evidence.point
        lon, lat = self.field.inside_lonlat
        return lat, lon

    def to_dataset(self) -> Dataset:
        """The tables of the plan, as formats write them."""
        return Dataset(
            tables={name: rows.frame for name, rows in self.rows().items()},
            crs=self.field.crs,
            name=self.field.name,
            provenance=self.provenance,
            grid=self.grid,
            points=None if self.tracks is None else self.tracks.point_chunks,
        )

    def rows(self) -> dict[str, Rows]:
        """All layers but the track points, by name, without making tables of them."""
        rows = {schema.FIELD.name: self._field_rows()}
        if self.obstacles is not None:
            rows[schema.OBSTACLES.name] = Rows.of(schema.OBSTACLES, self.obstacles)
        if self.tracks is not None:
            rows |= self.tracks.rows()
        if self.field.alternatives:
            rows[schema.ALTERNATIVES.name] = alternatives_rows(self.field)
        return rows

    @classmethod
    def from_dataset(cls, dataset: Dataset) -> Plan:
        """The plan that the tables of `dataset` describe; a person's edits are taken as they are.

        Raises
        ------
        FormatError
            When there is no field, or more than one.
        """
        from geofield.settings import from_mapping

        rows = dataset.table(schema.FIELD.name)
        if len(rows) != 1:
            next_step = (
                "Merge or delete rows of its layer `field` where that is one; of a farm `geofield "
                "farm get` takes a field out, `geofield farm put` takes edits in its farm.gpkg in."
                if len(rows)
                else "Draw the outline in its layer `field`; `geofield undo` brings back the plan "
                "before the last run."
            )
            raise FormatError(f"A plan has one field; this file has {len(rows)}.", hint=next_step)
        evidence = dataset.provenance.evidence
        settings = (
            from_mapping(dataset.provenance.settings) if dataset.provenance.settings else None
        )
        field = field_from_row(rows, dataset, evidence)
        obstacles = dataset.tables.get(schema.OBSTACLES.name)
        tracks, recorded = None, Evidence.from_json(evidence)
        if obstacles is not None and obstacles.empty and not recorded.knows_obstacles:
            obstacles = None  # a layer to draw in is written where nobody looked, too
        if Tracks.lie_in(dataset.tables, evidence):
            tracks = Tracks.from_tables(
                dataset.tables, evidence["tracks"], grid=dataset.grid, outline=field.polygon
            )
        elif "tracks" in evidence:
            # A layer that is gone takes no edit of another one along.
            names = (schema.TRACKS.name, schema.SEGMENTS.name, schema.GAPS.name)
            left = {name: dataset.table(name) for name in names}
            edits = Tracks.from_tables(left, evidence["tracks"]).edits_since(recorded.track_edits)
            recorded = dataclasses.replace(recorded, track_edits=edits)
        return cls(
            field=field,
            obstacles=obstacles,
            tracks=tracks,
            settings=settings,
            source=dataset.provenance.source,
            grid=dataset.grid,
            evidence=recorded,
        )

    def write(
        self,
        folder: str | Path,
        *,
        formats: str | Sequence[str] | None = None,
        overwrite: bool = False,
        options: Mapping[str, Any] | None = None,
        points: bool | None = None,
        timings_s: Mapping[str, float] | None = None,
        inputs: Sequence[str | Path] = (),
    ) -> list[Path]:
        """Write the plan's products into a folder, all or nothing.

        Parameters
        ----------
        folder : path
            Made where it does not exist.
        formats : str or sequence of str, optional
            Names of `geofield formats`; those of the settings when not given.
        overwrite : bool
            Replace products that are there already.
        options : mapping, optional
            Options of single formats, by format name.
        points : bool, optional
            Track points in linked data, too, of which they are most of the bytes; as the
            settings say when not given. Other formats have them anyway.
        timings_s : mapping, optional
            Seconds per stage, for the report.
        inputs : sequence of path
            Files that were read and must never be replaced.

        Returns
        -------
        list of Path
            The files, in the order written.
        """
        from geofield.formats import format_named
        from geofield.products import write_products
        from geofield.settings import ExportSettings

        refuse_other(formats, str | Iterable | None, "formats", _NAME_FORMATS, FormatError)
        refuse_other(options, Mapping | None, "options", _NAME_OPTIONS, FormatError)
        export = self.settings.export if self.settings else ExportSettings()
        formats = export.formats if formats is None else formats
        formats = (formats,) if isinstance(formats, str) else tuple(formats)
        wanted = export.points if points is None else points
        if wanted and any("points" in format_named(name).options for name in formats):
            options = {"points": True, **(options or {})}
        return write_products(
            self.to_dataset(),
            self.scene,
            Path(folder),
            formats=formats,
            overwrite=overwrite,
            options=options,
            timings_s=timings_s,
            inputs=inputs,
            changes=self.changes,
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the plan on its picture with matplotlib (``pip install geofield[plot]``).

        >>> plan.plot()                                              # doctest: +SKIP

        Parameters
        ----------
        ax : matplotlib Axes, optional
            A figure of its own when not given.

        Returns
        -------
        Axes
            In the plan's metric CRS; the colours are those of the map and of QGIS.
        """
        from geofield.mapping.plot import plot_dataset

        return plot_dataset(self.to_dataset(), self.scene, ax)

    def to_graph(self, *, base_iri: str | None = None, points: bool = False) -> rdflib.Graph:
        """The plan as a graph of rdflib, prefixes bound: what the RDF files hold.

        >>> len(plan.to_graph().query("SELECT ?o { ?o a gf:Obstacle }"))  # doctest: +SKIP

        Parameters
        ----------
        base_iri : str, optional
            Under which features are named; an address you control.
        points : bool
            Track points, too.
        """
        from geofield.formats.edited import made_whole
        from geofield.formats.rdf.write import to_graph

        return to_graph(made_whole(self.to_dataset()), {"base_iri": base_iri, "points": points})

    def explore(self, *, height_px: int = 560) -> PlanPage:
        """The plan as an interactive map in a notebook; works without a network.

        >>> plan.explore()                                           # doctest: +SKIP

        Parameters
        ----------
        height_px : int
            Of the map.

        Returns
        -------
        PlanPage
            Shows itself; `save` writes it as a file that opens in any browser.
        """
        from geofield.formats.edited import made_whole
        from geofield.web.html import PlanPage, document

        return PlanPage(document(made_whole(self.to_dataset()), self.scene), height_px)

    def _field_rows(self) -> Rows:
        from geofield.tracks.direction import find_baseline
        from geofield.tracks.layout import Strips

        one = self.field
        baseline = find_baseline(
            one.polygon, "longest_edge", one.crs, strips=Strips(1.0), outside=self.frame_lines
        )
        edge = baseline.edge
        edge_m = None if edge is None else edge.length / ground_scale_of(one.polygon, one.crs)
        heading = baseline.heading_deg if self.tracks is None else self.tracks.heading_deg
        return Rows(
            schema.FIELD,
            {
                "field_id": [one.field_id],
                "name": [one.name],
                "area_ha": [one.area_ha],
                "perimeter_m": [one.perimeter_m],
                "longest_edge_m": [edge_m],
                "heading_deg": [heading],
                "method": [one.method],
                "imagery": [one.imagery or None],
                "imagery_date": [one.imagery_date],
                "licence": [one.licence or None],
                "certainty": [None if self.outline_edited else one.certainty],
                "doubts": ["; ".join(self.doubts) or None],
            },
            [one.polygon],
            one.crs,
            {name: [value] for name, value in one.own},
        )


def read_plan(path: str | Path) -> Plan:
    """Read a plan back from a product that carries all of it.

    >>> gf.read_plan("sample_data/field_1.gpkg").field.method
    'truth'

    Parameters
    ----------
    path : path
        A GeoPackage or RDF file that geofield wrote, edited or not.
    """
    from geofield.formats import read_dataset

    return Plan.from_dataset(read_dataset(Path(path)))
