"""FRPDF as plain convolutions: batch norm folded into the weights, one set for each kind of pass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import ModelError
from . import DILATIONS, STATISTICS

EPSILON = 1e-5
"""Added to the variance in batch norm."""


@dataclass(frozen=True)
class Convolution:
    """A convolution.

    Attributes
    ----------
    weight : (out, in, side, side) float32 array
    bias : (out,) float32 array
    dilation : int
    """

    weight: np.ndarray
    bias: np.ndarray
    dilation: int

    @property
    def reach(self) -> int:
        """How far, in cells, it looks around a cell."""
        return self.weight.shape[-1] // 2 * self.dilation


@dataclass(frozen=True)
class FoldedLayer:
    """One pass of the network: ReLU after every convolution but the head.

    Attributes
    ----------
    encoder, decoder : tuple of two Convolution
    bridge : tuple of seven pairs of Convolution
        The dilated convolution, and the one that reduces its result joined with its input.
    head : Convolution
        Gives the logits.
    """

    encoder: tuple[Convolution, ...]
    bridge: tuple[tuple[Convolution, Convolution], ...]
    decoder: tuple[Convolution, ...]
    head: Convolution


def fold(arrays: dict[str, np.ndarray]) -> tuple[FoldedLayer, ...]:
    """Fold the weights of `core.frpdf.weights` into one layer for each set of batch statistics.

    Raises
    ------
    ModelError
        The arrays are not those of FRPDF.
    """
    try:
        return tuple(_fold_pass(arrays, number) for number in range(STATISTICS))
    except (KeyError, ValueError) as error:
        raise ModelError(f"These are no weights of FRPDF ({error}): install the plugin again.") from error


def _fold_pass(arrays: dict[str, np.ndarray], number: int) -> FoldedLayer:
    last = len(DILATIONS) + 1
    bridge = tuple(
        (
            _fold_block(arrays, f"layer.{position}.dilated", number, dilation),
            _fold_block(arrays, f"layer.{position}.reduce", number, 1),
        )
        for position, dilation in enumerate(DILATIONS, start=1)
    )
    return FoldedLayer(
        encoder=tuple(_fold_block(arrays, f"layer.0.{block}", number, 1) for block in (0, 1)),
        bridge=bridge,
        decoder=tuple(_fold_block(arrays, f"layer.{last}.{block}", number, 1) for block in (0, 1)),
        head=Convolution(arrays[f"layer.{last + 1}.weight"], arrays[f"layer.{last + 1}.bias"], 1),
    )


def _fold_block(arrays: dict[str, np.ndarray], name: str, number: int, dilation: int) -> Convolution:
    suffix = f"_{number}" if number else ""
    mean, variance = arrays[f"{name}.1.running_mean{suffix}"], arrays[f"{name}.1.running_var{suffix}"]
    scale = arrays[f"{name}.1.weight"] / np.sqrt(variance + EPSILON)
    weight = arrays[f"{name}.0.weight"] * scale[:, None, None, None]
    return Convolution(weight, arrays[f"{name}.1.bias"] - mean * scale, dilation)
