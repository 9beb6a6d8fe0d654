"""FRPDF on PyTorch."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch

from ..errors import ModelError
from .folding import Convolution, FoldedLayer, fold


class TorchEngine:
    """PyTorch on the CPU or on CUDA; in bfloat16 where the processor computes with it."""

    def __init__(self, arrays: dict[str, np.ndarray], device: str = "AUTO", exact: bool = False) -> None:
        """Move the weights to the device; `exact` computes in float32 everywhere."""
        has_cuda = torch.cuda.is_available()
        if device == "CUDA" and not has_cuda:
            raise ModelError("There is no CUDA device that PyTorch can use: choose AUTO or CPU.")
        self._device = "cuda" if has_cuda and device != "CPU" else "cpu"
        self._dtype = torch.float32 if exact else _fast_type(self._device)
        self._passes = [self._move(layer) for layer in fold(arrays)]
        self.description = f"PyTorch {torch.__version__}, {self._device.upper()}, {str(self._dtype).split('.')[-1]}"

    def probabilities(self, raster: np.ndarray, state: np.ndarray, number: int) -> np.ndarray:
        """Run one pass; see `Engine.probabilities`."""
        x = torch.from_numpy(np.stack([raster, state])[None] * 2 - 1)
        x = x.to(self._device, self._dtype).contiguous(memory_format=torch.channels_last)
        with torch.inference_mode():
            logits = self._passes[min(number, len(self._passes) - 1)](x)
            return torch.sigmoid(logits.float())[0, 0].cpu().numpy()

    def _move(self, layer: FoldedLayer) -> Callable:
        """Make a function of (1, 2, height, width) tensors from a folded layer."""
        convolve = torch.nn.functional.conv2d

        def moved(convolution: Convolution) -> Callable:
            weight = torch.from_numpy(convolution.weight).to(self._device, self._dtype)
            weight = weight.contiguous(memory_format=torch.channels_last)
            bias = torch.from_numpy(convolution.bias).to(self._device, self._dtype)
            dilation = convolution.dilation
            padding = convolution.weight.shape[-1] // 2 * dilation
            return lambda x: convolve(x, weight, bias, padding=padding, dilation=dilation)

        encoder = [moved(convolution) for convolution in layer.encoder]
        bridge = [(moved(dilated), moved(reduce)) for dilated, reduce in layer.bridge]
        decoder = [moved(convolution) for convolution in layer.decoder]
        head = moved(layer.head)

        def run(x):
            for convolution in encoder:
                x = convolution(x).relu_()
            for dilated, reduce in bridge:
                x = reduce(torch.cat([dilated(x).relu_(), x], dim=1)).relu_()
            for convolution in decoder:
                x = convolution(x).relu_()
            return head(x)

        return run


def _fast_type(device: str) -> torch.dtype:
    """Bfloat16 where it is native: elsewhere it is emulated, and slower than float32."""
    if device == "cuda":
        return torch.bfloat16 if torch.cuda.is_bf16_supported(including_emulation=False) else torch.float32
    probes = ("_is_avx512_bf16_supported", "_is_amx_tile_supported")
    native = any(getattr(torch.cpu, probe, lambda: False)() for probe in probes)
    return torch.bfloat16 if native else torch.float32
