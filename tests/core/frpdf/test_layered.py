"""A pass over pieces equals the pass of the whole network, on each engine."""

import numpy as np
import pytest
from rail_extract.core.errors import Cancelled
from rail_extract.core.frpdf import layered
from rail_extract.core.frpdf.corridor import Piece
from rail_extract.core.frpdf.engine import make_engine
from rail_extract.core.progress import SILENT, Progress


def engine_of(name, arrays):
    if name == "OPENCV":
        return make_engine(arrays, name)
    pytest.importorskip("torch")
    from rail_extract.core.frpdf.torch_engine import TorchEngine

    return TorchEngine(arrays, "CPU", exact=True)


def noise(height, width):
    return (np.random.default_rng(0).random((height, width)) < 0.2).astype(np.float32)


def quarters(height, width, row, column):
    """Cut a rectangle into four at a row and a column."""
    rows, columns = (0, row, height), (0, column, width)
    return [
        Piece(rows[i], columns[j], rows[i + 1] - rows[i], columns[j + 1] - columns[j]) for i in (0, 1) for j in (0, 1)
    ]


def cut(raster, pieces):
    return [raster[piece.row : piece.row + piece.height, piece.column : piece.column + piece.width] for piece in pieces]


@pytest.mark.parametrize("name", ["TORCH", "OPENCV"])
@pytest.mark.parametrize("number", [0, 1])
def test_pieces_joined_give_the_whole_network_amid_an_empty_raster(arrays, radius, whole_pass, name, number):
    engine = engine_of(name, arrays)
    height, width = 2 * radius + 12, 2 * radius + 32
    raster = np.zeros((height, width), dtype=np.float32)
    raster[radius:-radius, radius:-radius] = noise(12, 32)
    state = np.full_like(raster, 0.5) if number == 0 else raster
    # Beyond the reach of the rail cells, the whole network still sees the border of its raster.
    seen, known = (np.pad(one, radius, constant_values=one[0, 0]) for one in (raster, state))
    expected = 1 / (1 + np.exp(-whole_pass(arrays, seen, known, number)[radius:-radius, radius:-radius]))
    pieces = quarters(height, width, radius + 4, radius + 20)
    found = engine.sweep(cut(raster, pieces), cut(state, pieces), number, pieces, SILENT)
    for part, of_whole in zip(found, cut(expected, pieces)):
        np.testing.assert_allclose(part, of_whole, atol=1e-4)
    assert np.ptp(expected) > 0.02


@pytest.mark.parametrize("name", ["TORCH", "OPENCV"])
def test_a_cancel_is_noticed_between_pieces(arrays, name):
    class AfterThree(Progress):
        calls = 0

        def is_cancelled(self):
            self.calls += 1
            return self.calls > 3

    listener, pieces = AfterThree(), quarters(40, 40, 20, 20)
    parts = cut(noise(40, 40), pieces)
    with pytest.raises(Cancelled):
        engine_of(name, arrays).sweep(parts, parts, 1, pieces, listener)
    assert listener.calls == 4


@pytest.mark.parametrize("name", ["TORCH", "OPENCV"])
def test_threads_that_share_the_pieces_change_no_bit(arrays, name, monkeypatch):
    raster = noise(96, 96)
    pieces = [Piece(row, column, 24, 24) for row in range(0, 96, 24) for column in range(0, 96, 24)]
    engine, parts, found = engine_of(name, arrays), cut(raster, pieces), []
    for count in (1, 3):
        monkeypatch.setattr(layered, "threads", lambda count=count: count)
        found.append(np.array(engine.sweep(parts, parts, 1, pieces, SILENT)))
    np.testing.assert_array_equal(*found)


def test_an_error_in_a_thread_ends_the_pass(arrays, monkeypatch):
    class BrokenLayerError(Exception):
        pass

    def fails(*_):
        raise BrokenLayerError

    monkeypatch.setattr(layered, "threads", lambda: 3)
    engine, pieces = engine_of("OPENCV", arrays), quarters(40, 40, 20, 20)
    monkeypatch.setattr(engine, "_steps", lambda number: [layered.Step(0, fails)])
    with pytest.raises(BrokenLayerError):
        engine.sweep(*[cut(noise(40, 40), pieces)] * 2, 1, pieces, SILENT)
