"""Chains: the model's derivatives, the fit, assembly, and the moves of the search."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rail_extract.core.alignment.chain import Chain, Samples, Span, assembled, columns, fitted
from rail_extract.core.alignment.moves import richer, simpler

S = np.arange(0.0, 400.0)


def samples(y=None, weight=1.0):
    return Samples(S, np.zeros_like(S) if y is None else y, np.zeros_like(S), np.full_like(S, weight**-2))


def chain(order=2, jump=False):
    q = np.array([50.0 if jump else 100.0, 150.0, 300.0])
    p = np.array([50.0, 150.0, 220.0])
    bends = np.array([0.0, 1 / 400, -1 / 300, 1 / 900])
    return Chain(0.0, 400.0, bends, (False, True, True, True), p, p.copy() if order == 1 else q, order)


def values(one):
    return columns(one, samples())[0][:, one.order :] @ one.bends


def test_the_second_derivative_is_the_bend():
    bend = np.diff(values(chain()), 2)
    expected = np.interp(S[1:-1], [0, 50, 100, 149.5, 150.5, 220, 300, 400], [0, 0, 1, 1, 2, 2, 3, 3])
    inside = (S[1:-1] % 50 > 1) & (S[1:-1] % 50 < 49) & (np.abs(S[1:-1] - 220) > 1)
    np.testing.assert_allclose(bend[inside], np.interp(expected, range(4), chain().bends)[inside], atol=1e-9)


@pytest.mark.parametrize("which", ["p", "q"])
@pytest.mark.parametrize("joint", [0, 2])
def test_derivatives_by_the_ends_of_a_ramp_are_those_of_differences(which, joint):
    def moved(step):
        knots = getattr(chain(), which).copy()
        knots[joint] += step
        return values(replace(chain(), **{which: knots}))

    by = columns(chain(), samples())[1][:, 2 * joint + (which == "q")] * np.diff(chain().bends)[joint]
    np.testing.assert_allclose(by, (moved(1e-4) - moved(-1e-4)) / 2e-4, atol=1e-6)


def test_derivatives_by_a_jump_are_those_of_differences():
    def moved(step):
        p, q = chain().p.copy(), chain().q.copy()
        p[1] = q[1] = 150.0 + step
        return values(replace(chain(), p=p, q=q))

    by = columns(chain(), samples())[1][:, 2:4].sum(axis=1) * np.diff(chain().bends)[1]
    away = np.abs(S - 150) > 1
    np.testing.assert_allclose(by[away], ((moved(1e-4) - moved(-1e-4)) / 2e-4)[away], atol=1e-5)


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2]))
@settings(max_examples=20)
def test_a_fit_returns_to_the_truth(seed, order):
    random = np.random.default_rng(seed)
    truth = chain(order)
    off = random.uniform(-6, 6, 6)
    off[3] = off[2]
    if order == 1:
        off[1::2] = off[0::2]
    start = replace(truth.with_knots(truth.knots[1:-1] + off), bends=np.zeros(4))
    found, rss = fitted(start, samples(values(truth), 1e3), 5.0, 30)
    assert rss < 1e-4
    np.testing.assert_allclose(found.knots, truth.knots, atol=1e-3)
    np.testing.assert_allclose(found.bends, truth.bends, atol=1e-8)


def test_spans_meet_in_jumps_and_ramps_in_parts_without_length():
    made = assembled(
        [Span(0, 10, False, False), Span(10, 20, False), Span(20, 30, True), Span(30, 40, True), Span(40, 50, False)], 2
    )
    assert made.curved == (False, True, True, True)
    assert made.p.tolist() == [10, 20, 30]
    assert made.q.tolist() == [10, 30, 40]
    assert made.size == 2 + 3 + 4


def test_moves_keep_the_chain_in_order():
    one = chain()
    for m in range(4):
        for move in (*simpler(one, m, True, True), *richer(one, m, True, True, 5.0)):
            assert (np.diff(move.knots) >= 0).all()
            assert len(move.bends) == len(move.curved) == len(move.p) + 1 == len(move.q) + 1
    assert {move.size for move in simpler(one, 1, True, True)} >= {one.size - 3, one.size - 1}
