"""FRPDF on PyTorch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import conv2d

from ..kernels import device_of, pytorch
from .architecture import Convolution, FoldedLayer, block_side, fold
from .engine import Engine, Step

NO_MEMORY = ("DefaultCPUAllocator", "bad_alloc", "could not create a primitive", "could not create a memory object")
"""Words of the `RuntimeError`s that PyTorch and oneDNN raise if the computer has too little memory."""
FIRST_FAST_HALF, FIRST_BFLOAT16 = (7, 0), (8, 0)
"""CUDA compute capabilities from which every card is faster in float16 than in float32, and supports bfloat16."""


class TorchEngine(Engine):
    """PyTorch on the CPU or on CUDA, in bfloat16 or float16 where the device supports it natively."""

    library = pytorch()

    def __init__(self, arrays: dict[str, np.ndarray], device: str = "AUTO", exact: bool = False) -> None:
        """Move the weights to the device, AUTO, CPU or CUDA; an `exact` engine computes in float32 on every device."""
        super().__init__()
        chosen = device_of(device)
        self._folded = fold(arrays)
        self.block = block_side(self._folded[0])
        self._exact = exact
        self._others = ["cpu"] if chosen == "cuda" else []
        try:
            self._move(chosen)
        except RuntimeError:  # other programs have filled the graphics card, and not even the weights fit
            self._move(self._others.pop() if self._others else "cpu")

    def _move(self, device: str) -> None:
        self._device = device
        self._dtype = torch.float32 if self._exact else _fast_type(device)
        self.description = f"PyTorch {torch.__version__}, {device.upper()}, {str(self._dtype).split('.')[-1]}"
        self._passes = [[_step(layer, device, self._dtype) for layer in layers] for layers in self._folded]

    def retreat(self) -> str:
        """Compute fewer cells at once, and at last change to the CPU; see `Engine.retreat`."""
        try:
            return super().retreat()
        except MemoryError:
            if not self._others:
                raise
            sentence = f"{self._place} has too little free memory: continuing on the CPU."
            self.max_cells = Engine.max_cells
            self._move(self._others.pop())
            return sentence
        finally:
            torch.cuda.empty_cache()

    @property
    def _place(self) -> str:
        return "The graphics card" if self._device == "cuda" else super()._place

    def _means_no_memory(self, error: Exception) -> bool:
        words = isinstance(error, RuntimeError) and any(word in str(error) for word in NO_MEMORY)
        return words or isinstance(error, torch.cuda.OutOfMemoryError) or super()._means_no_memory(error)

    def _thread_count(self) -> int:
        return 1 if self._device == "cuda" else super()._thread_count()

    def _steps(self, number: int) -> Sequence[Step]:
        return self._passes[number]

    def _load(self, array: np.ndarray) -> Tensor:
        return _channels_last(torch.from_numpy(array).to(self._device, self._dtype))

    def _empty(self, size: int) -> Tensor:
        return torch.empty(size, dtype=self._dtype, device=self._device)

    def _filled(self, outside: Tensor, height: int, width: int) -> Tensor:
        around = self._memory(len(outside) * height * width).view(height, width, len(outside)).permute(2, 0, 1)
        return around.copy_(outside.expand_as(around))

    def _probabilities(self, logits: Tensor) -> np.ndarray:
        return torch.sigmoid(logits.float()).cpu().numpy()


def _step(layer: FoldedLayer, device: str, dtype: torch.dtype) -> Step:
    """Move a layer to the device; in memory, the channels of the tensors that it takes and returns are innermost."""
    convolution = _Convolution(layer.convolution, device, dtype)
    reduction = _Convolution(layer.reduction, device, dtype) if layer.reduction else None

    def run(around: Tensor, own: Tensor) -> Tensor:
        found = convolution(around)
        if layer.is_output:
            return found
        found.relu_()
        return _joined(found, own, reduction) if reduction else found

    return Step(layer.convolution.reach, run)


class _Convolution:
    """A convolution with its weights on the device."""

    def __init__(self, convolution: Convolution, device: str, dtype: torch.dtype) -> None:
        weight = torch.from_numpy(convolution.weight).to(device, dtype)
        self.weight = weight.contiguous(memory_format=torch.channels_last)
        self.bias = torch.from_numpy(convolution.bias).to(device, dtype)
        self.dilation = convolution.dilation

    def __call__(self, x: Tensor) -> Tensor:
        return conv2d(x[None], self.weight, self.bias, dilation=self.dilation)[0]


def _joined(found: Tensor, own: Tensor, reduction: _Convolution) -> Tensor:
    """Apply a reduction to two arrays of channels as two matrix products, without copying them into one array."""
    channels, height, width = own.shape
    weight = reduction.weight[:, :, 0, 0].T
    result = torch.addmm(reduction.bias, _rows(found), weight[:channels])
    return result.addmm_(_rows(own), weight[channels:]).relu_().view(height, width, -1).permute(2, 0, 1)


def _rows(x: Tensor) -> Tensor:
    """View (channels, height, width) as a matrix with one row per cell."""
    return x.permute(1, 2, 0).reshape(-1, len(x))


def _channels_last(x: Tensor) -> Tensor:
    """Arrange the memory so that the channels of a cell are next to each other."""
    return x.permute(1, 2, 0).contiguous().permute(2, 0, 1)


def _fast_type(device: str) -> torch.dtype:
    """Return the fastest number type: bfloat16 only where it is native, because emulated it is slower than float32."""
    if device == "cuda":
        capability = torch.cuda.get_device_capability()
        if capability >= FIRST_BFLOAT16:
            return torch.bfloat16
        return torch.float16 if capability >= FIRST_FAST_HALF else torch.float32
    probes = ("_is_avx512_bf16_supported", "_is_amx_tile_supported")
    native = any(getattr(torch.cpu, probe, lambda: False)() for probe in probes)
    return torch.bfloat16 if native else torch.float32
