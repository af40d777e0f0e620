"""Provenance inside the GeoTIFF: source, dates and terms as tags, and back."""

from __future__ import annotations

import json
from collections.abc import Mapping

from geofield import __version__
from geofield.imagery.gdal import display_name
from geofield.model.scene import ImagerySource, Scene

_PREFIX = "GEOFIELD_"
_DATE_TAGS = ("ACQUISITION_DATE", "ACQUISITIONDATETIME", "IMAGERY_DATE", "datetime")


def tags_of(scene: Scene) -> dict[str, str]:
    """Every tag of a scene's file."""
    tags = source_tags(scene.source) | {_PREFIX + "BANDS": " ".join(scene.roles)}
    if scene.scaling is not None:
        tags[_PREFIX + "SCALING"] = json.dumps(list(scene.scaling))
    if scene.notes:
        tags[_PREFIX + "NOTES"] = json.dumps(list(scene.notes), ensure_ascii=False)
    return tags


def source_tags(source: ImagerySource) -> dict[str, str]:
    """Where a picture comes from and its terms, as TIFF tags; no key is ever in a source."""
    tags = {
        "AREA_OR_POINT": "Area",
        "TIFFTAG_SOFTWARE": f"geofield {__version__}",
        _PREFIX + "SOURCE": source.name,
        _PREFIX + "IMAGERY_DATE": source.date or "",
        _PREFIX + "ATTRIBUTION": source.attribution,
        _PREFIX + "LICENCE": source.licence,
        _PREFIX + "MAY_DERIVE": "yes" if source.may_derive else "no",
        _PREFIX + "MAY_CACHE": "yes" if source.may_cache else "no",
        _PREFIX + "ZOOM": "" if source.zoom is None else str(source.zoom),
    }
    if source.details:
        tags[_PREFIX + "DETAILS"] = json.dumps(dict(source.details), ensure_ascii=False)
    rights = "; ".join(part for part in (source.attribution, source.licence) if part)
    if rights:
        tags["TIFFTAG_COPYRIGHT"] = rights
    if source.name:
        tags["TIFFTAG_IMAGEDESCRIPTION"] = f"Imagery: {source.name}"
    return {name: value for name, value in tags.items() if value}


def is_ours(tags: Mapping[str, str]) -> bool:
    """Whether geofield wrote a file: it says of itself all that there is to say."""
    return _PREFIX + "MAY_DERIVE" in tags


def source_from_tags(tags: Mapping[str, str], path: str) -> ImagerySource:
    """The source that a file's tags tell, named after the file where they tell none."""

    def tag(name: str) -> str:
        return tags.get(_PREFIX + name, "")

    date = tag("IMAGERY_DATE") or next((tags[n] for n in _DATE_TAGS if tags.get(n)), "")
    zoom, details = tag("ZOOM"), _loaded(tag("DETAILS"))
    told = details.items() if isinstance(details, dict) else ()
    return ImagerySource(
        name=tag("SOURCE") or display_name(path),
        date=date or None,
        attribution=tag("ATTRIBUTION"),
        licence=tag("LICENCE") if is_ours(tags) else tags.get("TIFFTAG_COPYRIGHT", ""),
        may_derive=tag("MAY_DERIVE") != "no",
        may_cache=tag("MAY_CACHE") != "no",
        zoom=int(zoom) if zoom.isdecimal() else None,
        details=tuple((str(key), str(value)) for key, value in told),
    )


def roles_from_tags(tags: Mapping[str, str]) -> tuple[str, ...] | None:
    """What a file of ours says its bands show; None in other files."""
    return tuple(tags.get(_PREFIX + "BANDS", "").split()) or None


def scaling_from_tags(tags: Mapping[str, str]) -> tuple[float, float] | None:
    """The scaling that made the file's bytes, or None."""
    values = _loaded(tags.get(_PREFIX + "SCALING", ""))
    if isinstance(values, list) and len(values) == 2:
        return float(values[0]), float(values[1])
    return None


def notes_from_tags(tags: Mapping[str, str]) -> tuple[str, ...]:
    """What was done to the pixels before they came into the file."""
    values = _loaded(tags.get(_PREFIX + "NOTES", ""))
    return tuple(str(each) for each in values) if isinstance(values, list) else ()


def _loaded(text: str) -> object:
    if not text:
        return None
    try:
        return json.loads(text)
    except json.JSONDecodeError:  # someone else's tag of that name
        return None
