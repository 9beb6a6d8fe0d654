"""FRPDF as an ONNX model, made from the folded weights: what OpenCV reads, and any other runtime can.

The format is protobuf, of which a model needs four kinds of field; writing them takes less than a dependency would.
The command `python -m rail_extract onnx` writes files for use elsewhere; the plugin makes the models it needs in
memory, so that the .npz files are the only weights there are.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from .folding import Convolution, FoldedLayer, fold
from .models import MODELS
from .weights import load_arrays

IR_VERSION, OPERATOR_SET = 8, 13
"""Versions every runtime since 2021 reads."""

_VARINT, _BYTES = 0, 2
_FLOAT, _INT_ATTRIBUTE, _INTS_ATTRIBUTE = 1, 2, 7


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument("folder", type=Path, help="where to write NAME_pass1.onnx and NAME_pass2.onnx for each model")
    parser.add_argument("--side", type=int, default=512, help="side of the rasters (default 512)")


def run(arguments: argparse.Namespace) -> None:
    """Write the shipped models."""
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for model in MODELS:
        for number, layer in enumerate(fold(load_arrays(model.path)), start=1):
            path = arguments.folder / f"{model.name}_pass{number}.onnx"
            path.write_bytes(to_onnx(layer, arguments.side, arguments.side))
            print(path)


def to_onnx(layer: FoldedLayer, height: int, width: int) -> bytes:
    """Write one pass as a model of `input`, (1, 2, height, width) in -1 to 1, to `logits`, (1, 1, height, width).

    Parameters
    ----------
    layer : FoldedLayer
    height, width : int
        Size of the rasters.

    Returns
    -------
    bytes
        An ONNX ModelProto.
    """
    graph = _Graph()
    x = "input"
    for convolution in layer.encoder:
        x = graph.relu(graph.convolve(x, convolution))
    for dilated, reduce in layer.bridge:
        joined = graph.join(graph.relu(graph.convolve(x, dilated)), x)
        x = graph.relu(graph.convolve(joined, reduce))
    for convolution in layer.decoder:
        x = graph.relu(graph.convolve(x, convolution))
    graph.convolve(x, layer.head, output="logits")
    return graph.model({"input": (1, 2, height, width)}, {"logits": (1, 1, height, width)})


def steps_to_onnx(layer: FoldedLayer) -> list[bytes]:
    """Write each layer of one pass as a model of its own.

    Of (1, channels, height, width) arrays, a model takes `around`, which is larger than its result `found` by as much
    as it looks around a cell; those of the bridge take `own` as well, what stands in the middle of it.
    """
    steps = [_plain_step(convolution) for convolution in layer.encoder]
    steps += [_bridge_step(dilated, reduce) for dilated, reduce in layer.bridge]
    first, last = layer.decoder
    return [*steps, _plain_step(first), _plain_step(last, layer.head)]


def _plain_step(convolution: Convolution, head: Convolution | None = None) -> bytes:
    graph = _Graph()
    result = graph.convolve("around", convolution, same=False)
    if head is None:
        graph.relu(result, output="found")
    else:
        graph.convolve(graph.relu(result), head, output="found")
    return graph.model(_shapes(convolution, "around"), _shapes(head or convolution, "found"))


def _bridge_step(dilated: Convolution, reduce: Convolution) -> bytes:
    graph = _Graph()
    found = graph.relu(graph.convolve("around", dilated, same=False))
    graph.relu(graph.convolve(graph.join(found, "own"), reduce), output="found")
    return graph.model({**_shapes(dilated, "around"), **_shapes(dilated, "own")}, _shapes(reduce, "found"))


def _shapes(convolution: Convolution, name: str) -> dict[str, tuple[int, ...]]:
    """Shape at which one cell is computed; a runtime takes larger ones."""
    channels_out, channels_in = convolution.weight.shape[:2]
    side = 2 * convolution.reach + 1
    return {name: (1, channels_in, side, side) if name == "around" else (1, channels_out, 1, 1)}


class _Graph:
    """Nodes and weights of a model under construction; every method returns the name of its result."""

    def __init__(self) -> None:
        self._nodes: list[bytes] = []
        self._weights: list[bytes] = []

    def convolve(self, x: str, convolution: Convolution, output: str | None = None, same: bool = True) -> str:
        number = len(self._nodes)
        names = [x, f"weight{number}", f"bias{number}"]
        self._weights += [_tensor(names[1], convolution.weight), _tensor(names[2], convolution.bias)]
        side = convolution.weight.shape[-1]
        attributes = (
            _integers("kernel_shape", (side, side)),
            _integers("dilations", (convolution.dilation,) * 2),
            _integers("pads", (convolution.reach if same else 0,) * 4),
        )
        return self._node("Conv", names, attributes, output)

    def relu(self, x: str, output: str | None = None) -> str:
        return self._node("Relu", [x], output=output)

    def join(self, first: str, second: str) -> str:
        axis = _text(1, "axis") + _number(3, 1) + _number(20, _INT_ATTRIBUTE)
        return self._node("Concat", [first, second], (axis,))

    def model(self, given: dict[str, tuple[int, ...]], results: dict[str, tuple[int, ...]]) -> bytes:
        """Finish, with the shapes of what goes in and what comes out."""
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
    """Seven bits a byte, the lowest first, the eighth bit set on all but the last."""
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)
