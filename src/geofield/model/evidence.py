"""Evidence: what the stages recorded of their work, besides the values that they made.

In files it is plain JSON; here, and only here, stand the names under which it is there.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import shapely

from geofield.model.field import Field, FieldQuality
from geofield.model.frame import Shown
from geofield.model.searched import UNSEARCHED, unsearched
from geofield.model.track_edits import TrackEdits
from geofield.model.written import DECIMALS, Written, same_shapes

#: How the doubt begins that nobody saw a part of the field.
UNSEEN = "The picture does not show"


@dataclass(frozen=True, slots=True)
class Evidence:
    """What the stages recorded."""

    #: Latitude and longitude that the field was looked for at, degrees.
    point: tuple[float, float] | None = None
    #: The outline as stage 2 left it (:func:`outline_record`): another one means a person drew.
    outline: str | None = None
    #: How obstacles were found, plain JSON values.
    detection: Mapping[str, Any] = field(default_factory=dict)
    #: The obstacles as the last stage left them; None where nobody recorded them.
    written: Written | None = None
    #: What a person changed of the tracks, as far as a stage has read it.
    track_edits: TrackEdits = field(default_factory=TrackEdits)
    #: Names of the tracks' settings that a person set on the review page.
    said_tracks: tuple[str, ...] = ()
    #: The outline that obstacles were searched in: WKT of longitude and latitude.
    searched: str | None = None
    #: Where the picture has data, pixel coordinates; None where that is all of it.
    shown_px: Shown | None = None
    #: What a farm notes of a plan of its own, plain JSON values.
    farm: Mapping[str, Any] = field(default_factory=dict)

    @property
    def obstacle_doubts(self) -> tuple[str, ...]:
        """What the picture did not allow when obstacles were looked for, in words."""
        return tuple(self.detection.get("doubts", ()))

    @property
    def knows_obstacles(self) -> bool:
        """Whether a stage looked for obstacles, or left those of a person."""
        return self.written is not None or bool(self.detection)

    @property
    def unseen(self) -> tuple[str, ...]:
        """Those of ground in the field that the picture did not show, or that nobody searched."""
        seen_not = tuple(each for each in self.obstacle_doubts if each.startswith(UNSEEN))
        return seen_not + self.unsearched

    @property
    def unsearched(self) -> tuple[str, ...]:
        """Those of ground that the outline gained after obstacles were searched."""
        return tuple(each for each in self.obstacle_doubts if each.startswith(UNSEARCHED))

    def moved(self, outline: shapely.Polygon) -> bool:
        """Whether a person moved an outline since a stage wrote it; not, where nobody knows."""
        return self.outline is not None and not is_outline(self.outline, outline)

    def with_unsearched(self, outline: Field) -> Evidence:
        """The same with the doubt about ground that the outline gained, or without it."""
        gained = unsearched(self.searched, outline.polygon, outline.crs)
        doubts = [each for each in self.obstacle_doubts if not each.startswith(UNSEARCHED)]
        doubts += [gained] if gained else []
        if tuple(doubts) == self.obstacle_doubts:
            return self
        return replace(self, detection={**self.detection, "doubts": doubts})

    def to_json(self, of: Field, tracks: Mapping[str, Any] | None) -> dict[str, Any]:
        """Plain JSON values, with those of the field's quality and of the tracks."""
        outline: dict[str, Any] = {}
        if self.outline is not None:
            outline = {"method": of.method, "outline": self.outline}
        if of.quality is not None:
            outline["quality"] = _quality_json(of.quality)
        said = {"tracks": list(self.said_tracks)} if self.said_tracks else None
        shown = shapely.to_wkt(self.shown_px, rounding_precision=0) if self.shown_px else None
        every = {
            "point": self.point and {"lat": self.point[0], "lon": self.point[1]},
            "field": outline or None,
            "shown_px": shown,
            "obstacles": dict(self.detection) or None,
            "written": None if self.written is None else self.written.to_json(),
            "track_edits": self.track_edits.to_json() if self.track_edits else None,
            "said": said,
            "farm": dict(self.farm) or None,
            "searched": self.searched,
            "tracks": None if tracks is None else dict(tracks),
        }
        return {name: value for name, value in every.items() if value is not None}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> Evidence:
        """The evidence that was written with :meth:`to_json`, by this or an earlier version."""
        point, written = value.get("point"), value.get("written")
        stage_2 = value.get("field", {})
        return cls(
            None if point is None else (float(point["lat"]), float(point["lon"])),
            stage_2.get("outline", stage_2.get("outline_sha256")),
            dict(value.get("obstacles", {})),
            None if written is None else Written.from_json(written),
            TrackEdits.from_json(value.get("track_edits", {})),
            tuple(value.get("said", {}).get("tracks", ())),
            value.get("searched"),
            shown_from_json(value),
            dict(value.get("farm", {})),
        )


def outline_record(outline: shapely.Polygon) -> str:
    """An outline in plain words, to tell whether a person has moved it since."""
    return str(shapely.to_wkt(outline, rounding_precision=DECIMALS))


def is_outline(recorded: str, outline: shapely.Polygon) -> bool:
    """Whether an outline is the one of an :func:`outline_record`, however its ring is arranged."""
    known: shapely.Geometry | None = shapely.from_wkt(recorded, on_invalid="ignore")
    if known is not None:
        return bool(same_shapes([known], [outline])[0])
    # Earlier versions wrote a fingerprint.
    ring = shapely.to_wkb(shapely.normalize(outline), byte_order=1)
    return recorded == hashlib.sha256(ring).hexdigest()


def shown_from_json(value: Mapping[str, Any]) -> Shown | None:
    """Where the picture has data, in the JSON of :meth:`Evidence.to_json`."""
    shown: Shown | None = shapely.from_wkt(value.get("shown_px"), on_invalid="ignore")
    return shown


def obstacle_doubts(value: Mapping[str, Any]) -> tuple[str, ...]:
    """The doubts about obstacles in the JSON of :meth:`Evidence.to_json`, in words."""
    return tuple(value.get("obstacles", {}).get("doubts", ()))


def quality_from_json(value: Mapping[str, Any]) -> FieldQuality | None:
    """The field's quality in the JSON of :meth:`Evidence.to_json`."""
    recorded = value.get("field", {}).get("quality")
    if not recorded:
        return None
    return FieldQuality(
        score=recorded["score"],
        reasons=tuple(recorded["reasons"]),
        figures=tuple((name, figure) for name, figure in recorded["figures"]),
        trusted=recorded["trusted"],
    )


def _quality_json(quality: FieldQuality) -> dict[str, Any]:
    return {
        **asdict(quality),
        "reasons": list(quality.reasons),
        "figures": [[name, float(figure)] for name, figure in quality.figures],
    }
