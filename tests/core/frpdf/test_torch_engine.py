"""A device without enough memory is asked for less, and replaced by the CPU in the end."""

import numpy as np
import pytest
from rail_extract.core.errors import DeviceExhaustedError
from rail_extract.core.frpdf import cleanup
from rail_extract.core.frpdf.corridor import Piece, lay_fields
from rail_extract.core.frpdf.layered import MIN_CELLS, LayeredEngine
from rail_extract.core.progress import Progress
from rail_extract.core.raster import RailRaster

torch = pytest.importorskip("torch")

from rail_extract.core.frpdf.torch_engine import TorchEngine  # noqa: E402


def line(length):
    """A raster whose corridor is one rectangle, so that pieces hold the same cells whichever way they are cut."""
    columns = np.arange(length)
    return RailRaster({}, 0.04, 0.0, 0.0).with_cells(np.column_stack([np.zeros_like(columns), columns]))


class Small(TorchEngine):
    """An engine on a device with room for a number of cells, until it moves to the CPU."""

    room = 0
    moved = False

    def sweep(self, seen, known, number, pieces, progress):
        self.device_cells = sum(one.size for one in seen)
        return super().sweep(seen, known, number, pieces, progress)

    def _load(self, array):
        if not self.moved and self.device_cells > self.room:
            raise torch.cuda.OutOfMemoryError("out of memory")
        return super()._load(array)

    def _move(self, device):
        self.moved = hasattr(self, "_passes")
        super()._move(device)


class Listener(Progress):
    def __init__(self):
        self.warnings = []

    def warning(self, text):
        self.warnings.append(text)


def test_fields_with_context_give_the_result_of_one_field(arrays):
    engine = TorchEngine(arrays, "CPU", exact=True)
    raster = line(1000)
    whole = cleanup.clean(raster, engine, passes=1)
    engine.max_cells = 20_000
    assert len(lay_fields(raster, engine.max_cells)) > 2
    parts = cleanup.clean(raster, engine, passes=1)
    assert whole.count() > 1000
    np.testing.assert_array_equal(parts.cells(), whole.cells())


@pytest.mark.parametrize("room, ends_on_cpu", [(50_000, False), (0, True)])
def test_an_exhausted_device_gets_fewer_cells_and_is_then_replaced_by_the_cpu(arrays, monkeypatch, room, ends_on_cpu):
    monkeypatch.setattr("rail_extract.core.frpdf.layered.MIN_CELLS", 1 << 10)
    monkeypatch.setattr("rail_extract.core.frpdf.corridor.CONTEXT", 80)
    raster = line(1500)
    expected = cleanup.clean(raster, TorchEngine(arrays, "CPU", exact=True), passes=1)
    assert expected.count() > 1000
    engine, listener = Small(arrays, "CPU", exact=True), Listener()
    engine.room, engine._others = room, ["cpu"]
    found = cleanup.clean(raster, engine, passes=1, progress=listener)
    assert engine.moved == ends_on_cpu
    assert listener.warnings
    assert ("on the CPU" in listener.warnings[-1]) == ends_on_cpu
    assert all("smaller parts" in text for text in listener.warnings[:-1])
    assert engine.max_cells == LayeredEngine.max_cells or engine.max_cells >= 1 << 10
    np.testing.assert_array_equal(found.cells(), expected.cells())


def test_a_computer_without_memory_for_small_parts_ends_the_run(arrays):
    engine = Small(arrays, "CPU", exact=True)
    with pytest.raises(MemoryError):
        cleanup.clean(line(100), engine, passes=1)
    assert MIN_CELLS <= engine.max_cells < 4 * MIN_CELLS


def test_memory_that_pytorch_does_not_get_asks_for_smaller_parts(arrays):
    engine = TorchEngine(arrays, "CPU")
    piece = Piece(0, 0, 1 << 24, 1 << 24)  # 3e14 cells: no computer has memory for them
    engine._load = lambda array: torch.empty((2, piece.height, piece.width))
    with pytest.raises(DeviceExhaustedError):
        engine.sweep([np.zeros((4, 4))], [np.zeros((4, 4))], 0, [piece], Progress())
