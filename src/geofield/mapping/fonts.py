"""Fonts of the map picture: letters that Pillow's own font lacks come from an installed one.

Pillow brings one font, with the letters of English. Names of fields and owners of pictures have
others.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from functools import cache

from PIL import ImageFont
from PIL.ImageDraw import ImageDraw
from PIL.ImageFont import FreeTypeFont

#: Where other letters are, on Linux, macOS and Windows; found by Pillow in their usual folders.
_OTHERS = (
    "DejaVuSans.ttf",
    "NotoSans-Regular.ttf",
    "LiberationSans-Regular.ttf",
    "Arial.ttf",
    "Arial Unicode.ttf",
    "NotoSansCJK-Regular.ttc",
    "wqy-zenhei.ttc",
    "wqy-microhei.ttc",
    "DroidSansFallbackFull.ttf",
    "Hiragino Sans GB.ttc",
    "AppleSDGothicNeo.ttc",
    "msyh.ttc",
    "msgothic.ttc",
    "malgun.ttf",
)
#: Letters that do not fall apart into a plain one and its accent.
_PLAIN = str.maketrans(
    {"ß": "ss", "ł": "l", "Ł": "L", "ø": "o", "Ø": "O", "æ": "ae", "Æ": "AE", "đ": "d", "Đ": "D"}
    | {"ı": "i", "þ": "th", "©": "(c)", "œ": "oe", "Œ": "OE", "\N{EN DASH}": "-"}
)


def written(text: str, size_px: int) -> list[tuple[str, FreeTypeFont]]:
    """A text as pieces, each with the font that has most of the letters from there on.

    Letters that no font has are written without their accents, else they stay boxes.
    """
    pieces = []
    while text:
        font, count = _own(size_px), 0
        for each in _fonts(size_px):
            far = next((at for at, letter in enumerate(text) if not _has(each, letter)), len(text))
            if far > count:
                font, count = each, far
            if far == len(text):
                break
        pieces.append((text[:count] or _plain(text[0]), font))
        text = text[max(count, 1) :]
    return pieces


def length_px(text: str, size_px: int) -> float:
    """How wide a text is."""
    return sum(font.getlength(piece) for piece, font in written(text, size_px))


def write(
    draw: ImageDraw, at: tuple[float, float], text: str, size_px: int, ink: tuple[int, ...]
) -> None:
    """Write a text from a place on its baseline to the right."""
    x, y = at
    for piece, font in written(text, size_px):
        draw.text((x, y), piece, ink, font, "ls")
        x += font.getlength(piece)


def _plain(letter: str) -> str:
    parts = unicodedata.normalize("NFKD", letter.translate(_PLAIN))
    return "".join(part for part in parts if not unicodedata.combining(part))


def _fonts(size_px: int) -> Iterator[FreeTypeFont]:
    yield _own(size_px)
    for name in _OTHERS:
        font = _installed(name, size_px)
        if font is not None:
            yield font


@cache
def _own(size_px: int) -> FreeTypeFont:
    font = ImageFont.load_default(size_px)
    assert isinstance(font, FreeTypeFont)  # noqa: S101 - Pillow's wheels have FreeType
    return font


@cache
def _installed(name: str, size_px: int) -> FreeTypeFont | None:
    try:
        return ImageFont.truetype(name, size_px)
    except OSError:
        return None


@cache
def _has(font: FreeTypeFont, letter: str) -> bool:
    """Whether a letter is not drawn as the box of what no font has."""
    if letter.isspace():
        return True
    mask, box = font.getmask(letter), font.getmask("\uffff")
    return mask.size != box.size or bytes(mask) != bytes(box)
