"""Results in files: what is read equals what was written, and names change with everything a result depends on."""

from dataclasses import replace

import numpy as np
import pytest
from rail_extract.core.cluster.store import DamagedError, Stored, can_store, fingerprint, load, save
from rail_extract.core.errors import DiskError
from rail_extract.core.frame import LocalFrame
from rail_extract.core.parameters import Parameters
from rail_extract.core.rails import RailLine, Support
from rail_extract.core.raster import rasterize
from rail_extract.core.squares.grid import Square
from rail_extract.core.squares.pieces import SquareRails
from rail_extract.core.squares.spool import SpooledPoints

FRAME = LocalFrame(np.array([500.0, 7100.0, 0.0]), 0.3048, 1.0, "EPSG:2227")
XYZ = np.random.RandomState(2).uniform(-30, 30, (40, 3))
RAILS = (
    RailLine(XYZ, 3, 10, 417, 1.5, 0.4, 2.5, np.array([[1.0, 3.5]]), Support(XYZ[:5, 0], np.arange(5.0), XYZ[:5, 1])),
    RailLine(XYZ, 4, 10, 9, 1.5, 0.4, 2.5, support=Support(XYZ[:5, 0], np.arange(5.0), XYZ[:5, 1], XYZ[:5])),
    RailLine(XYZ[:7], 0, 11, 20.25, 0.0, 0.1, 0.0),
)


def stored(path, result):
    assert can_store(result)
    save(path / "result.npz", result)
    return load(Stored(str(path / "result.npz")))


def same_rails(found, expected):
    assert len(found) == len(expected)
    for one, two in zip(found, expected):
        for name in ("rail_id", "class_code", "points", "resid_mm", "sigma_mm", "bridged_m"):
            assert getattr(one, name) == getattr(two, name)
            assert type(getattr(one, name)) is type(getattr(two, name))
        np.testing.assert_array_equal(one.xyz, two.xyz)
        np.testing.assert_array_equal(one.gaps, two.gaps)
        assert (one.support is None) == (two.support is None)
        if one.support is not None:
            np.testing.assert_array_equal(one.support.t, two.support.t)
            np.testing.assert_array_equal(one.support.points, two.support.points)
            np.testing.assert_array_equal(one.support.sigma_m, two.support.sigma_m)
            np.testing.assert_array_equal(one.support.strips, two.support.strips)


@pytest.mark.parametrize("rails", [RAILS, RAILS[:1], ()])
def test_rails_come_back_as_they_were(tmp_path, rails):
    same_rails(stored(tmp_path, rails), rails)


@pytest.mark.parametrize("square", [Square.on_grid((3, -4), 512.0, FRAME), Square((0, 0), FRAME, np.inf)])
def test_the_rails_of_a_square_come_back_with_their_place(tmp_path, square):
    found = stored(tmp_path, SquareRails(square, RAILS, XYZ[:4, :2]))
    same_rails(found.rails, RAILS)
    np.testing.assert_array_equal(found.nodes, XYZ[:4, :2])
    assert (found.square.key, found.square.side_m) == (square.key, square.side_m)
    np.testing.assert_array_equal(found.square.frame.to_crs(XYZ), square.frame.to_crs(XYZ))
    assert found.square.frame.crs_wkt == "EPSG:2227"


@pytest.mark.parametrize("points", [XYZ, np.empty((0, 3))])
def test_a_raster_comes_back_as_it_was(tmp_path, points):
    raster = replace(rasterize(points, 0.04), x0=2.5, y0=-1.0)
    found = stored(tmp_path, raster)
    assert (found.cell_m, found.x0, found.y0) == (0.04, 2.5, -1.0)
    assert found.tiles.keys() == raster.tiles.keys()
    assert all((found.tiles[place] == raster.tiles[place]).all() for place in raster.tiles)


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


@pytest.mark.parametrize("result", [RAILS, SquareRails(Square.on_grid((3, -4), 512.0, FRAME), RAILS, XYZ[:4, :2])])
def test_a_damaged_file_is_recognized_wherever_the_damage_is(tmp_path, result):
    path = tmp_path / "result.npz"
    save(path, result)
    whole = path.read_bytes()
    noticed = 0
    for place in range(0, len(whole), 7):
        path.write_bytes(whole[:place])
        with pytest.raises(DamagedError, match=r"^result\.npz is damaged"):
            load(Stored(str(path)))
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x55]) + whole[place + 1 :])
        try:
            again = load(Stored(str(path)))
        except DamagedError:
            noticed += 1
        else:  # dates and other remarks of the archive do not matter
            same_rails(getattr(again, "rails", again), RAILS)
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
