"""FRPDF in the format ONNX, which OpenCV and other runtimes read, made from the folded weights.

The format is protobuf, of which ONNX needs four kinds of field here; writing them takes less code than a dependency.
The command `python -m rail_extract onnx` writes files for other programs. The OpenCV engine makes what it needs in
memory, so that the .npz files are the only weights.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from .architecture import Convolution, FoldedLayer, block_side, fold
from .models import MODELS
from .weights import load_arrays

IR_VERSION, OPERATOR_SET = 8, 13
"""Versions that runtimes since 2021 read."""

_VARINT, _BYTES = 0, 2
_FLOAT, _INT_ATTRIBUTE, _STRING_ATTRIBUTE, _INTS_ATTRIBUTE = 1, 2, 3, 7


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("folder", type=Path, help="folder for NAME_pass1.onnx and NAME_pass2.onnx of each model")
    parser.add_argument("--side", type=int, default=512, help="side of the rasters (default 512)")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Write the shipped models."""
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for model in MODELS:
        for number, layers in enumerate(fold(load_arrays(model.path)), start=1):
            path = arguments.folder / f"{model.name}_pass{number}.onnx"
            path.write_bytes(to_onnx(layers, arguments.side, arguments.side))
            print(path)


def to_onnx(layers: Sequence[FoldedLayer], height: int, width: int) -> bytes:
    """Return one pass, of `height` x `width` cells in whole blocks, as an ONNX ModelProto.

    It leads from `input`, (1, 2, height, width) in -1 to 1, to `logits`, (1, 1, height, width).
    """
    graph, side = _Graph(), block_side(layers)
    x = "input" if side == 1 else graph.into_blocks("input", 2, side)
    for layer in layers:
        x = graph.layer(layer, x, x, output="logits" if layer.is_output and side == 1 else None)
    if side > 1:
        graph.from_blocks(x, side, output="logits")
    return graph.proto({"input": (1, 2, height, width)}, {"logits": (1, 1, height, width)})


def layer_to_onnx(layer: FoldedLayer) -> bytes:
    """Return one layer as ONNX, from `around` and `own`, as `engine.Step.run` takes them, to `found`.

    Arrays are (1, channels, height, width). Only layers with a reduction have the input `own`. The stated shapes are
    those of a single cell; a runtime also takes larger arrays.
    """
    graph = _Graph()
    graph.layer(layer, "around", "own", output="found", padded=False)
    side = 2 * layer.convolution.reach + 1
    channels_out, channels_in = layer.convolution.weight.shape[:2]
    given: dict[str, tuple[int, ...]] = {"around": (1, channels_in, side, side)}
    if layer.reduction:
        given["own"] = (1, channels_in, 1, 1)
    return graph.proto(given, {"found": (1, channels_out, 1, 1)})


class _Graph:
    """Nodes and weights of an ONNX graph under construction; methods that add a node return the name of its result."""

    def __init__(self) -> None:
        self._nodes: list[bytes] = []
        self._weights: list[bytes] = []

    def layer(self, layer: FoldedLayer, around: str, own: str, output: str | None = None, padded: bool = True) -> str:
        """Add a layer to what `around` names; its reduction joins the result with `own`.

        A padded convolution has a result of the size of its input.
        """
        if layer.is_output:
            return self.convolve(around, layer.convolution, padded, output)
        found = self.convolve(around, layer.convolution, padded)
        if layer.reduction is None:
            return self.relu(found, output)
        joined = self.join(self.relu(found), own)
        return self.relu(self.convolve(joined, layer.reduction), output)

    def convolve(
        self, x: str, convolution: Convolution, padded: bool = True, output: str | None = None, stride: int = 1
    ) -> str:
        """Add a convolution; see `layer`."""
        number = len(self._nodes)
        names = [x, f"weight{number}", f"bias{number}"]
        self._weights += [_tensor(names[1], convolution.weight), _tensor(names[2], convolution.bias)]
        side = convolution.weight.shape[-1]
        attributes = (
            _integers("kernel_shape", (side, side)),
            _integers("dilations", (convolution.dilation,) * 2),
            _integers("strides", (stride,) * 2),
            _integers("pads", (convolution.reach if padded else 0,) * 4),
        )
        return self._node("Conv", names, attributes, output)

    def into_blocks(self, x: str, channels: int, side: int) -> str:
        """Rearrange cells as `architecture.into_blocks` does, by a convolution that picks one cell for each channel."""
        count = channels * side**2
        picks = np.eye(count, dtype=np.float32).reshape(count, channels, side, side)
        return self.convolve(x, Convolution(picks, np.zeros(count, dtype=np.float32)), padded=False, stride=side)

    def from_blocks(self, x: str, side: int, output: str) -> str:
        """Rearrange blocks as `architecture.from_blocks` does."""
        mode = _text(1, "mode") + _text(4, "CRD") + _number(20, _STRING_ATTRIBUTE)
        size = _text(1, "blocksize") + _number(3, side) + _number(20, _INT_ATTRIBUTE)
        return self._node("DepthToSpace", [x], (mode, size), output)

    def relu(self, x: str, output: str | None = None) -> str:
        return self._node("Relu", [x], output=output)

    def join(self, first: str, second: str) -> str:
        axis = _text(1, "axis") + _number(3, 1) + _number(20, _INT_ATTRIBUTE)
        return self._node("Concat", [first, second], (axis,))

    def proto(self, given: dict[str, tuple[int, ...]], results: dict[str, tuple[int, ...]]) -> bytes:
        """Return the graph as bytes, with the shapes of its inputs and results."""
        parts = [_message(1, node) for node in self._nodes] + [_text(2, "FRPDF")]
        parts += [_message(5, weight) for weight in self._weights]
        parts += [_message(11, _value(*one)) for one in given.items()]
        parts += [_message(12, _value(*one)) for one in results.items()]
        return _number(1, IR_VERSION) + _message(8, _number(2, OPERATOR_SET)) + _message(7, b"".join(parts))

    def _node(
        self, kind: str, inputs: Iterable[str], attributes: Iterable[bytes] = (), output: str | None = None
    ) -> str:
        name = output or f"x{len(self._nodes)}"
        fields = [_text(1, text) for text in inputs] + [_text(2, name), _text(3, f"{kind}{len(self._nodes)}")]
        self._nodes.append(b"".join(fields) + _text(4, kind) + b"".join(_message(5, a) for a in attributes))
        return name


def _tensor(name: str, array: np.ndarray) -> bytes:
    dims = b"".join(_number(1, side) for side in array.shape)
    return dims + _number(2, _FLOAT) + _text(8, name) + _message(9, np.ascontiguousarray(array, "<f4").tobytes())


def _integers(name: str, values: Iterable[int]) -> bytes:
    return _text(1, name) + b"".join(_number(8, value) for value in values) + _number(20, _INTS_ATTRIBUTE)


def _value(name: str, shape: Iterable[int]) -> bytes:
    dims = b"".join(_message(1, _number(1, side)) for side in shape)
    return _text(1, name) + _message(2, _message(1, _number(1, _FLOAT) + _message(2, dims)))


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3 | _VARINT) + _varint(value)


def _text(field: int, text: str) -> bytes:
    return _message(field, text.encode())


def _message(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | _BYTES) + _varint(len(content)) + content


def _varint(value: int) -> bytes:
    """Return seven bits per byte, the lowest first, with the eighth bit set in all bytes but the last."""
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)
