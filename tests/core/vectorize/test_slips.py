"""Slips: two rails that cross, and the curves that connect them on either side."""

import numpy as np
import pytest
from rail_extract.core.lines.network_smoothing import smooth_network
from rail_extract.core.raster import rasterize
from rail_extract.core.vectorize import vectorize
from rail_extract.core.vectorize.slips import open_slips
from scipy.spatial import cKDTree

HEAD_M, CELL_M = 0.072, 0.04
LEG_M = 30.0


def rails(number, radius_m, sides, heading):
    """Axes of two straight rails that cross at 1:`number`, and of slip curves on some sides of the crossing."""
    half = np.arctan(1 / number) / 2
    t = np.arange(-LEG_M, LEG_M, 0.05)
    lines = [np.column_stack([t * np.cos(half), side * t * np.sin(half)]) for side in (1, -1)]
    turn = np.linspace(-half, half, 400)
    middle = radius_m / np.cos(half)
    for side in sides:
        lines.append(np.column_stack([radius_m * np.sin(turn), side * (middle - radius_m * np.cos(turn))]))
    axes = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    return [line @ axes for line in lines]


def raster_of(lines, rng, per_m=400):
    """Cells of heads of even density on these axes."""
    clouds = []
    for line in lines:
        at = rng.uniform(0, len(line) - 1, int(per_m * 0.05 * len(line)))
        place = np.column_stack([np.interp(at, np.arange(len(line)), column) for column in line.T])
        along = np.gradient(line, axis=0)[at.astype(int)]
        normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
        clouds.append(place + rng.uniform(-0.5, 0.5, len(at))[:, None] * HEAD_M * normal)
    return rasterize(np.concatenate(clouds), CELL_M)


SPACING_M = 1.507


def at_gauge(lines, heading):
    """The rails, and their partners: two tracks that cross."""
    across = SPACING_M * np.array([-np.sin(heading), np.cos(heading)])
    return [*lines, *(line + across for line in lines)]


@pytest.mark.parametrize("sides", [(1, -1), (1,), (-1,), ()])
@pytest.mark.parametrize(("number", "radius_m", "heading"), [(9, 190.0, 0.5), (9, 190.0, -1.2), (11, 300.0, 0.3)])
def test_all_rails_of_a_slip_are_drawn(number, radius_m, heading, sides):
    true = at_gauge(rails(number, radius_m, sides, heading), heading)
    network = smooth_network(vectorize(raster_of(true, np.random.RandomState(0)), HEAD_M), 0.8)
    assert len(network.lines) == len(true)
    assert len(network.passes) == 4 * len(sides)  # each slip curve begins and ends on one of the rails that cross
    for axis in true:
        off = [np.percentile(cKDTree(axis).query(line)[0], 95) for line in network.lines]
        line = network.lines[int(np.argmin(off))]
        assert min(off) < 0.05 and np.percentile(cKDTree(line).query(axis)[0], 90) < 0.06


def test_a_curve_without_a_partner_is_no_slip():
    """The frog of a turnout may look like half a slip, but the other rail of the track has none."""
    lone = rails(9, 190.0, (1,), 0.4)
    partner = [line + SPACING_M * np.array([-np.sin(0.4), np.cos(0.4)]) for line in lone[:1]]
    network = vectorize(raster_of([*lone, *partner], np.random.RandomState(0)), HEAD_M)
    assert open_slips(network, cKDTree(np.concatenate(lone)))[1] == []
