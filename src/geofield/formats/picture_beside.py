"""The picture beside a plan, where it is there and the plan is of it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from geofield.errors import FormatWarning, ImageryError
from geofield.model.scene import ImagerySource
from geofield.notes import warn


def picture_beside(path: Path, name: str | None, source: ImagerySource) -> Path | None:
    """The picture of a name beside a plan's file, where it is of the plan's `source`.

    One of another year shows other trees: it is told and not shown.
    """
    # A name alone: a stranger's file leads to no other folder.
    name = Path(str(name or "")).name
    scene = path.parent / name
    if not name or not scene.is_file():
        return None
    with suppress(ImageryError, OSError):  # one that cannot be opened is told where it is drawn
        if _begins_with(scene, source):
            return scene
        from geofield.imagery import source_of

        shown = source_of(scene)
        told = source.name and shown.name != scene.name
        if told and not shown.is_same_picture(source):
            warn(
                f"{scene.name} beside {path.name} is of {_dated(shown)}, the plan of "
                f"{_dated(source)}: it is not shown. `geofield run` puts the plan's picture there.",
                FormatWarning,
            )
            return None
    return scene


def _begins_with(scene: Path, source: ImagerySource) -> bool:
    """Whether the tags of a source stand where geofield's pictures have them.

    Most do, and a plan is read without loading what opens pictures: in 1.1 s, not 1.4.
    """
    with scene.open("rb") as file:
        head = file.read(1 << 16)
    if not source.date and b"GEOFIELD_IMAGERY_DATE" in head:
        return False
    tags = ("GEOFIELD_SOURCE", source.name), ("GEOFIELD_IMAGERY_DATE", source.date)
    return all(f'<Item name="{tag}">{word}</Item>'.encode() in head for tag, word in tags if word)


def _dated(source: ImagerySource) -> str:
    return f"{source.name} ({source.date})" if source.date else source.name
