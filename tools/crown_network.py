"""The network that sees crowns, as it is trained: a small U-Net at half resolution.

At each depth it adds what an encoder knows that has seen the pictures of ImageNet.
"""

from __future__ import annotations

import torch
from crown_samples import INPUTS, OUTPUTS
from pretrained import Encoder
from torch import Tensor, nn
from torch.nn import functional

WIDTHS = (24, 48, 64, 64)
#: The blocks of the encoder whose features are added, at a half to a sixteenth of the resolution.
HANDED_ON = (0, 2, 4, 7)


def step(inputs: int, outputs: int, size: int = 3, stride: int = 1) -> nn.Sequential:
    """Return a convolution with batch norm and a rectifier."""
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    )


class Residual(nn.Module):
    """Two convolutions beside the identity."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = step(width, width)
        self.second = nn.Sequential(
            nn.Conv2d(width, width, 3, 1, 1, bias=False), nn.BatchNorm2d(width)
        )

    def forward(self, x: Tensor) -> Tensor:
        return functional.relu(x + self.second(self.first(x)))


class CrownNetwork(nn.Module):
    """Bands in, one value per output and cell of two pixels out (logits, offsets, ln radius)."""

    def __init__(self) -> None:
        super().__init__()
        a, b, c, d = WIDTHS
        self.stem, self.level1 = step(len(INPUTS), a, 3, 2), Residual(a)
        self.down1, self.level2 = step(a, b, 3, 2), Residual(b)
        self.down2, self.level3 = step(b, c, 3, 2), Residual(c)
        self.down3, self.level4 = step(c, d, 3, 2), step(d, d)
        self.up3, self.join3 = step(d, c, 1), step(c, c)
        self.up2, self.join2 = step(c, b, 1), step(b, b)
        self.up1, self.join1 = step(b, a, 1), step(a, 32)
        self.head = nn.Conv2d(32, len(OUTPUTS), 1)
        self.stands3, self.stands2, self.stands1 = step(c, b), step(b, a), step(a, 16)
        self.stands = nn.Conv2d(16, 1, 1)
        self.encoder = Encoder(HANDED_ON)
        self.known = nn.ModuleList(
            nn.Conv2d(taken, given, 1, bias=False)
            for taken, given in zip(self.encoder.channels, WIDTHS, strict=True)
        )
        with torch.no_grad():
            # Nothing is added at first: weights of a network without encoder can be gone on from.
            for one in self.known.parameters():
                one.zero_()
            # Centres are rare: begin where the focal loss is calm.
            self.head.bias.zero_()
            self.head.bias[0] = -4.0
            self.head.bias[3] = 1.4
            self.head.bias[5] = -4.0
            self.stands.weight.zero_()
            self.stands.bias.zero_()

    def forward(self, x: Tensor) -> Tensor:
        seen = [known(f) for known, f in zip(self.known, self.encoder(x[:, :3]), strict=True)]
        one = self.level1(self.stem(x) + seen[0])
        two = self.level2(self.down1(one) + seen[1])
        three = self.level3(self.down2(two) + seen[2])
        four = self.level4(self.down3(three) + seen[3])
        coarse = three + twice(self.up3(four))
        middle = two + twice(self.up2(self.join3(coarse)))
        fine = one + twice(self.up1(self.join2(middle)))
        out = self.head(self.join1(fine))
        # Things are larger than crowns, and what crowns need must not be lost to them.
        z = self.stands2(middle + twice(self.stands3(coarse)))
        z = self.stands(self.stands1(fine + twice(z)))
        return torch.cat([out[:, :-1], out[:, -1:] + z], 1)


def twice(x: Tensor) -> Tensor:
    return functional.interpolate(x, scale_factor=2, mode="nearest")
