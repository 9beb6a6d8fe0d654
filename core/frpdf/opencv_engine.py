"""FRPDF on OpenCV's DNN module: no PyTorch needed."""

from __future__ import annotations

import cv2
import numpy as np

from .folding import fold
from .onnx import to_onnx


class OpenCvEngine:
    """OpenCV on the processor, in float32."""

    def __init__(self, arrays: dict[str, np.ndarray]) -> None:
        self._layers = fold(arrays)
        self._nets: dict[tuple[int, int, int], cv2.dnn.Net] = {}
        self.description = f"OpenCV {cv2.__version__}, CPU, float32"

    def probabilities(self, raster: np.ndarray, state: np.ndarray, number: int) -> np.ndarray:
        """Run one pass; see `Engine.probabilities`."""
        net = self._net(min(number, len(self._layers) - 1), *raster.shape)
        net.setInput(np.stack([raster, state])[None] * 2 - 1)
        return 1 / (1 + np.exp(-net.forward()[0, 0]))

    def _net(self, number: int, height: int, width: int) -> cv2.dnn.Net:
        """Make the model of a pass for this size of window, once."""
        key = number, height, width
        if key not in self._nets:
            proto = to_onnx(self._layers[number], height, width)
            self._nets[key] = cv2.dnn.readNetFromONNX(np.frombuffer(proto, np.uint8))
        return self._nets[key]
