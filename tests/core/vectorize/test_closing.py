"""Closing and filling of holes."""

import numpy as np
import pytest
from rail_extract.core.raster import TILE, RailRaster
from rail_extract.core.vectorize.closing import HOLE_CELLS, close
from scipy import ndimage

EIGHT = np.ones((3, 3))


def raster_of(image, corner=(0, 0)):
    return RailRaster({}, 0.04, 0.0, 0.0).with_cells(np.argwhere(image) + corner)


@pytest.mark.parametrize("corner", [(0, 0), (-30, 100), (TILE - 20, TILE - 33), (-1, -TILE + 1)])
def test_closing_does_not_depend_on_the_tiles(corner):
    image = np.random.default_rng(5).random((90, 110)) < 0.35
    padded = np.pad(image, 30)
    closed = ndimage.binary_closing(padded, EIGHT)
    labels, number = ndimage.label(~closed)
    for hole in range(1, number + 1):
        if np.count_nonzero(labels == hole) <= HOLE_CELLS:
            closed[labels == hole] = True
    result = close(raster_of(image, corner)).read(corner[0] - 30, corner[1] - 30, *padded.shape)
    np.testing.assert_array_equal(result, closed)


@pytest.mark.parametrize(("side", "filled"), [((4, 5), True), ((3, 7), False)])
def test_holes_are_filled_up_to_twenty_cells(side, filled):
    image = np.pad(np.zeros(side, dtype=bool), 2, constant_values=True)
    assert close(raster_of(image)).count() == (image.size if filled else image.sum())


def test_closing_bridges_two_cells_but_not_three():
    line = np.ones((2, 30), dtype=bool)
    two, three = line.copy(), line.copy()
    two[:, 10:12] = False
    three[:, 10:13] = False
    assert close(raster_of(two)).count() == 60
    assert close(raster_of(three)).count() == 54
