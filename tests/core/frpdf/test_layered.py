"""Sweeps over pieces give what the whole network gives; an exhausted device is asked for less."""

import numpy as np
import pytest
import torch
from rail_extract.core.errors import Cancelled
from rail_extract.core.frpdf import cleanup, folding
from rail_extract.core.frpdf.corridor import Piece, lay_fields
from rail_extract.core.frpdf.layered import LayeredEngine, overlaps
from rail_extract.core.frpdf.opencv_engine import OpenCvEngine
from rail_extract.core.frpdf.torch_engine import FEWEST_CELLS, TorchEngine
from rail_extract.core.progress import SILENT, Progress
from rail_extract.core.raster import RailRaster
from rail_extract.laboratory.training.train import export

SMALL_DILATIONS = (1, 2, 1, 3, 2, 4, 5)
RADIUS = 3 * (4 + sum(SMALL_DILATIONS))
"""Farthest cell that can influence a cell."""
GAIN = 2.4

ENGINES = {"torch": lambda arrays: TorchEngine(arrays, "CPU", exact=True), "opencv": OpenCvEngine}


@pytest.fixture
def arrays(network, monkeypatch):
    """Weights of a network that looks less far, so that a small raster holds all that it sees."""
    monkeypatch.setattr(folding, "DILATIONS", SMALL_DILATIONS)
    arrays = export(network)
    # Untrained weights would let every difference die out on its way through the layers.
    arrays = {name: array * GAIN if name.endswith(".1.weight") else array for name, array in arrays.items()}
    # About half of the cells along a line are to come out as rail.
    raster = np.pad(np.eye(60, dtype=np.float32), RADIUS)
    usual = np.median(TorchEngine(arrays, "CPU", exact=True).probabilities(raster, np.full_like(raster, 0.5), 0))
    arrays["layer.9.bias"] = arrays["layer.9.bias"] - np.log(usual / (1 - usual))
    return arrays


def noise(height, width):
    return (np.random.default_rng(0).random((height, width)) < 0.2).astype(np.float32)


def line(length):
    """A raster whose corridor is one rectangle, so that pieces hold the same cells however they are cut."""
    columns = np.arange(length)
    return RailRaster({}, 0.04, 0.0, 0.0).with_cells(np.column_stack([np.zeros_like(columns), columns]))


def quarters(height, width, row, column):
    """Cut a rectangle in four, at odd places."""
    rows, columns = (0, row, height), (0, column, width)
    return [
        Piece(rows[i], columns[j], rows[i + 1] - rows[i], columns[j + 1] - columns[j]) for i in (0, 1) for j in (0, 1)
    ]


def cut(raster, pieces):
    return [raster[piece.row : piece.row + piece.height, piece.column : piece.column + piece.width] for piece in pieces]


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("number", [0, 1])
def test_pieces_joined_give_the_whole_network_amid_an_empty_raster(arrays, name, number):
    engine = ENGINES[name](arrays)
    height, width = 2 * RADIUS + 11, 2 * RADIUS + 30
    raster = np.zeros((height, width), dtype=np.float32)
    raster[RADIUS:-RADIUS, RADIUS:-RADIUS] = noise(11, 30)
    state = np.full_like(raster, 0.5) if number == 0 else raster
    # Beyond what a rail cell reaches, the whole network still sees where its raster ends.
    seen, known = (np.pad(one, RADIUS, constant_values=one[0, 0]) for one in (raster, state))
    expected = engine.probabilities(seen, known, number)[RADIUS:-RADIUS, RADIUS:-RADIUS]
    pieces = quarters(height, width, 70, 120)
    found = engine.sweep(cut(raster, pieces), cut(state, pieces), number, pieces, SILENT)
    for part, whole in zip(found, cut(expected, pieces)):
        np.testing.assert_allclose(part, whole, atol=1e-4)
    assert np.ptp(expected) > 0.02


def test_each_neighbour_is_seen_where_it_lies():
    field = np.arange(60 * 50).reshape(60, 50)
    pieces = quarters(60, 50, 25, 31)
    parts = cut(field, pieces)
    around = np.full((pieces[0].height + 14, pieces[0].width + 14), -1)
    for other, target, source in overlaps(pieces[0], pieces, 7):
        around[target] = parts[other][source]
    np.testing.assert_array_equal(around[7:, 7:], field[:32, :38])
    assert (around[:7] == -1).all() and (around[:, :7] == -1).all()


def test_fields_with_context_give_what_one_field_gives(arrays):
    engine = TorchEngine(arrays, "CPU", exact=True)
    raster = line(1000)
    whole = cleanup.clean(raster, engine, passes=1)
    engine.most_cells = 20_000
    assert len(lay_fields(raster, engine.most_cells)) > 2
    parts = cleanup.clean(raster, engine, passes=1)
    assert whole.count() > 1000
    np.testing.assert_array_equal(parts.cells(), whole.cells())


class Small(TorchEngine):
    """An engine on a device with room for so many cells, until it moves to the processor."""

    room = 0

    def sweep(self, seen, known, number, pieces, progress):
        self.device_cells = sum(one.size for one in seen)
        return super().sweep(seen, known, number, pieces, progress)

    def _load(self, array):
        if not self.moved and self.device_cells > self.room:
            raise torch.cuda.OutOfMemoryError("out of memory")
        return super()._load(array)

    moved = False

    def _move(self, device):
        self.moved = hasattr(self, "_passes")
        super()._move(device)


class Listener(Progress):
    def __init__(self):
        self.warnings = []

    def warning(self, text):
        self.warnings.append(text)


@pytest.mark.parametrize("room, ends_on_processor", [(50_000, False), (0, True)])
def test_an_exhausted_device_is_asked_for_less_and_then_left(arrays, monkeypatch, room, ends_on_processor):
    monkeypatch.setattr("rail_extract.core.frpdf.torch_engine.FEWEST_CELLS", 1 << 10)
    monkeypatch.setattr("rail_extract.core.frpdf.corridor.CONTEXT", 80)
    raster = line(1500)
    expected = cleanup.clean(raster, TorchEngine(arrays, "CPU", exact=True), passes=1)
    assert expected.count() > 1000
    engine, listener = Small(arrays, "CPU", exact=True), Listener()
    engine.room = room
    found = cleanup.clean(raster, engine, passes=1, progress=listener)
    assert engine.moved == ends_on_processor
    assert listener.warnings
    assert ("processor" in listener.warnings[-1]) == ends_on_processor
    assert all("smaller parts" in text for text in listener.warnings[:-1])
    assert engine.most_cells == LayeredEngine.most_cells or engine.most_cells >= 1 << 10
    np.testing.assert_array_equal(found.cells(), expected.cells())


def test_a_device_is_left_before_its_parts_get_too_small(arrays):
    engine = TorchEngine(arrays, "CPU")
    messages = []
    while "processor" not in (messages or [""])[-1]:
        messages.append(engine.retreat())
    assert len(messages) == 1 + np.log2(LayeredEngine.most_cells / FEWEST_CELLS) // 2


def test_a_cancel_is_heard_between_pieces(arrays):
    class AfterThree(Progress):
        calls = 0

        def is_cancelled(self):
            self.calls += 1
            return self.calls > 3

    listener, pieces = AfterThree(), quarters(40, 40, 20, 20)
    parts = cut(noise(40, 40), pieces)
    with pytest.raises(Cancelled):
        TorchEngine(arrays, "CPU").sweep(parts, parts, 1, pieces, listener)
    assert listener.calls == 4
