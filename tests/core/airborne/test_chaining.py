"""Finds become lines: along arcs and over gaps, without mixing parallel tracks, and not from chance."""

import numpy as np
from rail_extract.core.airborne.chaining import BEYOND_M, chains
from rail_extract.core.airborne.search import Finds

RADIUS_M = 300.0


def on_arc(t, left_m=0.0, off=0.0):
    turn = t / RADIUS_M
    radius = RADIUS_M - left_m - off
    xy = np.column_stack([radius * np.sin(turn), RADIUS_M - radius * np.cos(turn)])
    return Finds(xy, turn % np.pi, np.full(len(t), 8.0))


def both(*parts):
    return Finds(*(np.concatenate([getattr(one, name) for one in parts]) for name in ("xy", "direction", "score")))


def test_a_curve_is_followed_over_a_gap_and_continued_at_both_ends():
    t = np.delete(np.arange(0.0, 300.0, 10.0), [12, 13, 14])
    off = 0.1 * np.random.RandomState(1).uniform(-1, 1, len(t))
    (line,) = chains(on_arc(t, off=off))
    assert len(line) >= 20
    assert np.abs(np.hypot(line[1:-1, 0], line[1:-1, 1] - RADIUS_M) - RADIUS_M).max() < 0.11
    length = np.hypot(*np.diff(line, axis=0).T)
    assert np.allclose(length[[0, -1]], BEYOND_M)
    assert length[1:-1].sum() > 270


def test_two_tracks_stay_apart_also_in_any_order():
    t = np.arange(0.0, 200.0, 10.0)
    finds = both(on_arc(t), on_arc(t + 4.0, left_m=4.0))
    order = np.random.RandomState(2).permutation(len(finds.xy))
    shuffled = Finds(finds.xy[order], finds.direction[order], finds.score[order])
    lines = list(chains(shuffled))
    assert len(lines) == 2
    for line in lines:
        beside = RADIUS_M - np.hypot(line[1:-1, 0], line[1:-1, 1] - RADIUS_M)
        assert np.ptp(beside) < 0.5
