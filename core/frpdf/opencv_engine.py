"""FRPDF on OpenCV's DNN module, without PyTorch."""

from __future__ import annotations

from collections.abc import Sequence
from threading import local

import cv2
import numpy as np

from ..kernels import opencv
from .architecture import FoldedLayer, block_side, fold
from .engine import Engine, Step
from .onnx import layer_to_onnx


class OpenCvEngine(Engine):
    """OpenCV on the CPU, in float32."""

    library = opencv()

    def __init__(self, arrays: dict[str, np.ndarray]) -> None:
        super().__init__()
        folded = fold(arrays)
        self.block = block_side(folded[0])
        self._passes = [[Step(layer.convolution.reach, _Net(layer).run) for layer in layers] for layers in folded]
        self.description = f"OpenCV {cv2.__version__}, CPU, float32"

    def _means_no_memory(self, error: Exception) -> bool:
        no_memory = isinstance(error, cv2.error) and getattr(error, "code", None) == cv2.Error.StsNoMem
        return no_memory or super()._means_no_memory(error)

    def _steps(self, number: int) -> Sequence[Step]:
        return self._passes[number]

    def _load(self, array: np.ndarray) -> np.ndarray:
        return array

    def _empty(self, size: int) -> np.ndarray:
        return np.empty(size, dtype=np.float32)

    def _filled(self, outside: np.ndarray, height: int, width: int) -> np.ndarray:
        around = self._memory(len(outside) * height * width).reshape(-1, height, width)
        around[:] = outside
        return around

    def _probabilities(self, logits: np.ndarray) -> np.ndarray:
        return 1 / (1 + np.exp(-logits))


class _Net(local):
    """A layer, loaded by each thread: OpenCV's networks cannot be shared between threads."""

    def __init__(self, layer: FoldedLayer) -> None:
        self._net = cv2.dnn.readNetFromONNX(np.frombuffer(layer_to_onnx(layer), np.uint8))
        self._takes_own = layer.reduction is not None

    def run(self, around: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Run the layer; see `engine.Step`."""
        self._net.setInput(around[None], "around")
        if self._takes_own:
            self._net.setInput(own[None], "own")
        return self._net.forward()[0]
