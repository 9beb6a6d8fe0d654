"""From rail cells to lines: closing, parity fix, distance, veinerization, pruning and tracing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rail_extract.core.raster import TILE, RailRaster
from rail_extract.core.vectorize.skeleton import (
    HOLE_CELLS,
    chains,
    chamfer_distance,
    close,
    parity_fix,
    pixel_set,
    prune,
    trace,
    veinerize,
)
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

EIGHT = np.ones((3, 3))

images = arrays(bool, st.tuples(st.integers(1, 20), st.integers(1, 20)))


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


def topology_of_image(image):
    components = ndimage.label(image, np.ones((3, 3)))[1]
    return components, ndimage.label(np.pad(~image, 1, constant_values=True))[1] - 1


def topology_of_graph(edges, count):
    graph = coo_matrix((np.ones(len(edges)), edges.T), shape=(count, count))
    components = connected_components(graph, directed=False)[0]
    return components, len(edges) - count + components


def skeleton(cells):
    """Polylines in cell units, x = column and y = -row, without closing and without any cleaning."""
    raster = RailRaster({}, 1.0, -0.5, 0.5).with_cells(np.asarray(cells))
    pixels = parity_fix(pixel_set(cells))
    distance = chamfer_distance(pixels)
    edges, tips = prune(veinerize(pixels, distance), distance)
    return trace(raster, pixels, edges, tips)


@given(images, st.booleans())
@settings(max_examples=120, deadline=None)
def test_the_graph_has_the_components_and_holes_of_the_image(image, doubled):
    pixels = pixel_set(np.argwhere(image))
    pixels = parity_fix(pixels) if doubled else pixels
    edges = veinerize(pixels, chamfer_distance(pixels))
    assert topology_of_graph(edges, len(pixels)) == topology_of_image(image)


@given(images)
@settings(max_examples=60, deadline=None)
def test_pruning_keeps_every_hole(image):
    pixels = parity_fix(pixel_set(np.argwhere(image)))
    distance = chamfer_distance(pixels)
    edges, _ = prune(veinerize(pixels, distance), distance)
    used, renumbered = np.unique(edges, return_inverse=True)
    assert topology_of_graph(renumbered.reshape(-1, 2), len(used))[1] == topology_of_image(image)[1]


@given(images)
@settings(max_examples=60, deadline=None)
def test_chains_use_every_edge_once_and_have_no_node_inside(image):
    pixels = pixel_set(np.argwhere(image))
    edges = veinerize(pixels, chamfer_distance(pixels))
    if len(edges) == 0:
        return
    vertices, borders = chains(edges, len(pixels))
    degree = np.bincount(edges.ravel(), minlength=len(pixels))
    traced = []
    for chain in np.split(vertices, borders[1:-1]):
        assert (degree[chain[1:-1]] == 2).all()
        assert chain[0] == chain[-1] or (degree[chain[[0, -1]]] != 2).all()
        traced += map(tuple, np.sort(np.column_stack([chain[:-1], chain[1:]]), axis=1).tolist())
    assert sorted(traced) == sorted(map(tuple, np.sort(edges, axis=1).tolist()))


@pytest.mark.parametrize("width", [1, 2, 3, 4])
@pytest.mark.parametrize("turned", [False, True])
def test_a_bar_becomes_one_straight_line_exactly_in_its_middle(width, turned):
    cells = np.argwhere(np.ones((width, 80), dtype=bool))
    network = skeleton(cells[:, ::-1] if turned else cells)
    assert sorted(network.degrees()) == [1, 1]
    assert len(network.lines) == 1
    (line,) = network.lines
    along, across = (line[:, ::-1] * [-1, -1]).T if turned else line.T
    middle = slice(1, -1) if len(line) > 2 else slice(None)
    np.testing.assert_allclose(np.abs(across[middle]), (width - 1) / 2, atol=1e-12)
    assert 0 <= 79 - np.ptp(along) <= width / 2


def test_a_ring_becomes_one_closed_line():
    row, column = np.mgrid[-40:41, -40:41]
    network = skeleton(np.argwhere(np.abs(np.hypot(row, column) - 30) < 1.2))
    (line,) = network.lines
    np.testing.assert_array_equal(line[0], line[-1])
    assert network.degrees().tolist() == [2]
    radius = np.hypot(line[:, 0] - 40, line[:, 1] + 40)
    assert np.abs(radius - 30).max() < 1.0
