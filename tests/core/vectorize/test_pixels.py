"""The sparse pixel sets, against dense arrays."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rail_extract.core.raster import TILE, RailRaster
from rail_extract.core.vectorize.pixels import HOLE_CELLS, chamfer_distance, close, parity_fix, pixel_set
from scipy import ndimage

EIGHT = np.ones((3, 3))

images = arrays(bool, st.tuples(st.integers(1, 14), st.integers(1, 14)))


def dense_parity_fix(image):
    doubled = np.zeros((2 * image.shape[0] - 1, 2 * image.shape[1] - 1), dtype=bool)
    doubled[::2, ::2] = image
    doubled[::2, 1::2] = image[:, :-1] & image[:, 1:]
    doubled[1::2, ::2] = image[:-1] & image[1:]
    doubled[1::2, 1::2] = (image[:-1, :-1] & image[1:, 1:]) | (image[:-1, 1:] & image[1:, :-1])
    return doubled


def dense(pixels, shape):
    image = np.zeros(shape, dtype=bool)
    image[tuple(pixels.cells.T)] = True
    return image


def two_pass_chamfer(image):
    rows, columns = np.array(image.shape) + 2
    distance = np.pad(np.where(image, 10**6, 0), 1).astype(int)
    before = [(0, -1, 2), (-1, -1, 3), (-1, 0, 2), (-1, 1, 3)]
    for sign, order in ((1, range(1, rows - 1)), (-1, range(rows - 2, 0, -1))):
        for i in order:
            for j in range(1, columns - 1)[::sign]:
                distance[i, j] = min(
                    [distance[i, j]] + [distance[i + sign * di, j + sign * dj] + cost for di, dj, cost in before]
                )
    return distance[1:-1, 1:-1]


@given(images)
@settings(max_examples=60, deadline=None)
def test_parity_fix_on_pixels_equals_the_rule_on_arrays(image):
    doubled = parity_fix(pixel_set(np.argwhere(image)))
    np.testing.assert_array_equal(dense(doubled, np.array(image.shape) * 2 - 1), dense_parity_fix(image))


@given(images, st.integers(-(10**6), 10**6))
@settings(max_examples=40, deadline=None)
def test_chamfer_distance_equals_the_two_passes(image, shift):
    pixels = pixel_set(np.argwhere(image) + [shift, -shift])
    expected = two_pass_chamfer(image)[image]
    np.testing.assert_array_equal(chamfer_distance(pixels), expected)


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
