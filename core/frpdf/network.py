"""The FRPDF network, line for line as in the figures of Gribov and Chang, section 5: 293,545 parameters.

Class names are the paper's. Every layer keeps the full resolution; context comes from dilation alone.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from . import CHANNELS, DEFAULT_PASSES, DILATIONS, FEEDBACK_THRESHOLD, KERNEL_RADIUS, START, STATISTICS

RECEPTIVE_RADIUS = 753
"""Farthest cell that can influence a cell in one pass: 3 for each of 4 plain convolutions, 3 d for each dilated one."""


class PassBatchNorm2d(nn.BatchNorm2d):
    """Batch norm whose running statistics are kept per pass, with the affine part shared by all passes.

    The state channel is constant in the first pass and binary afterwards, so activations differ between passes; one
    set of running statistics fits neither (docs/method.md section 3.2).
    """

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
        """Normalize with the running statistics, or in training with the batch's, which then update them."""
        return nn.functional.batch_norm(
            x, mean, variance, self.weight, self.bias, self.training, self.momentum, self.eps
        )


class CustomConv2d(nn.Sequential):
    """Convolution without bias, batch norm, ReLU; kernel side 2 `radius` + 1."""

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
    """Two `CustomConv2d` one after the other."""

    def __init__(self, channels_in: int, channels_out: int, radius: int, dilation: int) -> None:
        super().__init__(
            CustomConv2d(channels_in, channels_out, radius, dilation),
            CustomConv2d(channels_out, channels_out, radius, dilation),
        )


class ProgressiveCombine2d(nn.Module):
    """A dilated convolution joined with its own input and reduced back to the same number of channels."""

    def __init__(self, channels: int, radius: int, dilation: int) -> None:
        super().__init__()
        self.dilated = CustomConv2d(channels, channels, radius, dilation)
        self.reduce = CustomConv2d(2 * channels, channels, 0, 1)

    def forward(self, x: Tensor) -> Tensor:
        """Map (batch, channels, height, width) to the same shape."""
        return self.reduce(torch.cat([self.dilated(x), x], dim=1))


class FRPDFLayer(nn.Sequential):
    """One pass: two channels in (raster and state, each in -1 to 1), one channel of logits out."""

    def __init__(self) -> None:
        super().__init__(
            StackedConv2d(2, CHANNELS, KERNEL_RADIUS, 1),
            *(ProgressiveCombine2d(CHANNELS, KERNEL_RADIUS, dilation) for dilation in DILATIONS),
            StackedConv2d(CHANNELS, CHANNELS, KERNEL_RADIUS, 1),
            nn.Conv2d(CHANNELS, 1, 1),
        )


class Recurrent(nn.Module):
    """The same layer passes over the raster again and again, fed with what it found before.

    Parameters
    ----------
    layer : nn.Module
        From two channels, raster and state, each in -1 to 1, to one channel of logits of the same height and width.
    """

    def __init__(self, layer: nn.Module) -> None:
        super().__init__()
        self.layer = layer

    def logits(self, raster: Tensor, state: Tensor, number: int) -> Tensor:
        """Run one pass.

        Parameters
        ----------
        raster : (batch, 1, height, width) tensor
            0 or 1; 0.5 where nothing is known.
        state : tensor of the same shape
            `START` in the first pass, then what `feedback` made of the pass before.
        number : int
            Number of the pass, from 0: it chooses the batch statistics.

        Returns
        -------
        Tensor of the same shape
        """
        for module in self.modules():
            if isinstance(module, PassBatchNorm2d):
                module.current_pass = number
        return self.layer(2 * torch.cat([raster, state], dim=1) - 1)

    def forward(self, raster: Tensor, passes: int = DEFAULT_PASSES) -> list[Tensor]:
        """Run `passes` passes and give the logits of each, (batch, 1, height, width)."""
        state = torch.full_like(raster, START)
        found = []
        for number in range(passes):
            found.append(self.logits(raster, state, number))
            state = feedback(found[-1]).to(raster.dtype)
        return found


class FRPDF(Recurrent):
    """The paper's recurrent network."""

    def __init__(self) -> None:
        super().__init__(FRPDFLayer())


def feedback(logits: Tensor) -> Tensor:
    """Decide what the next pass is told; no gradient flows through the threshold."""
    return torch.sigmoid(logits.detach()) >= FEEDBACK_THRESHOLD
