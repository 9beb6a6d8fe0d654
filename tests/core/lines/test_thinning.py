import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.lines.thinning import essential_vertices, thin
from rail_extract.core.rails import RailLine


def rail(xyz):
    return RailLine(np.asarray(xyz), 1, 10, points=0, resid_mm=0.0, sigma_mm=0.0, bridged_m=0.0)


def arc(radius, length, step=0.05):
    angle = np.arange(0, length / radius, step / radius)
    return radius * np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle])


def test_lines_keep_the_vertices_in_which_others_end():
    main = arc(300.0, 60.0)
    branch = main[517] + np.column_stack([np.arange(20.0), 0.02 * np.arange(20.0) ** 2, np.zeros(20)])
    alone = thin([rail(main)], 0.002, 0.002)[0].xyz
    thinned, other = (line.xyz for line in thin([rail(main), rail(branch)], 0.002, 0.002))
    assert not (alone == main[517]).all(axis=1).any()
    assert (thinned == other[0]).all(axis=1).any()
    assert len(thinned) <= len(alone) + 2


def test_thinned_lines_are_short_and_near():
    (line,) = thin([rail(arc(300.0, 60.0))], 0.002, 0.002)
    assert len(line.xyz) < 40
    middle = 0.5 * (line.xyz[1:] + line.xyz[:-1])
    assert np.abs(np.hypot(middle[:, 0], middle[:, 1] - 300.0) - 300.0).max() <= 0.002
    np.testing.assert_array_equal(line.xyz[[0, -1]], arc(300.0, 60.0)[[0, -1]])


@pytest.mark.parametrize("radius", [25.0, 190.0, 1200.0])
def test_thinned_curves_neither_shrink_nor_shift(radius):
    """Chords between vertices of the curve would be inside it, by 1.3 mm on average."""
    (line,) = thin([rail(arc(radius, 60.0, 0.01))], 0.002, 0.002)
    at = np.linspace(0, len(line.xyz) - 1, 20_001)
    x, y = (np.interp(at, np.arange(len(line.xyz)), column) for column in line.xyz.T[:2])
    weight = np.hypot(np.gradient(x), np.gradient(y))
    off = np.hypot(x, y - radius) - radius
    assert abs(np.average(off, weights=weight)) < 0.0001
    assert np.abs(off).max() < 0.002


def test_dropped_vertices_are_within_the_tolerance():
    random = np.random.default_rng(2)
    along = np.arange(0, 60, 0.1)
    rough = np.column_stack([along, np.cumsum(random.normal(0, 0.001, (600, 2)), axis=0)])
    (line,) = thin([rail(rough)], 0.002, 0.003)
    assert len(line.xyz) < 300
    assert np.abs(np.interp(along, line.xyz[:, 0], line.xyz[:, 1]) - rough[:, 1]).max() < 0.002 + 1e-5
    assert np.abs(np.interp(along, line.xyz[:, 0], line.xyz[:, 2]) - rough[:, 2]).max() < 0.003 + 1e-5


@given(st.integers(0, 10**6), st.floats(1e-3, 0.3), st.floats(1e-3, 0.3))
@settings(max_examples=25, deadline=None)
def test_simplified_lines_keep_both_tolerances(seed, tolerance_xy, tolerance_z):
    random = np.random.default_rng(seed)
    line = np.cumsum(random.normal(size=(60, 3)) * 0.3 + [0.5, 0, 0], axis=0)
    kept = np.flatnonzero(essential_vertices(line, tolerance_xy, tolerance_z)).tolist()
    assert kept[0] == 0
    assert kept[-1] == 59
    for first, last in zip(kept[:-1], kept[1:]):
        chord = line[last] - line[first]
        for vertex in line[first : last + 1]:
            share = np.clip((vertex - line[first])[:2] @ chord[:2] / (chord[:2] @ chord[:2]), 0, 1)
            off = vertex - line[first] - share * chord
            assert np.hypot(*off[:2]) <= tolerance_xy + 1e-12
            assert abs(off[2]) <= tolerance_z + 1e-12


def test_height_counts_on_its_own_and_plan_without_height():
    hump = np.column_stack([np.arange(5.0), np.zeros(5), [0, 0, 0.01, 0, 0]])
    assert essential_vertices(hump, 0.002, 0.002).sum() > 2
    assert essential_vertices(hump, 0.002, 0.02).sum() == 2
    hump[:, 2] = np.nan
    assert essential_vertices(hump, 0.002, 0.002).sum() == 2
    hump[2, 1] = 0.01
    assert essential_vertices(hump, 0.002, 0.002).sum() == 5


def test_thinning_keeps_a_closed_line_closed():
    angle = np.linspace(0, 2 * np.pi, 5001)
    loop = 25 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    kept = essential_vertices(loop, 0.002, 0.002)
    assert kept[0]
    assert kept[-1]
    fewest = 2 * np.pi * 25 / np.sqrt(8 * 25 * 0.002)
    assert fewest <= kept.sum() <= 2.1 * fewest


def test_a_tolerance_of_zero_drops_only_vertices_on_the_line():
    assert essential_vertices(arc(25, 90.0, step=3.0), 0.0, 0.0).all()
    straight = np.column_stack([np.arange(9.0), np.zeros(9), np.zeros(9)])
    assert essential_vertices(straight, 0.0, 0.0).sum() == 2
