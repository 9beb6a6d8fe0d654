"""The networks that can be trained: FRPDF, its fast form, two other networks, and FRPDF with one of its choices undone.

All have the recurrence, batch norm and statistics per pass of FRPDF, and all but the fast form the same number of
parameters within 5 %, so that a comparison shows the effect of the architecture.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from ...core.frpdf.architecture import BASE, FAST, architecture_of
from ...core.frpdf.network import FRPDF, CustomConv2d, ProgressiveCombine2d, Recurrent, StackedConv2d, set_weights
from ...core.frpdf.weights import load_arrays
from .gradients import move, train_on_cpu

CHANNELS, KERNEL_RADIUS, DILATIONS = BASE.channels, BASE.kernel_radius, BASE.dilations
"""The numbers of FRPDF that the networks compared with it share."""
UNET_CHANNELS = (6, 13, 25, 50, 100)
"""Channels from full resolution to a sixteenth."""
ATROUS_CHANNELS = 16
"""The number in ACNN."""
ATROUS_BLOCKS = 62
"""ACNN has 64 or 128."""
ATROUS_RATES = (1, 3)
"""Dilations of the two convolutions of a block: no gaps, and the largest reach for two convolutions."""
POOLINGS = (1, 2, 4, 8, 16, 32, 64)
"""Side of the pooled cells in each block, in place of the dilations 1, 3, 7, 15, 31, 63, 127."""


class UNetLayer(nn.Module):
    """U-Net (Ronneberger, Fischer, Brox 2015): four poolings on the way down, long skips on the way up."""

    def __init__(self, channels: Sequence[int] = UNET_CHANNELS) -> None:
        super().__init__()
        self.down = nn.ModuleList(StackedConv2d(a, b, 1, 1) for a, b in zip((2, *channels), channels))
        self.up = nn.ModuleList(StackedConv2d(a + b, a, 1, 1) for a, b in zip(channels, channels[1:]))
        self.output = nn.Conv2d(channels[0], 1, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (batch, 2, height, width), sides multiples of 16, to logits."""
        levels: list[Tensor] = []
        for stacked in self.down:
            x = stacked(functional.max_pool2d(x, 2) if levels else x)
            levels.append(x)
        for stacked, level in zip(reversed(self.up), reversed(levels[:-1])):
            x = stacked(torch.cat([functional.interpolate(x, scale_factor=2.0), level], dim=1))
        return self.output(x)


class AtrousBlock(nn.Module):
    """Two dilated convolutions, added to their input."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.convolutions = nn.Sequential(*(CustomConv2d(channels, channels, 1, rate) for rate in ATROUS_RATES))

    def forward(self, x: Tensor) -> Tensor:
        """Map (batch, channels, height, width) to the same shape."""
        return x + self.convolutions(x)


class AtrousLayer(nn.Sequential):
    """The atrous network of Zhou and others (ACNN, ICRA 2020): full resolution, many narrow blocks, short skips."""

    def __init__(self) -> None:
        super().__init__(
            CustomConv2d(2, ATROUS_CHANNELS, 1, 1),
            *(AtrousBlock(ATROUS_CHANNELS) for _ in range(ATROUS_BLOCKS)),
            nn.Conv2d(ATROUS_CHANNELS, 1, 1),
        )


class PooledCombine2d(ProgressiveCombine2d):
    """`ProgressiveCombine2d` with pooling in place of dilation: as many parameters, a similar reach, coarser cells."""

    def __init__(self, channels: int, radius: int, pooling: int) -> None:
        super().__init__(channels, radius, 1)
        self.pooling = pooling

    def forward(self, x: Tensor) -> Tensor:
        """Map (batch, channels, height, width), sides multiples of the pooling, to the same shape."""
        pooled = self.dilated(functional.max_pool2d(x, self.pooling))
        return self.reduce(torch.cat([functional.interpolate(pooled, scale_factor=float(self.pooling)), x], dim=1))


class PooledLayer(nn.Sequential):
    """FRPDF with pooling in place of dilations."""

    def __init__(self) -> None:
        super().__init__(
            StackedConv2d(2, CHANNELS, KERNEL_RADIUS, 1),
            *(PooledCombine2d(CHANNELS, KERNEL_RADIUS, pooling) for pooling in POOLINGS),
            StackedConv2d(CHANNELS, CHANNELS, KERNEL_RADIUS, 1),
            nn.Conv2d(CHANNELS, 1, 1),
        )


class SkippingLayer(nn.Module):
    """FRPDF with the long skips of U-Net: the last blocks also take the results of the first ones."""

    def __init__(self) -> None:
        super().__init__()
        self.encoder = StackedConv2d(2, CHANNELS, KERNEL_RADIUS, 1)
        self.blocks = nn.ModuleList(ProgressiveCombine2d(CHANNELS, KERNEL_RADIUS, d) for d in DILATIONS)
        self.joins = nn.ModuleList(CustomConv2d(2 * CHANNELS, CHANNELS, 0, 1) for _ in range((len(DILATIONS) + 1) // 2))
        self.decoder = StackedConv2d(CHANNELS, CHANNELS, KERNEL_RADIUS, 1)
        self.output = nn.Conv2d(CHANNELS, 1, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (batch, 2, height, width) to logits."""
        x = self.encoder(x)
        first, joins = [x], iter(self.joins)
        for number, block in enumerate(self.blocks, start=1):
            x = block(x)
            if number < len(self.joins):
                first.append(x)
            else:
                x = next(joins)(torch.cat([x, first.pop()], dim=1))
        return self.output(self.decoder(x))


NETWORKS: dict[str, Callable[[], Recurrent]] = {
    "frpdf": FRPDF,
    "fast": lambda: FRPDF(FAST),
    "unet": lambda: Recurrent(UNetLayer()),
    "acnn": lambda: Recurrent(AtrousLayer()),
    "pooled": lambda: Recurrent(PooledLayer()),
    "skipping": lambda: Recurrent(SkippingLayer()),
}
"""Constructors by name."""


def parameter_count(network: nn.Module) -> int:
    """Count the trained parameters."""
    return sum(parameter.numel() for parameter in network.parameters())


def output_bias(network: Recurrent) -> Tensor:
    """Return the bias of the last convolution: the logit of a cell about which nothing is known."""
    *_, last = (module for module in network.modules() if isinstance(module, nn.Conv2d))
    if last.bias is None:
        raise ValueError("The last convolution of a network needs a bias.")
    return last.bias


class TrainedNetwork:
    """One of `NETWORKS` in the form in which it was trained, in bfloat16, with the weights of an .npz file.

    It sees a whole raster with unknown surroundings, as in training. The engines in `core.frpdf` take the surroundings
    to be empty, and compute only along the rails. The weights of "frpdf" decide which architecture it has.
    """

    def __init__(self, name: str, weights: Path) -> None:
        arrays = load_arrays(weights)
        self._network = FRPDF(architecture_of(arrays)) if name == "frpdf" else NETWORKS[name]()
        set_weights(self._network, arrays)
        self._device = "cuda" if torch.cuda.is_available() else "cpu"
        if self._device == "cpu":
            train_on_cpu(self._network)
        move(self._network.eval(), self._device)

    @property
    def parameter_count(self) -> int:
        """Number of trained parameters."""
        return parameter_count(self._network)

    @torch.no_grad()
    def probabilities(self, raster: np.ndarray, state: np.ndarray, number: int) -> np.ndarray:
        """Run a pass, by its number from 0, and return the probability of rail, (height, width) float32.

        Raster, 0 or 1, and state are those of `network.Recurrent.logits`.
        """
        seen, known = (torch.from_numpy(array)[None, None].to(self._device) for array in (raster, state))
        with torch.autocast(self._device, torch.bfloat16):
            logits = self._network.logits(seen, known, number)
        return torch.sigmoid(logits.float())[0, 0].cpu().numpy()
