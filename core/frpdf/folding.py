"""The weights of FRPDF as plain convolutions: batch norm folded in, one list of layers per set of batch statistics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from ..errors import ModelError
from . import STATISTICS
from .architecture import STAGES, Combined, Stacked

EPSILON = 1e-5
"""Added to the variance in batch norm."""


@dataclass(frozen=True)
class Convolution:
    """A convolution with bias.

    Attributes
    ----------
    weight : (out, in, side, side) float32 array
    bias : (out,) float32 array
    dilation : int
    """

    weight: np.ndarray
    bias: np.ndarray
    dilation: int = 1

    @property
    def reach(self) -> int:
        """Distance in cells from which it takes information."""
        return self.weight.shape[-1] // 2 * self.dilation


@dataclass(frozen=True)
class FoldedLayer:
    """A layer: a convolution with ReLU, and in some layers a second, 1 x 1 convolution with ReLU.

    Attributes
    ----------
    convolution : Convolution
    reduction : Convolution, optional
        Applied to the channels of the result followed by those of the layer's input.
    is_output : bool
        The layer returns logits: it has no ReLU.
    """

    convolution: Convolution
    reduction: Optional[Convolution] = None
    is_output: bool = False

    @property
    def reach(self) -> int:
        """Distance in cells from which it takes information."""
        return self.convolution.reach


def fold(arrays: dict[str, np.ndarray]) -> tuple[tuple[FoldedLayer, ...], ...]:
    """Fold the arrays of a weights file into the layers of a pass, for each set of batch statistics.

    Returns
    -------
    tuple of tuple of FoldedLayer
        The layers of the first pass in order, and those of all later passes.

    Raises
    ------
    ModelError
        The arrays are not those of FRPDF.
    """
    try:
        return tuple(tuple(_fold_pass(arrays, number)) for number in range(STATISTICS))
    except (KeyError, ValueError) as error:
        raise ModelError(f"The weights file does not belong to FRPDF ({error}): reinstall the plugin.") from error


def _fold_pass(arrays: dict[str, np.ndarray], number: int) -> list[FoldedLayer]:
    layers = []
    for position, stage in enumerate(STAGES):
        name = f"layer.{position}"
        if isinstance(stage, Stacked):
            layers += [FoldedLayer(_fold(arrays, f"{name}.{place}", number)) for place in (0, 1)]
        elif isinstance(stage, Combined):
            dilated = _fold(arrays, f"{name}.dilated", number, stage.dilation)
            layers.append(FoldedLayer(dilated, _fold(arrays, f"{name}.reduce", number)))
        else:
            output = Convolution(arrays[f"{name}.weight"], arrays[f"{name}.bias"])
            layers.append(FoldedLayer(output, is_output=True))
    return layers


def _fold(arrays: dict[str, np.ndarray], name: str, number: int, dilation: int = 1) -> Convolution:
    """Fold the batch norm that follows a convolution into it."""
    suffix = f"_{number}" if number else ""
    mean, variance = arrays[f"{name}.1.running_mean{suffix}"], arrays[f"{name}.1.running_var{suffix}"]
    scale = arrays[f"{name}.1.weight"] / np.sqrt(variance + EPSILON)
    weight = arrays[f"{name}.0.weight"] * scale[:, None, None, None]
    return Convolution(weight, arrays[f"{name}.1.bias"] - mean * scale, dilation)
