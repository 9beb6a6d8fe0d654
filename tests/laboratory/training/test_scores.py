"""Counts of cells, and bridged gaps."""

import numpy as np
import pytest
from rail_extract.laboratory.training.scores import Scores, bridged, score


def test_scores_count_by_cell():
    found, label = np.array([[1, 1, 0, 0]], bool), np.array([[1, 0, 1, 0]], bool)
    assert score(found, label) + Scores(1, 1, 1) == Scores(2, 2, 2)
    assert (Scores(1, 3, 3).precision, Scores(1, 3, 3).recall, Scores(1, 3, 3).f1) == (0.5, 0.75, 0.6)


@pytest.mark.parametrize(("shift", "strict", "tolerant"), [(0, 40, 40), (1, 0, 40), (2, 0, 0)])
def test_a_tolerance_of_one_cell_accepts_a_shift_by_one_cell(shift, strict, tolerant):
    label, found = np.zeros((2, 9, 40), dtype=bool)
    label[4], found[4 + shift] = True, True
    assert score(found, label) == Scores(40 - strict, 40 - strict, strict)
    assert score(found, label, tolerance=1) == Scores(40 - tolerant, 40 - tolerant, tolerant)


def test_a_gap_is_bridged_once_nearly_all_of_it_is_found():
    gap = np.zeros((20, 60), dtype=np.int16)
    gap[5, 10:30], gap[10, 10:30], gap[15, 50:] = 1, 2, 3
    found = np.zeros(gap.shape, dtype=bool)
    found[6, 5:29], found[10, :26], found[15] = True, True, True
    # the third gap touches the border
    assert bridged(found, gap) == {1: True, 2: False}
    assert bridged(gap > 0, gap) == {1: True, 2: True}
    assert bridged(gap < 0, gap) == {1: False, 2: False}
