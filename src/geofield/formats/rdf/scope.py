"""Scope: which survey and which plan of tracks are meant where a graph holds several."""

from __future__ import annotations

import re
from dataclasses import dataclass

from geofield.errors import FormatError, FormatWarning, SeveralFieldsError
from geofield.formats.rdf.graph import Graph
from geofield.formats.rdf.layers import LayerMap
from geofield.notes import warn

#: The end of a plan's IRI that its content named, not a person.
_OWN_PLAN = re.compile(r"/plan(?:/[0-9a-f]{12})?$")


@dataclass(frozen=True, slots=True)
class Scope:
    """What is read of a graph, as IRIs; None where there is nothing to choose."""

    field: str | None
    survey: str | None
    plan: str | None
    #: Those of the plan.
    tracks: frozenset[str]

    def rows(self, graph: Graph, layer: LayerMap, found: list[str]) -> list[str]:
        """The rows of a layer that belong to the survey and plan that are meant."""
        owner = self.plan if layer.in_plan else self.survey
        if owner is None:
            return found
        told = graph.column("gf:inPlan" if layer.in_plan else "gf:inSurvey")
        if not layer.in_plan:
            return [iri for iri in found if told.get(iri, owner) == owner]
        tracks = found if layer.layer.name == "tracks" else tracks_of(graph, found)
        return [
            iri
            for iri, track in zip(found, tracks, strict=True)
            if (told.get(iri, owner) == owner if track is None else track in self.tracks)
        ]


def fields_of(graph: Graph) -> set[str]:
    """The fields that anything in a graph is of."""
    return {*graph.everywhere("gf:inField"), *graph.of_type("gf:Field")}


def tracks_of(graph: Graph, found: list[str]) -> list[str | None]:
    """The track that each part is of: told directly, or by its segment."""
    on_track, on_segment = graph.column("gf:onTrack"), graph.column("gf:onSegment")
    by_segment: dict[str | None, str | None] = {None: None}
    for segment in dict.fromkeys(map(on_segment.get, found)):
        if segment is not None:
            head, named, _ = segment.partition("/segment/")
            by_segment[segment] = on_track.get(segment) or (head if named else None)
    return [on_track.get(iri) or by_segment[on_segment.get(iri)] for iri in found]


def choose(graph: Graph, plan: str | None = None) -> Scope:
    """The field, survey and plan that are meant.

    `plan` is the plan's IRI or the end of it. Where there are several and none is named, the
    field's own is taken, with a warning.

    Raises
    ------
    FormatError
        When there are several fields, or no such plan.
    """
    fields = sorted(fields_of(graph))
    if len(fields) > 1:
        raise SeveralFieldsError(
            f"There are {len(fields)} fields: {', '.join(f'<{iri}>' for iri in fields[:5])}.",
            hint="geofield reads one field at a time: split the file by gf:inField.",
        )
    tracks: dict[str | None, set[str]] = {}
    for iri in graph.of_type("gf:Track"):
        tracks.setdefault(graph.value(iri, "gf:inPlan"), set()).add(iri)
    plans = {p for p in tracks if p} | set(graph.of_type("gf:TrackPlan"))
    own_first = sorted(sorted(plans), key=lambda iri: not _OWN_PLAN.search(iri))
    chosen = _one("track plan", own_first, plan)
    surveys = sorted(graph.of_type("gf:Survey"))
    survey = graph.value(chosen, "gf:basedOn") or _one("survey", surveys)
    mine = tracks.get(chosen, set()) | (set() if plan else tracks.get(None, set()))
    return Scope(fields[0] if fields else None, survey, chosen, frozenset(mine))


def _one(kind: str, found: list[str], wanted: str | None = None) -> str | None:
    if wanted is not None:
        chosen = [iri for iri in found if iri == wanted or iri.rsplit("/", 1)[-1] == wanted]
        if len(chosen) != 1:
            raise FormatError(
                f"There is no one {kind} {wanted!r}.", hint=f"Plans: {', '.join(found) or 'none'}."
            )
        return chosen[0]
    if len(found) > 1:
        warn(
            f"There are {len(found)} {kind}s ({', '.join(found)}): reading <{found[0]}>. Name "
            "another by its plan.",
            FormatWarning,
        )
    return found[0] if found else None
