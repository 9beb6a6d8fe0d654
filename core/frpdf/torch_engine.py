"""FRPDF on PyTorch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import conv2d

from ..errors import DeviceExhaustedError, ModelError
from ..progress import Progress
from .corridor import Piece
from .folding import Convolution, FoldedLayer, fold
from .layered import LayeredEngine, Step

FEWEST_CELLS = 1 << 18
"""A device without room for so few cells is given up."""
FIRST_FAST_HALF, FIRST_BFLOAT16 = (7, 0), (8, 0)
"""Compute capabilities from which every card is faster in float16 than in float32, and knows bfloat16."""


class TorchEngine(LayeredEngine):
    """PyTorch on the CPU or on CUDA; in bfloat16 or float16 where the device computes with it."""

    def __init__(self, arrays: dict[str, np.ndarray], device: str = "AUTO", exact: bool = False) -> None:
        """Move the weights to the device; `exact` computes in float32 everywhere."""
        has_cuda = torch.cuda.is_available()
        if device == "CUDA" and not has_cuda:
            raise ModelError("There is no CUDA device that PyTorch can use: choose AUTO or CPU.")
        self._folded = fold(arrays)
        self._exact = exact
        try:
            self._move("cuda" if has_cuda and device != "CPU" else "cpu")
        except RuntimeError:  # others have filled the graphics card, so that not even the weights go there
            self._move("cpu")

    def _move(self, device: str) -> None:
        self._device = device
        self._dtype = torch.float32 if self._exact else _fast_type(device)
        self._passes = [_Pass(layer, device, self._dtype) for layer in self._folded]
        self._scratch = torch.empty(0, dtype=self._dtype, device=device)

    @property
    def description(self) -> str:
        """Library, device and number type."""
        return f"PyTorch {torch.__version__}, {self._device.upper()}, {str(self._dtype).split('.')[-1]}"

    def probabilities(self, raster: np.ndarray, state: np.ndarray, number: int) -> np.ndarray:
        """Run one pass; see `Engine.probabilities`."""
        x = self._load(np.stack([raster, state]) * 2 - 1)
        with torch.inference_mode():
            return self._probabilities(self._passes[min(number, len(self._passes) - 1)].whole(x))

    def sweep(
        self,
        seen: Sequence[np.ndarray],
        known: Sequence[np.ndarray],
        number: int,
        pieces: Sequence[Piece],
        progress: Progress,
    ) -> list[np.ndarray]:
        """Run one pass over pieces; see `Engine.sweep`."""
        try:
            with torch.inference_mode():
                return super().sweep(seen, known, number, pieces, progress)
        except torch.cuda.OutOfMemoryError as error:
            raise DeviceExhaustedError from error

    def retreat(self) -> str:
        """Ask less of the device, then leave it; see `Engine.retreat`."""
        self._scratch = self._scratch[:0].clone()
        if self._device == "cuda":
            torch.cuda.empty_cache()
        if self.most_cells // 4 >= FEWEST_CELLS:
            self.most_cells //= 4
            return "The graphics card has too little free memory: going on with smaller parts."
        self.most_cells = LayeredEngine.most_cells
        self._move("cpu")
        return "The graphics card has too little free memory: going on on the processor."

    def _steps(self, number: int) -> Sequence[Step]:
        return self._passes[number].steps()

    def _load(self, array: np.ndarray) -> Tensor:
        return _pixels_first(torch.from_numpy(array).to(self._device, self._dtype))

    def _surroundings(self, outside: Tensor, height: int, width: int) -> Tensor:
        # Fresh memory costs more than writing into it: the system clears every page of it first.
        size = len(outside) * height * width
        if size > len(self._scratch):
            self._scratch = torch.empty(size, dtype=self._dtype, device=self._device)
        around = self._scratch[:size].view(height, width, len(outside)).permute(2, 0, 1)
        return around.copy_(outside.expand_as(around))

    def _probabilities(self, logits: Tensor) -> np.ndarray:
        return torch.sigmoid(logits.float())[0].cpu().numpy()


class _Pass:
    """The network with one set of batch statistics, on (channels, height, width) tensors with pixels outermost."""

    def __init__(self, layer: FoldedLayer, device: str, dtype: torch.dtype) -> None:
        def moved(convolution: Convolution) -> _Convolution:
            return _Convolution(convolution, device, dtype)

        self._encoder = [moved(convolution) for convolution in layer.encoder]
        self._bridge = [(moved(dilated), moved(reduce)) for dilated, reduce in layer.bridge]
        self._decoder = [moved(convolution) for convolution in layer.decoder]
        self._head = moved(layer.head)

    def steps(self) -> list[Step]:
        """Give the layers as they run on pieces."""

        def plain(convolution: _Convolution) -> Step:
            return Step(convolution.reach, lambda around, own: convolution(around).relu_())

        def bridge(dilated: _Convolution, reduce: _Convolution) -> Step:
            return Step(dilated.reach, lambda around, own: _joined(dilated(around), own, reduce))

        first, last = self._decoder
        end = Step(last.reach, lambda around, own: self._head(last(around).relu_()))
        return [*map(plain, self._encoder), *(bridge(*pair) for pair in self._bridge), plain(first), end]

    def whole(self, x: Tensor) -> Tensor:
        """Run on a whole raster, with nothing known around it."""
        for convolution in self._encoder:
            x = convolution(x, same=True).relu_()
        for dilated, reduce in self._bridge:
            x = _joined(dilated(x, same=True), x, reduce)
        for convolution in self._decoder:
            x = convolution(x, same=True).relu_()
        return self._head(x)


class _Convolution:
    """A convolution whose weights lie on the device."""

    def __init__(self, convolution: Convolution, device: str, dtype: torch.dtype) -> None:
        weight = torch.from_numpy(convolution.weight).to(device, dtype)
        self.weight = weight.contiguous(memory_format=torch.channels_last)
        self.bias = torch.from_numpy(convolution.bias).to(device, dtype)
        self.dilation = convolution.dilation
        self.reach = convolution.reach

    def __call__(self, x: Tensor, same: bool = False) -> Tensor:
        padding = self.reach if same else 0
        return conv2d(x[None], self.weight, self.bias, padding=padding, dilation=self.dilation)[0]


def _joined(found: Tensor, own: Tensor, reduce: _Convolution) -> Tensor:
    """Reduce two stacks of channels to one, as two matrix products: the stacks are not copied into one."""
    channels, height, width = own.shape
    weight = reduce.weight[:, :, 0, 0].T
    result = torch.addmm(reduce.bias, _rows(found.relu_()), weight[:channels])
    return result.addmm_(_rows(own), weight[channels:]).relu_().view(height, width, -1).permute(2, 0, 1)


def _rows(x: Tensor) -> Tensor:
    """View (channels, height, width) as a matrix with a row for each pixel."""
    return x.permute(1, 2, 0).reshape(-1, len(x))


def _pixels_first(x: Tensor) -> Tensor:
    """Lay the channels of a pixel side by side in memory."""
    return x.permute(1, 2, 0).contiguous().permute(2, 0, 1)


def _fast_type(device: str) -> torch.dtype:
    """Bfloat16 where it is native: elsewhere it is emulated, and slower than float32."""
    if device == "cuda":
        capability = torch.cuda.get_device_capability()
        if capability >= FIRST_BFLOAT16:
            return torch.bfloat16
        return torch.float16 if capability >= FIRST_FAST_HALF else torch.float32
    probes = ("_is_avx512_bf16_supported", "_is_amx_tile_supported")
    native = any(getattr(torch.cpu, probe, lambda: False)() for probe in probes)
    return torch.bfloat16 if native else torch.float32
