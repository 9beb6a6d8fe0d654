"""Dilated convolutions, batch norm and ReLU that train fast on the CPU.

PyTorch's bfloat16 kernels are fast at every dilation for the forward pass and for the gradient of the input, which is a
forward convolution with the flipped kernel. The weight gradient of a dilated kernel crashes (torch 2.13, channels last)
or takes a slow path. Split into phases, a dilated convolution is a plain one, which has a fast weight gradient.

Batch norm is vectorized along the channels, and 24 channels do not fill a vector register; for several columns at once
it is four times as fast. The gradient of ReLU takes a tenth of the time once it is vectorized.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from ...core.frpdf.network import PassBatchNorm2d

MAX_PHASED_DILATION = 40
"""Above this dilation the phases of a crop are smaller than the kernel, and one product per kernel tap is faster."""

MANY_CHANNELS = 64
"""Number of channels from which PyTorch's own convolutions and batch norm are faster."""

COLUMNS_AT_ONCE = 4
"""Columns whose channels are normalized as one row of 96 numbers; it divides the sides of all crops."""


class _DilatedConvolution(torch.autograd.Function):
    """Convolution without bias, padded to the same size; its weight gradient is computed by phases or by taps."""

    @staticmethod
    def forward(ctx, x: Tensor, weight: Tensor, dilation: int) -> Tensor:
        ctx.save_for_backward(x, weight)
        ctx.dilation = dilation
        return _convolve(x, weight, dilation)

    @staticmethod
    def backward(ctx, gradient: Tensor) -> tuple[Tensor | None, Tensor | None, None]:
        x, weight = ctx.saved_tensors
        gradient = gradient.contiguous(memory_format=torch.channels_last)
        of_x = of_weight = None
        if ctx.needs_input_grad[0]:
            of_x = _convolve(gradient, weight.transpose(0, 1).flip(2, 3), ctx.dilation)
        if ctx.needs_input_grad[1]:
            by = _weight_gradient_by_phases if ctx.dilation <= MAX_PHASED_DILATION else _weight_gradient_by_taps
            of_weight = by(x, gradient, ctx.dilation, weight)
        return of_x, of_weight, None


def _convolve(x: Tensor, weight: Tensor, dilation: int) -> Tensor:
    radius = weight.shape[-1] // 2
    weight = weight.contiguous(memory_format=torch.channels_last)
    return functional.conv2d(x, weight, padding=radius * dilation, dilation=dilation)


def _phases(x: Tensor, dilation: int) -> Tensor:
    """Rearrange (batch, channels, height, width) into images of every `dilation`-th row and column."""
    batch, channels, height, width = x.shape
    rows, columns = -(-height // dilation), -(-width // dilation)
    x = functional.pad(x, (0, columns * dilation - width, 0, rows * dilation - height))
    x = x.reshape(batch, channels, rows, dilation, columns, dilation).permute(0, 3, 5, 1, 2, 4)
    return x.reshape(-1, channels, rows, columns).contiguous(memory_format=torch.channels_last)


def _weight_gradient_by_phases(x: Tensor, gradient: Tensor, dilation: int, weight: Tensor) -> Tensor:
    radius = weight.shape[-1] // 2
    return torch.ops.aten.convolution_backward(
        _phases(gradient, dilation),
        _phases(x, dilation),
        weight.contiguous(memory_format=torch.channels_last),
        None,
        [1, 1],
        [radius, radius],
        [1, 1],
        False,
        [0, 0],
        1,
        [False, True, False],
    )[1]


def _weight_gradient_by_taps(x: Tensor, gradient: Tensor, dilation: int, weight: Tensor) -> Tensor:
    height, width = x.shape[-2:]
    radius = weight.shape[-1] // 2
    pixels, gradients = x.permute(0, 2, 3, 1), gradient.permute(0, 2, 3, 1)
    result = torch.zeros_like(weight)
    for row in range(weight.shape[-2]):
        for column in range(weight.shape[-1]):
            down, right = (row - radius) * dilation, (column - radius) * dilation
            rows = range(max(0, -down), min(height, height - down))
            columns = range(max(0, -right), min(width, width - right))
            if len(rows) == 0 or len(columns) == 0:
                continue
            inner = gradients[:, rows.start : rows.stop, columns.start : columns.stop]
            shifted = pixels[:, rows.start + down : rows.stop + down, columns.start + right : columns.stop + right]
            result[:, :, row, column] = inner.reshape(-1, inner.shape[-1]).t() @ shifted.reshape(-1, shifted.shape[-1])
    return result


class CpuConv2d(nn.Conv2d):
    """A `Conv2d` that trains in bfloat16 on the CPU at every dilation."""

    def forward(self, x: Tensor) -> Tensor:
        """Convolve in the number type of autocast."""
        dtype = torch.get_autocast_dtype("cpu") if torch.is_autocast_enabled("cpu") else x.dtype
        with torch.autocast("cpu", enabled=False):
            return _DilatedConvolution.apply(x.to(dtype), self.weight.to(dtype), self.dilation[0])


class CpuBatchNorm2d(PassBatchNorm2d):
    """Batch norm with statistics over every fourth column; the running statistics keep the mean of the four sets."""

    def normalize(self, x: Tensor, mean: Tensor, variance: Tensor) -> Tensor:
        """Normalize `COLUMNS_AT_ONCE` columns as if they were channels; see `PassBatchNorm2d.normalize`."""
        batch, channels, height, width = x.shape
        if not self.training or width % COLUMNS_AT_ONCE:
            return super().normalize(x, mean, variance)
        wide = x.permute(0, 2, 3, 1).reshape(batch, height, -1, COLUMNS_AT_ONCE * channels).permute(0, 3, 1, 2)
        means, variances = mean.repeat(COLUMNS_AT_ONCE), variance.repeat(COLUMNS_AT_ONCE)
        weight, bias = self.weight.repeat(COLUMNS_AT_ONCE), self.bias.repeat(COLUMNS_AT_ONCE)
        wide = functional.batch_norm(wide, means, variances, weight, bias, True, self.momentum, self.eps)
        mean.copy_(means.view(COLUMNS_AT_ONCE, channels).mean(0))
        variance.copy_(variances.view(COLUMNS_AT_ONCE, channels).mean(0))
        return wide.permute(0, 2, 3, 1).reshape(batch, height, width, channels).permute(0, 3, 1, 2)


class _Rectifier(torch.autograd.Function):
    """ReLU with a vectorized gradient in bfloat16, as leaky ReLU with a slope of 0 has."""

    @staticmethod
    def forward(ctx, x: Tensor) -> Tensor:
        y = functional.relu(x)
        ctx.save_for_backward(y)
        return y

    @staticmethod
    def backward(ctx, gradient: Tensor) -> Tensor:
        (y,) = ctx.saved_tensors
        gradient = gradient.contiguous(memory_format=torch.channels_last)
        return torch.ops.aten.leaky_relu_backward(gradient, y, 0.0, True)


class CpuReLU(nn.ReLU):
    """A `ReLU` that trains fast in bfloat16; it is not in place, which would copy the views of `CpuBatchNorm2d`."""

    def forward(self, x: Tensor) -> Tensor:
        """Set negative values to 0."""
        return _Rectifier.apply(x)


def train_on_cpu(network: nn.Module) -> None:
    """Put the layers of this module in place of a network's own; the parameters remain the same."""
    for module in network.modules():
        if type(module) is nn.ReLU:
            module.__class__ = CpuReLU
        if type(module) is PassBatchNorm2d and module.num_features < MANY_CHANNELS:
            module.__class__ = CpuBatchNorm2d
        if type(module) is nn.Conv2d and module.dilation[0] > 1 and module.in_channels < MANY_CHANNELS:
            module.__class__ = CpuConv2d
    move(network, "cpu")


def move(network: nn.Module, device: str) -> None:
    """Move a network to a device, in place; in memory, channels are innermost."""
    convert: Any = network.to  # the annotations of PyTorch lack memory_format
    convert(device, memory_format=torch.channels_last)
