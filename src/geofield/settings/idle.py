"""Settings that change nothing, because another one chose a way that they do not belong to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from geofield.settings.export import ExportSettings
from geofield.settings.field import FieldSettings
from geofield.settings.obstacles import ObstacleSettings
from geofield.settings.tracks import TrackSettings
from geofield.settings.whole import Settings, option_named

_OF_AUTO = ("cost_missed", "careful", "min_confidence", "polarity", "others")
_OF_STUDY = ("edge_method", "circle_method", "sensitivity", "grey_check")
#: The study's own files hold the points anyway.
_LINKED_DATA = {"rdf", "turtle", "jsonld", "ntriples"}


def idle(settings: Settings, said: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """A sentence for each setting that was said and changes nothing.

    Parameters
    ----------
    settings : Settings
        As they hold, from all their sources.
    said : mapping of section to mapping
        What a person said now. A settings file may serve several ways: what only stands there is
        no slip, nor is a default that is said.
    """
    told = []
    for section, reasons in _REASONS.items():
        now = getattr(settings, section)
        why = reasons(now)
        for name, value in said.get(section, {}).items():
            field = type(now).model_fields[name]
            if name in why and value != field.get_default():
                told.append(f"{option_named(name, field)} changes nothing {why[name]}.")
    return told


def _field(now: FieldSettings) -> dict[str, str]:
    if now.holes == "keep" or (now.holes is None and now.method == "study"):
        return {}
    return {"min_hole_m2": "where all holes are filled: add --holes keep"}


def _obstacles(now: ObstacleSettings) -> dict[str, str]:
    here = f"with --strategy {now.strategy}"
    if now.strategy == "auto":
        study = f"{here}: it belongs to the study's strategies, such as --strategy dlc"
        why = dict.fromkeys(_OF_STUDY, study)
        if now.min_confidence is not None and not now.careful:
            why["cost_missed"] = "beside --min-confidence, which stands instead of it"
    else:
        why = dict.fromkeys(_OF_AUTO, f"{here}: it belongs to --strategy auto")
    if now.strategy != "single":
        why["threshold"] = f"{here}: it belongs to --strategy single"
    if now.strategy in ("study_text", "study_listing"):
        why["edge_method"] = f"{here}, which looks at no edges: --strategy dlc does"
    if now.strategy.startswith("study_"):
        why["radius_m"] = f"{here}, whose radii are the study's own: --strategy dlc takes others"
    return why


def _tracks(now: TrackSettings) -> dict[str, str]:
    why: dict[str, str] = {}
    if now.route == "none":
        no_route = "without a route: add --route, such as --route boustrophedon"
        why |= dict.fromkeys(("turning_radius_m", "curve", "margin_m", "start_lonlat"), no_route)
    elif now.turning_radius_m is None:
        why["curve"] = "without the machine's turning radius: add --turning-radius"
    if now.route != "skip":
        why["skip"] = "without --route skip"
    if not now.headland_m:
        why["headland_holes"] = "without a headland: add --headland"
    if now.ab_lonlat is not None:
        why["direction"] = "beside --ab-lonlat: the tracks follow that line"
    if now.ab_lonlat is not None or now.direction not in ("dominant", "longest_edge"):
        why["straight_tolerance_m"] = "unless an edge gives the direction: dominant, longest_edge"
    # What was said of these and does not fit the other was dropped already.
    if now.overlap_m is None:
        why["overlap_m"] = "beside --spacing, which stands instead of it"
    if now.headland_passes is None:
        why["headland_passes"] = "beside --headland, which stands instead of it"
    return why


def _export(now: ExportSettings) -> dict[str, str]:
    if _LINKED_DATA & set(now.formats):
        return {}
    return {"points": "where no linked data is written: add --format rdf"}


_REASONS: Mapping[str, Callable[[Any], dict[str, str]]] = {
    "field": _field,
    "obstacles": _obstacles,
    "tracks": _tracks,
    "export": _export,
}
