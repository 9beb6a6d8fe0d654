"""FRPDF as it is trained, with the class names of the paper (docs/network.md).

Every layer keeps the resolution of the raster, or that of its blocks; context comes from dilation alone.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor, nn

from . import DEFAULT_PASSES, FEEDBACK_THRESHOLD, START, STATISTICS
from .architecture import BASE, Architecture, Combined, Stacked, Stage


class PassBatchNorm2d(nn.BatchNorm2d):
    """Batch norm with running statistics for each kind of pass; scale and shift are shared by all passes.

    The state is constant in the first pass and binary in all later ones, so activations differ between them, and one
    set of running statistics fits neither (docs/method.md section 3).
    """

    momentum: float

    def __init__(self, channels: int) -> None:
        super().__init__(channels)
        for number in range(1, STATISTICS):
            self.register_buffer(f"running_mean_{number}", torch.zeros(channels))
            self.register_buffer(f"running_var_{number}", torch.ones(channels))
        self.current_pass = 0

    def forward(self, x: Tensor) -> Tensor:
        """Normalize with the statistics of the current pass."""
        number = min(self.current_pass, STATISTICS - 1)
        suffix = f"_{number}" if number else ""
        return self.normalize(x, getattr(self, "running_mean" + suffix), getattr(self, "running_var" + suffix))

    def normalize(self, x: Tensor, mean: Tensor, variance: Tensor) -> Tensor:
        """Normalize with the running statistics; in training with those of the batch, which update the running ones.

        `x` is (batch, channels, height, width), the statistics are (channels,).
        """
        return nn.functional.batch_norm(
            x, mean, variance, self.weight, self.bias, self.training, self.momentum, self.eps
        )


class CustomConv2d(nn.Sequential):
    """Convolution without bias, batch norm, ReLU; the side of the kernel is 2 `radius` + 1."""

    def __init__(self, channels_in: int, channels_out: int, radius: int, dilation: int) -> None:
        super().__init__(
            nn.Conv2d(
                channels_in,
                channels_out,
                2 * radius + 1,
                padding=radius * dilation,
                dilation=dilation,
                bias=False,
            ),
            PassBatchNorm2d(channels_out),
            nn.ReLU(inplace=True),
        )


class StackedConv2d(nn.Sequential):
    """Two `CustomConv2d` in a row."""

    def __init__(self, channels_in: int, channels_out: int, radius: int, dilation: int) -> None:
        super().__init__(
            CustomConv2d(channels_in, channels_out, radius, dilation),
            CustomConv2d(channels_out, channels_out, radius, dilation),
        )


class ProgressiveCombine2d(nn.Module):
    """A dilated convolution, whose result is joined with its input and reduced to the same number of channels."""

    def __init__(self, channels: int, radius: int, dilation: int) -> None:
        super().__init__()
        self.dilated = CustomConv2d(channels, channels, radius, dilation)
        self.reduce = CustomConv2d(2 * channels, channels, 0, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (batch, channels, height, width) to the same shape."""
        return self.reduce(torch.cat([self.dilated(x), x], dim=1))


class FRPDFLayer(nn.Sequential):
    """One pass: two channels in (raster and state, each in -1 to 1), one channel of logits out."""

    def __init__(self, architecture: Architecture = BASE) -> None:
        super().__init__(*(_module(stage, architecture) for stage in architecture.stages))
        self.block = architecture.block

    def forward(self, x: Tensor) -> Tensor:
        """Map (batch, 2, height, width), sides multiples of the block, to logits, (batch, 1, height, width)."""
        if self.block == 1:
            return super().forward(x)
        return nn.functional.pixel_shuffle(super().forward(nn.functional.pixel_unshuffle(x, self.block)), self.block)


def _module(stage: Stage, architecture: Architecture) -> nn.Module:
    channels, radius = architecture.channels, architecture.kernel_radius
    if isinstance(stage, Stacked):
        return StackedConv2d(stage.channels_in, channels, radius, 1)
    if isinstance(stage, Combined):
        return ProgressiveCombine2d(channels, radius, stage.dilation)
    return nn.Conv2d(channels, architecture.channels_out, 1)


class Recurrent(nn.Module):
    """A network that passes over the raster several times; each pass sees the result of the pass before.

    `layer` maps two channels, raster and state, each in -1 to 1, to one channel of logits of the same height and width.
    """

    def __init__(self, layer: nn.Module) -> None:
        super().__init__()
        self.layer = layer

    def logits(self, raster: Tensor, state: Tensor, number: int) -> Tensor:
        """Run the pass of a number, from 0, which selects the batch statistics.

        `raster` is (batch, 1, height, width), 0 or 1, and 0.5 where nothing is known; `state`, of the same shape, is
        `START` in the first pass, in later ones `feedback` of the logits of the pass before.
        """
        for module in self.modules():
            if isinstance(module, PassBatchNorm2d):
                module.current_pass = number
        return self.layer(2 * torch.cat([raster, state], dim=1) - 1)

    def forward(self, raster: Tensor, passes: int = DEFAULT_PASSES) -> list[Tensor]:
        """Run `passes` passes and return the logits of each, (batch, 1, height, width)."""
        state = torch.full_like(raster, START)
        found = []
        for number in range(passes):
            found.append(self.logits(raster, state, number))
            state = feedback(found[-1]).to(raster.dtype)
        return found


class FRPDF(Recurrent):
    """The recurrent network, by default that of the paper."""

    def __init__(self, architecture: Architecture = BASE) -> None:
        super().__init__(FRPDFLayer(architecture))


def feedback(logits: Tensor) -> Tensor:
    """Return the state of the next pass, a bool tensor; no gradient flows through the threshold."""
    return torch.sigmoid(logits.detach()) >= FEEDBACK_THRESHOLD


def weights_of(network: nn.Module) -> dict[str, np.ndarray]:
    """Return parameters and batch statistics as float32 arrays, as `weights.save_arrays` takes them."""
    return {
        name: value.detach().cpu().float().contiguous().numpy()
        for name, value in network.state_dict().items()
        if "num_batches" not in name
    }


def set_weights(network: nn.Module, arrays: Mapping[str, np.ndarray]) -> None:
    """Put arrays of a weights file, see `weights_of`, into a network of the same architecture."""
    tensors = {name: torch.from_numpy(array) for name, array in arrays.items()}
    network.load_state_dict({**network.state_dict(), **tensors})
