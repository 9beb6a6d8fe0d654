import numpy as np
import pytest
from rail_extract.core.heads.outline import (
    FACE_DEPTH_M,
    FACES,
    MIN_STRAY_SHARE,
    Blurred,
    Grid,
    Outline,
    Scores,
    fit_section,
)
from rail_extract.laboratory.scenes.scanner import Scanner, head_outline, scan
from rail_extract.laboratory.scenes.tracks import Railhead

WIDTH = 0.072


def straight_head(length=40.0, step=0.01):
    x = np.arange(0, length, step)
    axes = [np.tile(axis, (len(x), 1)) for axis in ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0])]
    return Railhead(np.column_stack([x, 0 * x, 0 * x]), *axes)


def seen_from(angle_deg, share, noise_m, seed=0, width=WIDTH, away=4.5):
    """Offsets to the left and heights of the points of a head along the x axis, with a scanner on its left."""
    path = np.column_stack([np.linspace(0, 40, 400), np.zeros((400, 2))])
    height_m = away * np.tan(np.radians(angle_deg))
    scanner = Scanner(noise_m=noise_m, face_share=share, left_m=away, height_m=height_m, half_range_m=30.0)
    return scan(straight_head(), width, path, scanner, np.random.RandomState(seed))[:, 1:].T


def counts_of(grid, left, up):
    number = grid.number(left, up)
    return np.bincount(number[number >= 0], minlength=grid.size).astype(float)


def fitted(left, up, width=WIDTH):
    outline, grid = Outline.of(width), Grid.of(width)
    counts = counts_of(grid, left, up)
    return counts, fit_section(counts, outline, grid), outline, grid


def test_the_outline_is_that_of_the_laboratory():
    outline = Outline.of(WIDTH)
    samples, _ = head_outline(WIDTH)
    on_head = outline.parts[: FACES.stop].any(axis=0)
    for left, up in zip(outline.left[on_head], outline.up[on_head]):
        assert np.hypot(*(samples - [left, up]).T).min() < 0.0025
    assert np.abs(outline.left[on_head]).max() == pytest.approx(WIDTH / 2)
    assert outline.up[on_head].min() > -FACE_DEPTH_M
    np.testing.assert_allclose(outline.parts.sum(axis=1), 1.0)
    np.testing.assert_allclose(np.sort(outline.left), -np.sort(-outline.left)[::-1])


def test_strays_do_not_pull():
    random = np.random.default_rng(0)
    left, up = seen_from(45, 0.5, 0.004)
    strays = random.uniform(0.0, 0.06, 300), random.uniform(-0.04, 0.012, 300)
    _, section, _, _ = fitted(np.append(left, strays[0]), np.append(up, strays[1]))
    assert abs(section.place[0]) < 0.0015
    assert MIN_STRAY_SHARE < section.shares[-1] < 0.2


@pytest.mark.parametrize("angle_deg", [20, 40, 65])
def test_beams_that_meet_the_far_edge_and_what_is_behind_it_do_not_widen_the_head(angle_deg):
    random, ray = np.random.default_rng(0), np.radians(angle_deg)
    left, up = seen_from(angle_deg, 0.8, 0.005)
    edge, away = seen_edge(ray), random.uniform(0.0, 0.06, len(left) // 12)
    noise = random.normal(0.0, 0.005, (2, len(away)))
    behind = edge[0] - away * np.cos(ray) + noise[0], edge[1] - away * np.sin(ray) + noise[1]
    _, section, _, _ = fitted(np.append(left, behind[0]), np.append(up, behind[1]))
    assert abs(section.place[0]) < 0.001


def seen_edge(ray):
    """The place on the outline, on the right, where a line of sight from the left at an angle touches it, (2,)."""
    samples, _ = head_outline(WIDTH)
    return samples[np.argmax(samples @ [-np.sin(ray), np.cos(ray)])]


def test_derivatives_are_those_of_the_density():
    outline, grid = Outline.of(WIDTH), Grid.of(WIDTH)
    random = np.random.default_rng(1)
    shares = random.dirichlet(np.ones(len(outline.parts) + 1))
    place = np.array([0.003, -0.002, 0.04, 0.001, np.log(0.004), np.log(0.006), -0.5])
    derivatives = Blurred.at(place, outline, grid).by_place(shares)
    for number, step in enumerate([1e-6, 1e-6, 1e-5, 1e-6, 1e-5, 1e-5, 1e-4]):
        change = np.eye(7)[number] * step
        densities = [Blurred.at(place + side * change, outline, grid).density(shares) for side in (-1, 1)]
        numeric = (densities[1] - densities[0]) / (2 * step)
        np.testing.assert_allclose(derivatives[number], numeric, atol=1e-5 * np.abs(numeric).max())


@pytest.mark.parametrize("moved_m", [(0.001, 0.0), (-0.001, 0.0), (0.0, 0.001), (0.0, -0.001)])
def test_scores_tell_a_shift_from_a_lift(moved_m):
    left, up = seen_from(30, 0.5, 0.004)
    counts, section, outline, grid = fitted(left, up)
    scores = Scores.of(counts, section, outline, grid)
    number = grid.number(left + moved_m[0], up + moved_m[1])
    own = scores.by_bin[:, number[number >= 0]]
    np.testing.assert_allclose(own.mean(axis=1) / (own**2).mean(axis=1), moved_m, atol=2.5e-4)
    assert (own[1] ** 2).mean() == pytest.approx(scores.per_point, rel=0.15)


@pytest.mark.parametrize(("left", "up"), [(0.0, 0.0), (0.05, 0.01), (0.036, -0.03)])
def test_points_at_one_place_break_nothing(left, up):
    """As those that were drawn on the axis, or thinned to a grid."""
    counts, section, outline, grid = fitted(np.full(500, left), np.full(500, up))
    assert np.isfinite(section.place).all()
    assert np.isfinite(Scores.of(counts, section, outline, grid).by_bin).all()


def test_the_web_is_below_the_axis_and_a_part_of_its_own():
    head, rail = Outline.of(WIDTH, rays_deg=()), Outline.of(WIDTH, rays_deg=(), web=True)
    assert len(rail.parts) == len(head.parts) + 2
    assert np.allclose(rail.parts.sum(axis=1), 1.0)
    for part, side in zip(rail.parts[-2:], (-1, 1)):
        assert np.allclose(rail.left[part > 0], side * 0.008)
        assert rail.up[part > 0].max() < head.up.min() - 0.01
