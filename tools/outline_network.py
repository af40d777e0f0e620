"""The network that outlines are learned with, as it is trained.

A U-Net that is told the points, beside an encoder that has learned which parts of a picture belong
together: 400 outlines are too few to learn that from.
"""

from __future__ import annotations

from typing import Any, Literal

import torch
from tiny_vit import WIDTHS as KNOWN
from tiny_vit import Mlp, TinyViT, attended
from torch import Tensor, nn
from torch.nn import functional

#: Sides of the encoder's windows; of a picture of 256 px they leave no rest.
WINDOWS = (0, 8, 16, 8)
#: The channels that are taken of each stage of the encoder.
REDUCED = (24, 32, 64, 96)
#: Channels of the U-Net at each depth; so many of the upper ones compare with the points.
WIDTHS, COMPARED = (32, 48, 96, 128), 2
#: What is seen in a picture: at these shares of its side, and beside the encoder.
FEATURES = ("quarter", "eighth", "sixteenth", "stem", "colours")
#: The depth at which every place asks every other, its side, and by how many heads.
EVERYWHERE, EVERYWHERE_SIDE, HEADS = 2, 16, 4


class Block(nn.Module):
    """Two convolutions, normalised."""

    def __init__(self, taken: int, given: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Conv2d(taken, given, 3, padding=1, bias=False),
            nn.BatchNorm2d(given),
            nn.ReLU(),
            nn.Conv2d(given, given, 3, padding=1, bias=False),
            nn.BatchNorm2d(given),
            nn.ReLU(),
        )

    def forward(self, x: Tensor) -> Tensor:
        """Apply."""
        return self.layers(x)


class Everywhere(nn.Module):
    """Every place asks every other; it begins as the identity."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.each = width // HEADS
        self.where = nn.Parameter(torch.zeros(1, EVERYWHERE_SIDE**2, width))
        self.norm = nn.LayerNorm(width)
        self.qkv, self.proj = nn.Linear(width, 3 * width), nn.Linear(width, width)
        self.mlp = Mlp(width, 2)
        nn.init.zeros_(self.proj.weight)
        nn.init.zeros_(self.mlp.fc2.weight)

    def forward(self, x: Tensor) -> Tensor:
        """Apply."""
        n, width, rows, columns = x.shape
        y = x.flatten(2).transpose(1, 2)
        asked = self.qkv(self.norm(y) + self.where).view(n, -1, HEADS, 3 * self.each)
        z = attended(asked.transpose(1, 2).split(self.each, 3), None, self.training)
        y = y + self.proj(z.transpose(1, 2).reshape(n, -1, width))
        y = y + self.mlp(y)
        return y.transpose(1, 2).reshape(n, width, rows, columns)


class OutlineNet(nn.Module):
    """A U-Net that is told the points, and compares every place with them.

    Features are compared with their mean at the points that belong: how unlike a place is from
    the ground that was pointed at.
    """

    def __init__(self, bands: int, points: int) -> None:
        super().__init__()
        self.encoder = TinyViT(bands, WINDOWS)
        self.reduced = nn.ModuleList()
        for channels, width in zip(KNOWN, REDUCED, strict=True):
            narrow = nn.Conv2d(channels, width, 1, bias=False)
            self.reduced.append(nn.Sequential(narrow, nn.BatchNorm2d(width), nn.ReLU()))
        self.stem = nn.Sequential(
            nn.Conv2d(bands, 12, 3, stride=2, padding=1, bias=False),
            nn.BatchNorm2d(12),
            nn.ReLU(),
            nn.Conv2d(12, 24, 3, stride=2, padding=1, bias=False),
            nn.BatchNorm2d(24),
            nn.ReLU(),
        )
        taken = 24 + 2 * bands + points
        extra = (REDUCED[0], REDUCED[1], REDUCED[2] + REDUCED[3], 0)
        self.down = nn.ModuleList()
        for at, width in enumerate(WIDTHS):
            self.down.append(Block(taken + 2 * extra[at], width))
            taken = 2 * width if at < COMPARED else width
        asking = (Everywhere(WIDTHS[EVERYWHERE]), Everywhere(WIDTHS[EVERYWHERE]))
        self.everywhere = nn.Sequential(*asking)
        self.up = nn.ModuleList()
        for at in reversed(range(len(WIDTHS) - 1)):
            skip = 2 * WIDTHS[at] if at < COMPARED else WIDTHS[at]
            self.up.append(Block(WIDTHS[at + 1] + skip, WIDTHS[at]))
        self.out = nn.Conv2d(WIDTHS[0], 1, 1)
        self.drop = nn.Dropout2d(0.1)

    def forward(self, bands: Tensor, points: Tensor) -> Tensor:
        """Log odds of belonging, at a quarter of the resolution."""
        return self.odds(*self.picture(bands), points)

    def picture(self, bands: Tensor) -> tuple[Tensor, ...]:
        """What is seen in a picture whichever points are meant, in the order of `FEATURES`."""
        seen = [to(one) for to, one in zip(self.reduced, self.encoder(bands), strict=True)]
        deep = torch.cat(seen[2:], 1)
        return seen[0], seen[1], deep, self.stem(bands), functional.avg_pool2d(bands, 4)

    def odds(self, *given: Tensor) -> Tensor:
        """Log odds of belonging, from what is seen and the maps of the points."""
        *known, stem, colours, points = given
        at_points = points[:, :1]
        x = torch.cat([stem, colours, unlike(colours, at_points), points], 1)
        kept = []
        for at, block in enumerate(self.down):
            if at:
                x = functional.max_pool2d(x, 2)
                at_points = functional.avg_pool2d(at_points, 2)
            if at < len(known):
                x = torch.cat([x, known[at], unlike(known[at], at_points)], 1)
            x = block(x)
            if at == EVERYWHERE:
                x = self.everywhere(x)
            if at < COMPARED:
                x = torch.cat([x, unlike(x, at_points)], 1)
            kept.append(x)
        x = self.drop(kept.pop())
        for block, skip in zip(self.up, reversed(kept), strict=True):
            x = functional.interpolate(x, scale_factor=2.0, mode="nearest")
            x = block(torch.cat([x, skip], 1))
        return self.out(x)


def unlike(x: Tensor, at_points: Tensor) -> Tensor:
    """How far features are from their mean at the points."""
    share = at_points / at_points.sum((2, 3), keepdim=True)
    return torch.abs(x - (x * share).sum((2, 3), keepdim=True))


class Step(nn.Module):
    """A step of the network, as it is run: `picture` is kept for all points, `odds` asked anew."""

    def __init__(self, net: OutlineNet, step: Literal["picture", "odds"]) -> None:
        super().__init__()
        self.net, self.step = net, step

    def forward(self, *given: Tensor) -> Any:
        """Apply."""
        return getattr(self.net, self.step)(*given)
