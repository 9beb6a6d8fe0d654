"""RandLA-Net in PyTorch: Hu et al. (2020), "RandLA-Net: Efficient semantic segmentation of large-scale point clouds".

Blocks have different numbers of points. They lie behind each other in one array of points, and the neighbours' numbers
of `blocks.PointLayer` keep them apart; there is no padding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from .blocks import LAYERS, PointLayer

FEATURES = 4
"""Of a point: its position in the block and its height above the bed."""

ENCODING = 10
"""Of a neighbour: distance, difference, and both positions."""

STEM = 8
WIDTHS = (8, 16, 32, 64)
"""Channels of the layers; each gives twice as many. Hu et al. use 16, 64, 128, 256 for 13 classes and blocks fifteen
times as large."""

HEAD = 16
SLOPE = 0.2
"""Of the rectifier."""

SCALE = (0.5, 0.5, 5.0, 5.0)
"""Of the features: a block is 4 m wide, and the zone of heights 0.4 m high."""


@dataclass(frozen=True)
class Tensors:
    """A `blocks.PointLayer` on the device."""

    position: Tensor
    near: Tensor
    kept: Tensor
    nearest: Tensor

    @classmethod
    def of(cls, layer: PointLayer, device: str) -> Tensors:
        """Move a layer to the device."""
        arrays = (layer.position, layer.near, layer.kept, layer.nearest)
        return cls(*(torch.from_numpy(array).to(device) for array in arrays))


class Mlp(nn.Module):
    """A fully connected layer that points or neighbours share, with batch norm; the last dimension holds channels."""

    def __init__(self, width: int, new: int, rectified: bool = True) -> None:
        super().__init__()
        self.linear = nn.Linear(width, new, bias=False)
        self.norm = nn.BatchNorm1d(new)
        self.rectified = rectified

    def forward(self, x: Tensor) -> Tensor:
        """Compute (..., new) from (..., width)."""
        found = self.norm(self.linear(x.reshape(-1, x.shape[-1])))
        if self.rectified:
            found = functional.leaky_relu(found, SLOPE, inplace=True)
        return found.reshape(*x.shape[:-1], -1)


class AttentivePooling(nn.Module):
    """Sum of the neighbours' features, each channel weighted by a learned score."""

    def __init__(self, width: int, new: int) -> None:
        super().__init__()
        self.score = nn.Linear(width, width, bias=False)
        self.mlp = Mlp(width, new)

    def forward(self, x: Tensor) -> Tensor:
        """Compute (n, new) from (n, neighbours, width)."""
        return self.mlp((torch.softmax(self.score(x), dim=1) * x).sum(dim=1))


class Aggregation(nn.Module):
    """Local spatial encoding and attentive pooling."""

    def __init__(self, width: int, new: int) -> None:
        super().__init__()
        self.encode = Mlp(ENCODING, width)
        self.pool = AttentivePooling(2 * width, new)

    def forward(self, x: Tensor, encoding: Tensor, near: Tensor) -> Tensor:
        """Compute (n, new) from (n, width)."""
        return self.pool(torch.cat([x[near], self.encode(encoding)], dim=-1))


class Block(nn.Module):
    """Dilated residual block: two aggregations, so that each point sees the neighbours of its neighbours."""

    def __init__(self, width: int, new: int) -> None:
        super().__init__()
        self.reduce = Mlp(width, new // 2)
        self.first = Aggregation(new // 2, new // 2)
        self.second = Aggregation(new // 2, new)
        self.widen = Mlp(new, 2 * new, rectified=False)
        self.shortcut = Mlp(width, 2 * new, rectified=False)

    def forward(self, x: Tensor, layer: Tensors) -> Tensor:
        """Compute (n, 2 new) from (n, width)."""
        encoding = encoded(layer.position, layer.near)
        found = self.first(self.reduce(x), encoding, layer.near)
        found = self.widen(self.second(found, encoding, layer.near))
        return functional.leaky_relu(found + self.shortcut(x), SLOPE)


def encoded(position: Tensor, near: Tensor) -> Tensor:
    """Describe where the neighbours lie, (n, neighbours, ENCODING), from positions, (n, 3), and neighbours."""
    other = position[near]
    own = position[:, None].expand_as(other)
    step = own - other
    return torch.cat([step.norm(dim=-1, keepdim=True), step, own, other], dim=-1)


class RandLaNet(nn.Module):
    """Encoder and decoder; one output, the logit of being on a rail."""

    def __init__(self) -> None:
        super().__init__()
        self.stem = Mlp(FEATURES, STEM)
        inputs = (STEM, *(2 * width for width in WIDTHS[:-1]))
        self.encoder = nn.ModuleList(Block(width, new) for width, new in zip(inputs, WIDTHS))
        self.bottom = Mlp(2 * WIDTHS[-1], 2 * WIDTHS[-1])
        above = [2 * width for width in WIDTHS]
        self.decoder = nn.ModuleList(
            Mlp(above[number] + above[min(number + 1, LAYERS - 1)], above[number]) for number in range(LAYERS)
        )
        self.head = nn.Sequential(Mlp(above[0], HEAD), nn.Linear(HEAD, 1))

    def forward(self, features: Tensor, layers: Sequence[Tensors]) -> Tensor:
        """Compute the logits, (n,), from features, (n, FEATURES)."""
        x = self.stem(features * features.new_tensor(SCALE))
        kept = []
        for block, layer in zip(self.encoder, layers):
            x = block(x, layer)
            kept.append(x)
            x = x[layer.kept]
        x = self.bottom(x)
        for number in reversed(range(LAYERS)):
            x = self.decoder[number](torch.cat([kept[number], x[layers[number].nearest]], dim=-1))
        return self.head(x)[:, 0]


def parameter_count(network: nn.Module) -> int:
    """Count the weights."""
    return sum(parameter.numel() for parameter in network.parameters())
