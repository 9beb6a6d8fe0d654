"""Branches that are redrawn from where they part."""

import numpy as np
import pytest
from rail_extract.core.lines.bridges import MISFIT_M
from rail_extract.core.lines.network import LineNetwork
from rail_extract.core.vectorize.branches import resolve_branches
from rail_extract.core.vectorize.junctions import (
    run_through,
)
from rail_extract.core.vectorize.routes import choose_routes
from rail_extract.laboratory.curves import Element, trace
from scipy.spatial import cKDTree


def along_x(start, end, y=0.0):
    x = np.arange(start, end, 0.1)
    return np.column_stack([x, np.full(len(x), y)])


@pytest.mark.parametrize("radius", [190, 2500, 4800])
def test_a_merged_part_is_resolved_into_two_rails(radius):
    stock = along_x(0, 120)
    arc = trace([Element(80, 1 / radius, 1 / radius)], (40.0, 0.0)).xy[::5]
    apart_m = 40 + np.sqrt(2 * radius * 0.2)
    fork = np.array([[apart_m, 0.1]])
    stem = np.concatenate([stock[stock[:, 0] < apart_m], fork])
    legs = (np.concatenate([fork, rail[rail[:, 0] > apart_m + 0.1]]) for rail in (stock, arc))
    lines = (stem, *legs)
    nodes = np.concatenate([fork, stem[:1], *(line[-1:] for line in lines[1:])])
    network = resolve_branches(LineNetwork(lines, nodes, np.array([[1, 0], [0, 2], [0, 3]])))
    network = choose_routes(run_through(network))
    through, branch = sorted(network.lines, key=len, reverse=True)
    assert np.abs(through[:, 1]).max() < 0.02
    assert branch[0, 0] == pytest.approx(40 + np.sqrt(2 * radius * MISFIT_M), abs=0.7)
    assert cKDTree(trace([Element(80, 1 / radius, 1 / radius)], (40.0, 0.0)).xy).query(branch)[0].max() < 0.02
