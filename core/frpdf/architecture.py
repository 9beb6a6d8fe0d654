"""The architecture of FRPDF, and its weights as plain convolutions (docs/network.md).

Only `Architecture.stages` states the order of the stages of a pass. `network` builds the modules to be trained from it,
and `fold` the list of layers that the engines and the ONNX files follow, with batch norm folded in.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Optional, Union

import numpy as np

from ..errors import ModelError
from . import STATISTICS

EPSILON = 1e-5
"""Added to the variance in batch norm."""


@dataclass(frozen=True)
class Stacked:
    """Two plain convolutions in a row, the first one from `channels_in` channels."""

    channels_in: int


@dataclass(frozen=True)
class Combined:
    """A dilated convolution whose result is joined with its input and reduced to the same number of channels."""

    dilation: int


@dataclass(frozen=True)
class Output:
    """A 1 x 1 convolution to one logit per cell."""


Stage = Union[Stacked, Combined, Output]


@dataclass(frozen=True)
class Architecture:
    """The numbers that make one FRPDF differ from another.

    The side of a kernel is twice `kernel_radius` plus one; `dilations` are those of the stages between encoder and
    decoder. `block` is the side of the square of cells that every layer computes as one; its cells are channels of the
    input and of the output. With 1, every layer has the resolution of the raster.
    """

    channels: int
    kernel_radius: int
    dilations: tuple[int, ...]
    block: int = 1

    @property
    def channels_in(self) -> int:
        """Channels of the input: raster and state of each cell of a block."""
        return 2 * self.block**2

    @property
    def channels_out(self) -> int:
        """Channels of the logits: one for each cell of a block."""
        return self.block**2

    @property
    def stages(self) -> tuple[Stage, ...]:
        """The stages from raster and state to the logits."""
        bridge = (Combined(dilation) for dilation in self.dilations)
        return (Stacked(self.channels_in), *bridge, Stacked(self.channels), Output())

    @property
    def receptive_radius(self) -> int:
        """Distance in cells of the farthest cell that can influence a cell in one pass, measured between blocks."""
        return self.block * self.kernel_radius * (4 + sum(self.dilations))


BASE = Architecture(channels=24, kernel_radius=3, dilations=(1, 3, 7, 15, 31, 63, 127))
"""The network of Gribov and Chang, section 5: receptive radius 753 cells, 292,680 products per cell."""

FAST = Architecture(channels=64, kernel_radius=1, dilations=(1, 2, 4, 8, 16, 32, 8, 4, 2), block=4)
"""The fast model: receptive radius 324 cells, 33,472 products per cell (docs/network.md)."""

ARCHITECTURES = (BASE, FAST)


@dataclass(frozen=True)
class Convolution:
    """A convolution: float32 weight (out, in, side, side) and bias (out,)."""

    weight: np.ndarray
    bias: np.ndarray
    dilation: int = 1

    @property
    def reach(self) -> int:
        """Distance in cells, or in blocks of cells, from which it takes information."""
        return self.weight.shape[-1] // 2 * self.dilation


@dataclass(frozen=True)
class FoldedLayer:
    """A layer: a convolution with ReLU, and in some layers a second, 1 x 1 convolution with ReLU.

    `reduction` is applied to the channels of the result followed by those of the layer's input. The output layer
    returns logits: it has no ReLU.
    """

    convolution: Convolution
    reduction: Optional[Convolution] = None
    is_output: bool = False


def block_side(layers: Sequence[FoldedLayer]) -> int:
    """Return the side in cells of the blocks on which the layers of a pass work; see `Architecture.block`."""
    return math.isqrt(len(layers[-1].convolution.bias))


def into_blocks(cells: np.ndarray, side: int) -> np.ndarray:
    """Rearrange (channels, height, width) into (channels x side x side, height / side, width / side)."""
    channels, height, width = cells.shape
    parts = cells.reshape(channels, height // side, side, width // side, side)
    return parts.transpose(0, 2, 4, 1, 3).reshape(-1, height // side, width // side)


def from_blocks(blocks: np.ndarray, side: int) -> np.ndarray:
    """Rearrange (side x side, height, width), the cells of each block, into (side x height, side x width)."""
    _, height, width = blocks.shape
    parts = blocks.reshape(side, side, height, width).transpose(2, 0, 3, 1)
    return parts.reshape(side * height, side * width)


def architecture_of(arrays: dict[str, np.ndarray]) -> Architecture:
    """Return the architecture whose first kernel has as many channels and taps as that of a weights file.

    Without any, returns the first architecture; `fold` then states what differs.
    """
    shape = getattr(arrays.get("layer.0.0.0.weight"), "shape", ())[1:]
    for one in ARCHITECTURES:
        if shape == (one.channels_in, *(2 * one.kernel_radius + 1,) * 2):
            return one
    return ARCHITECTURES[0]


def fold(arrays: dict[str, np.ndarray]) -> tuple[tuple[FoldedLayer, ...], ...]:
    """Fold the arrays of a weights file into the layers of the first pass, and those of all later passes.

    Raises ModelError if the arrays are not those of FRPDF.
    """
    architecture = architecture_of(arrays)
    try:
        return tuple(tuple(_fold_pass(arrays, architecture, number)) for number in range(STATISTICS))
    except (KeyError, ValueError) as error:
        raise ModelError(f"The weights file does not belong to FRPDF ({error}): reinstall the plugin.") from error


def _fold_pass(arrays: dict[str, np.ndarray], architecture: Architecture, number: int) -> list[FoldedLayer]:
    channels, radius = architecture.channels, architecture.kernel_radius
    layers = []
    for position, stage in enumerate(architecture.stages):
        name = f"layer.{position}"
        if isinstance(stage, Stacked):
            for place, channels_in in enumerate((stage.channels_in, channels)):
                layers.append(FoldedLayer(_fold(arrays, f"{name}.{place}", number, (channels, channels_in), radius)))
        elif isinstance(stage, Combined):
            dilated = _fold(arrays, f"{name}.dilated", number, (channels, channels), radius, stage.dilation)
            layers.append(FoldedLayer(dilated, _fold(arrays, f"{name}.reduce", number, (channels, 2 * channels), 0)))
        else:
            weight = _checked(arrays, f"{name}.weight", (architecture.channels_out, channels, 1, 1))
            bias = _checked(arrays, f"{name}.bias", (architecture.channels_out,))
            layers.append(FoldedLayer(Convolution(weight, bias), is_output=True))
    return layers


def _fold(
    arrays: dict[str, np.ndarray], name: str, number: int, channels: tuple[int, int], radius: int, dilation: int = 1
) -> Convolution:
    """Fold the batch norm that follows a convolution into it.

    The two have a name in the network, and the statistics a number; `channels` are those of the convolution's result
    and of its input, `radius` is the reach of the kernel.
    """
    suffix = f"_{number}" if number else ""
    side = 2 * radius + 1
    kernel = _checked(arrays, f"{name}.0.weight", (*channels, side, side))
    mean, variance, weight, bias = (
        _checked(arrays, f"{name}.1.{part}", (channels[0],))
        for part in (f"running_mean{suffix}", f"running_var{suffix}", "weight", "bias")
    )
    if (variance < 0).any():
        raise ValueError(f"{name} has a negative variance")
    scale = weight / np.sqrt(variance + EPSILON)
    return Convolution(kernel * scale[:, None, None, None], bias - mean * scale, dilation)


def _checked(arrays: dict[str, np.ndarray], name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array of finite numbers with the expected shape, or raise KeyError or ValueError."""
    array = arrays[name]
    if array.shape != shape:
        raise ValueError(f"{name} has the shape {array.shape} instead of {shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} contains a value that is not a number")
    return array
