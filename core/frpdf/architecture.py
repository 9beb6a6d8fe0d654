"""The architecture of FRPDF: the stages of one pass, in order (docs/method.md section 3.1).

Only the list `STAGES` states this order. `network` builds the modules to be trained from it and `folding` collects the
weights of each stage; the engines and the ONNX files follow the list of layers that `folding` returns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Union

CHANNELS = 24
KERNEL_RADIUS = 3
DILATIONS = (1, 3, 7, 15, 31, 63, 127)


@dataclass(frozen=True)
class Stacked:
    """Two plain convolutions in a row, from `channels_in` to `CHANNELS` channels."""

    channels_in: int

    @property
    def reach(self) -> int:
        """Distance in cells from which it takes information."""
        return 2 * KERNEL_RADIUS


@dataclass(frozen=True)
class Combined:
    """A dilated convolution whose result is joined with its input and reduced to `CHANNELS` channels again."""

    dilation: int

    @property
    def reach(self) -> int:
        """Distance in cells from which it takes information."""
        return KERNEL_RADIUS * self.dilation


@dataclass(frozen=True)
class Output:
    """A 1 x 1 convolution to one channel of logits."""

    reach = 0


Stage = Union[Stacked, Combined, Output]

STAGES: tuple[Stage, ...] = (Stacked(2), *(Combined(dilation) for dilation in DILATIONS), Stacked(CHANNELS), Output())
"""From two channels, raster and state, to the logits."""

RECEPTIVE_RADIUS = sum(stage.reach for stage in STAGES)
"""Distance in cells of the farthest cell that can influence a cell in one pass: 753."""
