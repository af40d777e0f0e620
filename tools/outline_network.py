"""The network that outlines are learned with, as it is trained.

A U-Net that is told the points, beside an encoder that has seen the pictures of ImageNet, as far
as a sixteenth of the resolution: 400 outlines are too few to learn from what grounds look like.
"""

from __future__ import annotations

import torch
from pretrained import Encoder
from torch import Tensor, nn
from torch.nn import functional

#: After which of the encoder's blocks a quarter, an eighth and a sixteenth of the resolution is
#: handed on, and the channels that are taken of each.
HANDED_ON, REDUCED = (2, 4, 10), (24, 32, 64)
#: Channels of the U-Net at each depth; so many of the upper ones compare with the points.
WIDTHS, COMPARED = (32, 48, 72, 96), 2


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


class OutlineNet(nn.Module):
    """A U-Net that is told the points, and compares every place with them.

    Features are compared with their mean at the points that belong: how unlike a place is from
    the ground that was pointed at.
    """

    def __init__(self, bands: int, points: int) -> None:
        super().__init__()
        self.encoder = Encoder(HANDED_ON)
        self.reduced = nn.ModuleList()
        for channels, width in zip(self.encoder.channels, REDUCED, strict=True):
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
        self.down = nn.ModuleList()
        for at, width in enumerate(WIDTHS):
            extra = 2 * REDUCED[at] if at < len(REDUCED) else 0
            self.down.append(Block(taken + extra, width))
            taken = 2 * width if at < COMPARED else width
        self.up = nn.ModuleList()
        for at in reversed(range(len(WIDTHS) - 1)):
            skip = 2 * WIDTHS[at] if at < COMPARED else WIDTHS[at]
            self.up.append(Block(WIDTHS[at + 1] + skip, WIDTHS[at]))
        self.out = nn.Conv2d(WIDTHS[0], 1, 1)
        self.drop = nn.Dropout2d(0.1)

    def forward(self, bands: Tensor, points: Tensor) -> Tensor:
        """Log odds of belonging, at a quarter of the resolution."""
        seen = self.encoder(bands[:, :3])
        quarter = functional.avg_pool2d(bands, 4)
        at_points = points[:, :1]
        x = torch.cat([self.stem(bands), quarter, unlike(quarter, at_points), points], 1)
        kept = []
        for at, block in enumerate(self.down):
            if at:
                x = functional.max_pool2d(x, 2)
                at_points = functional.avg_pool2d(at_points, 2)
            if at < len(REDUCED):
                known = self.reduced[at](seen[at])
                x = torch.cat([x, known, unlike(known, at_points)], 1)
            x = block(x)
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


class Whole(nn.Module):
    """The network with one input, as it is run.

    Parameters
    ----------
    net : OutlineNet
    bands : int
        So many of the input's channels are of the picture, the others maps of the points, at the
        resolution of the picture.
    reduction : int
        Pixels of the picture to one of the answer.
    """

    def __init__(self, net: OutlineNet, bands: int, reduction: int) -> None:
        super().__init__()
        self.net, self.bands, self.reduction = net, bands, reduction

    def forward(self, x: Tensor) -> Tensor:
        """Log odds of belonging."""
        points = functional.avg_pool2d(x[:, self.bands :], self.reduction)
        return self.net(x[:, : self.bands], points)
