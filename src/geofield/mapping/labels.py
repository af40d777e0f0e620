"""Numbers on the map picture: how they look, and that none is cut or lies on another."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from PIL import Image, ImageDraw, ImageFont

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Look:
    """How a number is written."""

    size_px: int
    ink: tuple[int, int, int]
    around: tuple[int, int, int]


#: Of different look, so that nobody takes the one for the other.
OBSTACLE_LOOK = Look(13, (255, 255, 255), (0, 0, 0))
TRACK_LOOK = Look(11, (20, 24, 28), (235, 238, 240))


@dataclass(frozen=True, slots=True)
class Label:
    """A number and the places where its middle may lie, pixels, the best one first."""

    places_px: tuple[tuple[float, float], ...]
    text: str
    look: Look


def draw_labels(image: Image.Image, labels: Iterable[Label]) -> list[Box]:
    """Write numbers into a picture, the first ones first, each where it lies on no other.

    One that has no such place is left out. Returned is where they are: left, top, right, bottom in
    pixels.
    """
    draw = ImageDraw.Draw(image)
    taken: list[Box] = []
    for each in labels:
        look = each.look
        font = ImageFont.load_default(look.size_px)
        half, rise = font.getlength(each.text) / 2 + 3, look.size_px / 2 + 2
        for x_px, y_px in each.places_px:
            x = min(max(x_px, half), image.width - half)
            y = min(max(y_px, rise), image.height - rise)
            box = (x - half, y - rise, x + half, y + rise)
            if not any(_overlap(box, other) for other in taken):
                taken.append(box)
                ink, rim = look.ink, look.around
                draw.text((x, y), each.text, ink, font, "mm", stroke_width=2, stroke_fill=rim)
                break
    return taken


def _overlap(a: Box, b: Box) -> bool:
    """Whether two boxes share ground."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
