"""Places on and beside a line: rails over 70 m, what repeats within a gauge, and a second track."""

import numpy as np
import pytest
from rail_extract.core.airborne.beside import look_beside
from rail_extract.core.airborne.corridor import Corridor
from rail_extract.core.airborne.ridges import Shape

SHAPE = Shape.expected(1.507, 0.25)
SECTIONS = 12


def seen(middles, hidden=(), spacing_m=1.507):
    """Points on a level bed with ridges on both sides of each place in the middle."""
    rng = np.random.RandomState(1)
    t, across = rng.uniform(0, 10.0 * SECTIONS, 16_000), rng.uniform(-6.9, 6.9, 16_000)
    height = rng.normal(0, 0.03, len(t))
    for middle in middles:
        for side in (-0.5, 0.5):
            height += 0.09 * np.exp(-0.5 * ((across - middle - side * spacing_m) / SHAPE.width_m) ** 2)
    kept = ~np.isin((t / 10).astype(int), list(hidden))
    level = np.zeros(int(2 * SECTIONS))
    corridor = Corridor(t[kept], across[kept], height[kept], np.zeros(kept.sum(), int), 0.0, level)
    return look_beside(corridor, SHAPE, SECTIONS)


def test_a_track_gains_what_is_expected_and_has_no_rival():
    gain, flaw, most = seen([0.0]).on
    assert gain.shape == (SECTIONS,)
    assert (gain > 0.5 * most).all()
    assert (flaw < 0.1 * gain).all()
    assert (seen([0.0]).rival < 0.1 * gain).all()


def test_only_sections_within_35_m_count():
    gain, _, most = seen([0.0], hidden=range(5)).on
    assert gain[0] == pytest.approx(0, abs=1)
    assert gain[-1] > 0.5 * most[-1] > 20


def test_furrows_repeat_and_a_second_track_does_not():
    furrows = seen(np.arange(-6.0, 7.0, 1.5), spacing_m=0.75)
    gain, flaw, _ = furrows.on
    assert (furrows.repeated > 0.6 * (gain - flaw))[2:-2].all()
    two = seen([0.0, 4.0])
    gain, flaw, _ = two.on
    assert (two.repeated < 0.1 * gain).all()
    assert (two.score[:, np.abs(two.across - 4.0) < 0.1].max(axis=1) > 0.5 * gain).all()
