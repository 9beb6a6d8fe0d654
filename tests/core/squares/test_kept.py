"""Results in files: what is read equals what was written, and names change with everything a result depends on."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.errors import DiskError
from rail_extract.core.frame import LocalFrame
from rail_extract.core.parameters import Parameters
from rail_extract.core.rails import RailLine, Support
from rail_extract.core.raster import rasterize
from rail_extract.core.squares.kept import DamagedError, Stored, can_store, fingerprint, load, save
from rail_extract.core.squares.seams import SquareRails
from rail_extract.core.tiles.grid import Square
from rail_extract.core.tiles.store import SpooledPoints

FRAME = LocalFrame(np.array([500.0, 7100.0, 0.0]), 0.3048, 1.0, "EPSG:2227")
XYZ = np.random.RandomState(2).uniform(-30, 30, (40, 3))
SUPPORT = Support.of_one_strip(XYZ[:5, 0], np.arange(5.0), XYZ[:5, 1])
RAILS = (
    RailLine(XYZ, 3, 10, 417, 1.5, 0.4, 2.5, np.array([[1.0, 3.5]]), SUPPORT),
    RailLine(XYZ, 4, 10, 9, 1.5, 0.4, 2.5, support=replace(SUPPORT, strips=XYZ[:5])),
    RailLine(XYZ[:7], 0, 11, 20.25, 0.0, 0.1, 0.0),
)


OF_SQUARES = [SquareRails(Square.on_grid((3, -4), 512.0, FRAME), RAILS, XYZ[:4, :2])]
OF_SQUARES += [SquareRails(Square((0, 0), FRAME, np.inf), RAILS[:1], XYZ[:0, :2])]
RASTERS = [replace(rasterize(points, 0.04), x0=2.5, y0=-1.0) for points in (XYZ, np.empty((0, 3)))]


@pytest.mark.parametrize("result", [RAILS, RAILS[:1], (), *OF_SQUARES, *RASTERS])
def test_a_result_comes_back_as_it_was(tmp_path, difference, result):
    assert can_store(result)
    save(tmp_path / "result.npz", result)
    assert difference(load(Stored(str(tmp_path / "result.npz"))), result) is None


def test_other_results_are_not_stored():
    assert not can_store("CPU") and not can_store(None) and not can_store((1, 2))


def test_a_name_changes_with_each_fact():
    square = Square.on_grid((3, -4), 512.0, FRAME)
    source = SpooledPoints(FRAME, 10, 512.0, {(3, -4): 7}, 9.0, {(3, -4): ("/a/size1/10_3_-4_0",)}, {0: 1})
    facts = [
        (square, source, Parameters(1.435, 0.072)),
        (replace(square, key=(3, -5)), source, Parameters(1.435, 0.072)),
        (replace(square, frame=replace(FRAME, origin=FRAME.origin + 1e-9)), source, Parameters(1.435, 0.072)),
        (square, replace(source, files={(3, -4): ("/a/size2/10_3_-4_0",)}), Parameters(1.435, 0.072)),
        (square, replace(source, passes={0: 2}), Parameters(1.435, 0.072)),
        (square, source, Parameters(1.435, 0.072, smoothing_z_m=2.0)),
        (square, source, RAILS),
        (square, source, RAILS[::-1]),
        (square, source, {("clean", (0, 1)): Stored("/a/1.npz")}),
        (square, source, {("clean", (0, 1)): Stored("/a/2.npz")}),
        (square, source, {("clean", (0, 2)): Stored("/a/1.npz")}),
    ]
    assert len({fingerprint(*one) for one in facts}) == len(facts)


def test_a_name_does_not_change_with_the_place_of_the_folder_or_the_order_of_inputs():
    here, there = (
        {(0, n): Stored(f"/{root}/{n}.npz") for n in order} for root, order in (("a", (1, 2)), ("b", (2, 1)))
    )
    assert fingerprint(here, fingerprint) == fingerprint(there, fingerprint)


@pytest.mark.parametrize("result", [RAILS, OF_SQUARES[0]])
def test_a_damaged_file_is_recognized_wherever_the_damage_is(tmp_path, difference, result):
    path = tmp_path / "result.npz"
    save(path, result)
    whole = path.read_bytes()
    noticed = 0
    for place in range(0, len(whole), 7):
        path.write_bytes(whole[:place])
        with pytest.raises(DamagedError, match=r"^result\.npz is damaged"):
            load(Stored(str(path)))
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x55]) + whole[place + 1 :])
        try:  # dates and other remarks of the archive do not matter
            assert difference(load(Stored(str(path))), result) is None
        except DamagedError:
            noticed += 1
    assert noticed > 0.5 * len(whole) / 7


@pytest.mark.parametrize("make", [lambda path: path.mkdir(), lambda path: np.savez(path, other=np.zeros(3))])
def test_something_else_of_this_name_is_recognized(tmp_path, make):
    make(tmp_path / "result.npz")
    with pytest.raises(DamagedError):
        load(Stored(str(tmp_path / "result.npz")))


def test_an_unfinished_result_is_never_left_behind(tmp_path, monkeypatch):
    def fail(*arguments, **named):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(DiskError, match="free space"):
        save(tmp_path / "result.npz", RAILS)
    assert list(tmp_path.iterdir()) == []
