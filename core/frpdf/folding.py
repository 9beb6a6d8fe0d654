"""The weights of FRPDF as plain convolutions: batch norm folded in, one list of layers per set of batch statistics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from ..errors import ModelError
from . import STATISTICS
from .architecture import CHANNELS, KERNEL_RADIUS, STAGES, Combined, Stacked

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
            for place, channels_in in enumerate((stage.channels_in, CHANNELS)):
                layers.append(FoldedLayer(_fold(arrays, f"{name}.{place}", number, channels_in)))
        elif isinstance(stage, Combined):
            dilated = _fold(arrays, f"{name}.dilated", number, CHANNELS, stage.dilation)
            layers.append(FoldedLayer(dilated, _fold(arrays, f"{name}.reduce", number, 2 * CHANNELS, radius=0)))
        else:
            weight = _checked(arrays, f"{name}.weight", (1, CHANNELS, 1, 1))
            layers.append(FoldedLayer(Convolution(weight, _checked(arrays, f"{name}.bias", (1,))), is_output=True))
    return layers


def _fold(
    arrays: dict[str, np.ndarray],
    name: str,
    number: int,
    channels_in: int,
    dilation: int = 1,
    radius: int = KERNEL_RADIUS,
) -> Convolution:
    """Fold the batch norm that follows a convolution into it.

    Parameters
    ----------
    arrays : dict of str to array
    name : str
        Name of the two in the network.
    number : int
        Number of the batch statistics.
    channels_in, dilation, radius : int
        Channels of the convolution's input, distance between the cells of its kernel, and reach of the kernel.
    """
    suffix = f"_{number}" if number else ""
    side = 2 * radius + 1
    kernel = _checked(arrays, f"{name}.0.weight", (CHANNELS, channels_in, side, side))
    mean, variance, weight, bias = (
        _checked(arrays, f"{name}.1.{part}", (CHANNELS,))
        for part in (f"running_mean{suffix}", f"running_var{suffix}", "weight", "bias")
    )
    if (variance < 0).any():
        raise ValueError(f"{name} has a negative variance")
    scale = weight / np.sqrt(variance + EPSILON)
    return Convolution(kernel * scale[:, None, None, None], bias - mean * scale, dilation)


def _checked(arrays: dict[str, np.ndarray], name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array of finite numbers with the expected shape.

    Raises
    ------
    KeyError, ValueError
        It is missing, or different.
    """
    array = arrays[name]
    if array.shape != shape:
        raise ValueError(f"{name} has the shape {array.shape} instead of {shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} contains a value that is not a number")
    return array
