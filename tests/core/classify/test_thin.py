"""Cells that are drawn along thin rails."""

import numpy as np
import pytest
from rail_extract.core.classify.thin import SURROUNDINGS_M, drawn

CELL, SPACING = 0.04, 1.507


def track(per_m, length=20.0, angle=0.3, seed=1, rails=2):
    """Points at random places on the heads of a track, at a grade of 2 %."""
    rng = np.random.RandomState(seed)
    along = rng.uniform(-length / 2, length / 2, int(rails * per_m * length))
    side = rng.randint(rails, size=len(along)) - 0.5
    across = side * SPACING + rng.uniform(-0.036, 0.036, len(along))
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = along * cosine - across * sine, along * sine + across * cosine
    return np.column_stack([x, y, 0.02 * along + rng.normal(0, 0.012, len(along))])


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 2, 2.5])
def test_a_thin_track_is_drawn_along_its_axes(angle):
    places = drawn(track(5.0, angle=angle), [SPACING], CELL)
    cosine, sine = np.cos(angle), np.sin(angle)
    along, across = places @ [cosine, sine], places @ [-sine, cosine]
    assert (np.abs(np.abs(across) - SPACING / 2) < 0.04).all()
    assert np.sqrt(np.mean((np.abs(across) - SPACING / 2) ** 2)) < 0.015
    for side in (1, -1):
        here = (side * across > 0) & (np.abs(along) < 9)
        assert len(np.unique(np.floor(along[here] / CELL))) >= 0.97 * 18 / CELL


def test_a_dense_track_is_not_drawn():
    assert drawn(track(25.0), [SPACING], CELL).shape == (0, 2)


def test_scattered_points_are_not_drawn():
    rng = np.random.RandomState(3)
    xyz = np.column_stack([rng.uniform(0, 20, (400, 2)), rng.uniform(0, 0.1, 400)])
    assert len(drawn(xyz, [SPACING], CELL)) * CELL / 2 < 0.02 * 400


def test_what_is_drawn_depends_on_the_surroundings_only():
    xyz = track(5.0, length=60.0, angle=0.0)
    whole = drawn(xyz, [SPACING], CELL)
    part = drawn(xyz[np.abs(xyz[:, 0]) < 5 + SURROUNDINGS_M], [SPACING], CELL)
    inside, expected = part[np.abs(part[:, 0]) < 5], whole[np.abs(whole[:, 0]) < 5]
    assert len(expected) > 500
    np.testing.assert_allclose(inside[np.lexsort(inside.T)], expected[np.lexsort(expected.T)], atol=1e-12)
