"""Ways to damage a file: cut, flipped, swapped, swollen, foreign; all from a seed."""

from __future__ import annotations

import random
import re
import shutil
from pathlib import Path

#: What a name, a number or a text may hold when somebody means harm.
WORDS = (
    *(
        b"../../../../etc/passwd",
        b"/etc/hostname",
        b"=cmd|' /C calc'!A0",
        b"'; DROP TABLE field;--",
    ),
    *(
        b"<script>alert(1)</script>",
        b"%s%n%x",
        b"\x00",
        b"\xff\xfe",
        b"NaN",
        b"-Infinity",
        b"1e309",
    ),
    *(
        b"99999999999999999999",
        b"-1",
        b"",
        b"{}",
        b"[[[[[[",
        b"null",
        b"\xe2\x80\xae",
        b"A" * 70_000,
    ),
)


def damaged(source: Path, target: Path, dice: random.Random, others: list[Path]) -> str:
    """Copy a sample and damage it, or one file of it; returns what was done."""
    if source.is_dir():
        shutil.copytree(source, target)
        files = sorted(path for path in target.rglob("*") if path.is_file())
        victim = dice.choice(files)
    else:
        shutil.copy2(source, target)
        victim = target
    way = dice.choice(sorted(_WAYS))
    if way == "foreign":
        victim.write_bytes(dice.choice([each for each in others if each.is_file()]).read_bytes())
    elif way == "gone" and source.is_dir():
        victim.unlink()
    else:
        victim.write_bytes(_WAYS[way](victim.read_bytes(), dice))
    return f"{way} {victim.name}"


def _cut(body: bytes, dice: random.Random) -> bytes:
    return body[: dice.randrange(len(body) + 1)]


def _flip(body: bytes, dice: random.Random) -> bytes:
    changed = bytearray(body)
    # Heads of binary files are where the structure is.
    reach = len(changed) if dice.random() < 0.5 else min(len(changed), 600)
    for _ in range(dice.choice((1, 4, 40))):
        if reach:
            changed[dice.randrange(reach)] ^= 1 << dice.randrange(8)
    return bytes(changed)


def _swap(body: bytes, dice: random.Random) -> bytes:
    if len(body) < 8:
        return body
    a, b, c = sorted(dice.sample(range(len(body)), 3))
    return body[:a] + body[b:c] + body[a:b] + body[c:]


def _swell(body: bytes, dice: random.Random) -> bytes:
    a, b = sorted((dice.randrange(len(body) + 1), dice.randrange(len(body) + 1)))
    times = min(dice.choice((3, 50, 1000)), max(1, 8_000_000 // max(b - a, 1)))
    return body[:a] + body[a:b] * times + body[b:]


def _word(body: bytes, dice: random.Random) -> bytes:
    places = list(re.finditer(rb"[\w.+-]{2,}", body))
    if not places:
        return body
    place = dice.choice(places)
    return body[: place.start()] + dice.choice(WORDS) + body[place.end() :]


def _noise(body: bytes, dice: random.Random) -> bytes:
    return dice.randbytes(dice.choice((0, 1, 100, 5000)))


_WAYS = {
    "cut": _cut,
    "flip": _flip,
    "swap": _swap,
    "swell": _swell,
    "word": _word,
    "noise": _noise,
    "foreign": _noise,
    "gone": _noise,
}
