"""Veinerization, pruning and tracing: topology, parity and lines of known shape."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from rail_extract.core.raster import RailRaster
from rail_extract.core.vectorize.pixels import chamfer_distance, parity_fix, pixel_set
from rail_extract.core.vectorize.tracing import chains, trace
from rail_extract.core.vectorize.veinerization import prune, veinerize
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

images = arrays(bool, st.tuples(st.integers(1, 20), st.integers(1, 20)))


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
