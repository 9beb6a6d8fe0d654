import numpy as np
import pytest
from rail_extract.core.classify.lines import Marks, find_lines

CELL = 0.08


def marks(angle=0.0, radius=np.inf, per_m=12.0, length=10.0, rng=None):
    """Cells on a line or an arc through the origin, with the direction of each."""
    rng = rng or np.random.RandomState(1)
    s = (
        rng.uniform(-length / 2, length / 2, int(per_m * length))
        if per_m < 8
        else np.arange(-length / 2, length / 2, 1 / per_m)
    )
    bend = s / radius
    xy = (
        np.column_stack([s, s * bend / 2])
        if np.isinf(radius)
        else radius * np.column_stack([np.sin(bend), 1 - np.cos(bend)])
    )
    c, n = np.cos(angle), np.sin(angle)
    xy = xy @ np.array([[c, n], [-n, c]])
    theta = (angle + (0 if np.isinf(radius) else bend)) % np.pi
    return np.round(xy / CELL) * CELL, theta + np.zeros(len(xy)), np.abs(s) < length / 2 - 1


def off(theta, true):
    return np.abs((theta - true + np.pi / 2) % np.pi - np.pi / 2)


@pytest.mark.parametrize(("angle", "radius"), [(0, np.inf), (np.radians(17), np.inf), (np.pi / 2, np.inf), (0.4, 25.0)])
def test_direction_of_a_dense_line(angle, radius):
    xy, true, inner = marks(angle, radius)
    lines = find_lines(Marks(xy, np.zeros(len(xy))), 1.0, 0.035, 0.05)
    assert np.degrees(off(lines.theta, true))[inner].max() < (1.6 if np.isfinite(radius) else 1.0)
    assert np.degrees(off(lines.theta, true))[inner].mean() < 1.0
    assert (lines.cover[inner] >= 0.9).all()
    assert (lines.pure == 1).all()


@pytest.mark.parametrize("angle", [0, np.radians(17), np.pi / 2])
def test_direction_of_a_thin_line(angle):
    xy, true, inner = marks(angle, per_m=5.0, length=40.0)
    lines = find_lines(Marks(xy, np.zeros(len(xy))), 2.0, 0.06, 0.065)
    assert np.quantile(np.degrees(off(lines.theta, true))[inner], 0.95) < 2.0


def test_axis_is_off_by_less_than_a_cell():
    xy, _, inner = marks(0.3)
    lines = find_lines(Marks(xy, np.zeros(len(xy))), 1.0, 0.035, 0.05)
    across = lines.axis @ np.array([-np.sin(0.3), np.cos(0.3)])
    assert np.abs(across[inner]).max() < 0.012


def test_random_surroundings_are_not_pure():
    rng = np.random.RandomState(3)
    xy = np.round(rng.uniform(0, 10, (3000, 2)) / CELL) * CELL
    xy = np.unique(xy, axis=0)
    lines = find_lines(Marks(xy, np.zeros(len(xy))), 1.0, 0.035, 0.05)
    assert np.quantile(lines.pure, 0.9) < 0.2


def test_cells_of_another_height_do_not_count():
    one, _, inner = marks(0.0)
    other = one @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    height = np.repeat([0.1, 0.2], len(one))
    lines = find_lines(Marks(np.concatenate([one, other]), height), 1.0, 0.035, 0.05)
    assert np.degrees(off(lines.theta[: len(one)], 0))[inner].max() < 1
    assert (lines.pure == 1).all()


def test_an_area_has_no_line():
    side = np.arange(0, 4, CELL)
    xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    lines = find_lines(Marks(xy, np.zeros(len(xy))), 1.0, 0.035, 0.05)
    inner = ((xy > 1) & (xy < 3)).all(axis=1)
    assert not lines.cover[inner].any()


def test_no_cells_have_no_lines():
    lines = find_lines(Marks(np.empty((0, 2)), np.empty(0)), 1.0, 0.035, 0.05)
    assert lines.axis.shape == (0, 2)
    lone = find_lines(Marks(np.zeros((1, 2)), np.zeros(1)), 1.0, 0.035, 0.05)
    assert lone.cover.tolist() == [0.0]
