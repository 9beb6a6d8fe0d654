"""FRPDF on OpenCV's DNN module: no PyTorch needed."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from .folding import FoldedLayer, fold
from .layered import LayeredEngine, Step
from .onnx import steps_to_onnx, to_onnx


class OpenCvEngine(LayeredEngine):
    """OpenCV on the processor, in float32."""

    def __init__(self, arrays: dict[str, np.ndarray]) -> None:
        self._layers = fold(arrays)
        self._passes = [_steps_of(layer) for layer in self._layers]
        self._nets: dict[tuple[int, int, int], cv2.dnn.Net] = {}
        self._scratch = np.empty(0, dtype=np.float32)
        self.description = f"OpenCV {cv2.__version__}, CPU, float32"

    def probabilities(self, raster: np.ndarray, state: np.ndarray, number: int) -> np.ndarray:
        """Run one pass; see `Engine.probabilities`."""
        net = self._net(min(number, len(self._layers) - 1), *raster.shape)
        net.setInput(np.stack([raster, state])[None] * 2 - 1)
        return self._probabilities(net.forward()[0])

    def _net(self, number: int, height: int, width: int) -> cv2.dnn.Net:
        """Make the model of a pass for this size of raster, once."""
        key = number, height, width
        if key not in self._nets:
            self._nets[key] = _read(to_onnx(self._layers[number], height, width))
        return self._nets[key]

    def _steps(self, number: int) -> Sequence[Step]:
        return self._passes[number]

    def _load(self, array: np.ndarray) -> np.ndarray:
        return array

    def _surroundings(self, outside: np.ndarray, height: int, width: int) -> np.ndarray:
        # Fresh memory costs more than writing into it: the system clears every page of it first.
        size = len(outside) * height * width
        if size > len(self._scratch):
            self._scratch = np.empty(size, dtype=np.float32)
        around = self._scratch[:size].reshape(-1, height, width)
        around[:] = outside
        return around

    def _probabilities(self, logits: np.ndarray) -> np.ndarray:
        return 1 / (1 + np.exp(-logits[0]))


def _steps_of(layer: FoldedLayer) -> list[Step]:
    convolutions = [*layer.encoder, *(dilated for dilated, _ in layer.bridge), *layer.decoder]
    joined = range(len(layer.encoder), len(layer.encoder) + len(layer.bridge))
    models = enumerate(zip(convolutions, steps_to_onnx(layer)))
    return [Step(one.reach, _runner(_read(proto), index in joined)) for index, (one, proto) in models]


def _runner(net: cv2.dnn.Net, joined: bool):
    def run(around: np.ndarray, own: np.ndarray) -> np.ndarray:
        net.setInput(around[None], "around")
        if joined:
            net.setInput(own[None], "own")
        return net.forward()[0]

    return run


def _read(proto: bytes) -> cv2.dnn.Net:
    return cv2.dnn.readNetFromONNX(np.frombuffer(proto, np.uint8))
