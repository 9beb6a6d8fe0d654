"""Squares: independent of the files of a cloud, on one raster grid."""

from dataclasses import replace

import numpy as np
from built import IN_FEET, slanted_cloud
from rail_extract.core.clouds.points import RailPoints
from rail_extract.core.frame import LocalFrame
from rail_extract.core.raster import TILE
from rail_extract.core.tiles.grid import (
    MemorySource,
    lay_out,
    parted,
)

CELL = 0.04
SIDE = 4 * TILE * CELL


def test_squares_divide_the_points_and_margins_overlap():
    points = slanted_cloud()
    source = MemorySource(points, SIDE)
    squares = lay_out([source], source)
    own = [source.near(square, 0.0) for square in squares]
    assert len(squares) > 4
    assert sum(len(one.xyz) for one in own) == len(points.xyz) == sum(source.counts.values())
    back = np.concatenate([one.frame.to_crs(one.xyz) for one in own])
    np.testing.assert_allclose(np.sort(back[:, 0]), np.sort(IN_FEET.to_crs(points.xyz)[:, 0]), rtol=0, atol=1e-6)
    for square in squares:
        xyz = source.near(square, 5.0).xyz
        assert xyz[:, :2].min() >= -5 and xyz[:, :2].max() < SIDE + 5


def test_the_grid_does_not_depend_on_the_local_origin():
    points = slanted_cloud()
    moved = LocalFrame(IN_FEET.origin + 1000.0, 0.3048, 0.3048)
    other = RailPoints(moved.to_local(IN_FEET.to_crs(points.xyz)), moved, 10)
    assert MemorySource(points, SIDE).counts == MemorySource(other, SIDE).counts


def test_a_small_cloud_is_not_divided_and_keeps_its_frame():
    points = slanted_cloud(length=30.0)
    source = MemorySource(points, SIDE)
    (whole,) = lay_out([source], source)
    assert source.near(whole, 0.0) is points
    assert len(lay_out([source, MemorySource(slanted_cloud(), SIDE)], source)) > 1


def test_blunt_strips_show_only_what_the_lines_of_others_leave():
    points = replace(slanted_cloud(), strips=np.arange(4000) % 3)
    sharp, blunt = parted(MemorySource(points, SIDE), [1])
    assert (sharp.fills, blunt.fills) == (False, True)
    assert sum(blunt.counts.values()) == np.count_nonzero(points.strips == 1)
    assert sum(sharp.counts.values()) + sum(blunt.counts.values()) == 4000
    slope = np.array([1.0, 0.4])
    line = np.append(np.array([[20.0], [90.0]]) * slope + [0.1, -0.05], [[3.0], [3.0]], axis=1)
    filling = replace(blunt, lines=(line,))
    left = []
    for square in lay_out([sharp, filling], filling):
        shift = square.frame.shift_to(IN_FEET)
        part = filling.part(square)
        assert part.near(square, 5.0).xyz.tolist() == filling.near(square, 5.0).xyz.tolist()
        assert part.near(square, 0.0).blunt
        left.append(filling.near(square, 0.0).xyz + shift)
    along = np.sort(np.concatenate(left)[:, 0])
    own = points.xyz[points.strips == 1]
    np.testing.assert_allclose(along, np.sort(own[(own[:, 0] < 20.08) | (own[:, 0] > 90.08), 0]), atol=0.05)
