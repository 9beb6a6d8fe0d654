"""FRPDF on OpenCV's DNN module, without PyTorch."""

from __future__ import annotations

from collections.abc import Sequence
from threading import local

import cv2
import numpy as np

from ..kernels import opencv
from .folding import FoldedLayer, block_side, fold
from .layered import LayeredEngine, Step
from .onnx import layer_to_onnx


class OpenCvEngine(LayeredEngine):
    """OpenCV on the CPU, in float32."""

    library = opencv()

    def __init__(self, arrays: dict[str, np.ndarray]) -> None:
        folded = fold(arrays)
        self.block = block_side(folded[0])
        self._passes = [[Step(layer.reach, _Net(layer).run) for layer in layers] for layers in folded]
        self._scratch = _Scratch()
        self.description = f"OpenCV {cv2.__version__}, CPU, float32"

    def retreat(self) -> str:
        """Compute fewer cells at once; see `Engine.retreat`."""
        self._scratch = _Scratch()
        return super().retreat()

    def _means_no_memory(self, error: Exception) -> bool:
        no_memory = isinstance(error, cv2.error) and getattr(error, "code", None) == cv2.Error.StsNoMem
        return no_memory or super()._means_no_memory(error)

    def _steps(self, number: int) -> Sequence[Step]:
        return self._passes[number]

    def _load(self, array: np.ndarray) -> np.ndarray:
        return array

    def _filled(self, outside: np.ndarray, height: int, width: int) -> np.ndarray:
        # New memory costs more than writing into it: the system clears every page first.
        size = len(outside) * height * width
        if size > len(self._scratch.array):
            self._scratch.array = np.empty(size, dtype=np.float32)
        around = self._scratch.array[:size].reshape(-1, height, width)
        around[:] = outside
        return around

    def _probabilities(self, logits: np.ndarray) -> np.ndarray:
        return 1 / (1 + np.exp(-logits))


class _Scratch(local):
    """Memory of each thread."""

    def __init__(self) -> None:
        self.array = np.empty(0, dtype=np.float32)


class _Net(local):
    """A layer, loaded by each thread: OpenCV's networks cannot be shared between threads."""

    def __init__(self, layer: FoldedLayer) -> None:
        self._net = cv2.dnn.readNetFromONNX(np.frombuffer(layer_to_onnx(layer), np.uint8))
        self._takes_own = layer.reduction is not None

    def run(self, around: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Run the layer; see `layered.Step`."""
        self._net.setInput(around[None], "around")
        if self._takes_own:
            self._net.setInput(own[None], "own")
        return self._net.forward()[0]
