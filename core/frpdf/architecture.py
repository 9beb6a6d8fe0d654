"""The architecture of FRPDF: the stages of one pass, in order (docs/network.md).

Only `Architecture.stages` states this order. `network` builds the modules to be trained from it and `folding` collects
the weights of each stage; the engines and the ONNX files follow the list of layers that `folding` returns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Union


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

    Attributes
    ----------
    channels : int
    kernel_radius : int
        The side of a kernel is twice that plus one.
    dilations : tuple of int
        Of the stages between encoder and decoder.
    block : int
        Side of the square of cells that every layer computes as one; its cells are channels of the input and of the
        output. With 1, every layer has the resolution of the raster.
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
