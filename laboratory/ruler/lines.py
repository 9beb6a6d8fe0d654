"""Comparison of extracted lines with true lines: completeness, correctness, lateral and height errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...core.comparison import cut


@dataclass(frozen=True)
class Comparison:
    """Result of a comparison of lines with the truth.

    Errors are taken where line and truth are within the tolerance, once along the truth and once along the lines; the
    larger of the two is stored.

    Attributes
    ----------
    completeness : float
        Share of the true length that has a line within the tolerance, in plan.
    correctness : float
        Share of the length of the lines that is within the tolerance of a true line, in plan.
    lateral_rmse_m, lateral_p95_m, lateral_bias_m : float
        Offset of the line in plan, positive to the left of the truth.
    height_rmse_m, height_p95_m, height_bias_m : float
        Height of the line above the truth.
    length_ratio : float
        Length of all lines divided by the length of the truth, in space.
    """

    completeness: float
    correctness: float
    lateral_rmse_m: float
    lateral_p95_m: float
    lateral_bias_m: float
    height_rmse_m: float
    height_p95_m: float
    height_bias_m: float
    line_count: int
    truth_count: int
    length_ratio: float


@dataclass(frozen=True)
class Offsets:
    """Offsets of lines from the truth at n places, (n,) each; `weight` is the length that a place represents."""

    distance: np.ndarray
    lateral: np.ndarray
    height: np.ndarray
    weight: np.ndarray

    @property
    def length_m(self) -> float:
        """Length that all places together represent."""
        return float(self.weight.sum())

    @classmethod
    def between(cls, true: np.ndarray, line: np.ndarray, left: np.ndarray, weight: np.ndarray) -> Offsets:
        """Compute the offsets from true places to places on lines, (n, 3) each; `left` has unit vectors, (n, 2)."""
        step = line - true
        return cls(np.hypot(step[:, 0], step[:, 1]), np.sum(step[:, :2] * left, axis=1), step[:, 2], weight)

    def within(self, tolerance_m: float) -> Offsets:
        """Return the offsets at places where the line is near the truth."""
        return self.at(self.distance <= tolerance_m)

    def at(self, which: np.ndarray) -> Offsets:
        """Return the offsets at some of the places, (n,) bool."""
        return Offsets(self.distance[which], self.lateral[which], self.height[which], self.weight[which])


@dataclass(frozen=True)
class Match:
    """Offsets along the truth, `there`, and along the lines, `back`, which can be evaluated with any tolerance.

    Each place of `back` has its line, its plan distance from the start of this line in metres, and the nearest place of
    `there`; `true` is empty without lines or truth.
    """

    there: Offsets
    back: Offsets
    line: np.ndarray
    t: np.ndarray
    line_count: int
    truth_count: int
    true: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=int))

    def where(self, there: np.ndarray, back: np.ndarray) -> Match:
        """Return what some places of the truth, and some places of the lines, show; (n,) bool each."""
        line, t = self.line[back], self.t[back]
        return Match(self.there.at(there), self.back.at(back), line, t, self.line_count, self.truth_count)

    def within(self, tolerance_m: float) -> Comparison:
        """Compare lines and truth that are at most this distance apart in plan."""
        there, back = self.there.within(tolerance_m), self.back.within(tolerance_m)
        return Comparison(
            completeness=there.length_m / self.there.length_m if self.there.length_m else np.nan,
            correctness=back.length_m / self.back.length_m if len(self.line) else 0.0,
            lateral_rmse_m=_worse(_rms(there.lateral), _rms(back.lateral)),
            lateral_p95_m=_worse(_p95(there.lateral), _p95(back.lateral)),
            lateral_bias_m=_worse(_mean(there.lateral), _mean(back.lateral)),
            height_rmse_m=_worse(_rms(there.height), _rms(back.height)),
            height_p95_m=_worse(_p95(there.height), _p95(back.height)),
            height_bias_m=_worse(_mean(there.height), _mean(back.height)),
            line_count=self.line_count,
            truth_count=self.truth_count,
            length_ratio=self.back.length_m / self.there.length_m if self.there.length_m else np.nan,
        )

    def wrong_m(self, tolerance_m: float = 0.05) -> float:
        """Return the length of the lines that is not within the tolerance of a true line, metres."""
        return self.back.length_m - self.back.within(tolerance_m).length_m

    def share_within(self, sigma_m: np.ndarray, tolerance_m: float = 0.05) -> float:
        """Return the share of lateral errors along the lines that are at most the standard error there, (n,) metres."""
        near = self.back.distance <= tolerance_m
        return float(_mean(np.abs(self.back.lateral[near]) <= sigma_m[near]))


def compare_lines(
    extracted: Sequence[np.ndarray], truth: Sequence[np.ndarray], tolerance_m: float = 0.05
) -> Comparison:
    """Compare lines with the truth, both (n, 3) metres; a line within the tolerance in plan is taken for the true one.

    Without extracted lines the errors are NaN; without heights, only the errors in height are.
    """
    return match(extracted, truth).within(tolerance_m)


def match(extracted: Sequence[np.ndarray], truth: Sequence[np.ndarray]) -> Match:
    """Find the nearest line for each place of the truth, and the nearest true line for each place of the lines.

    Without truth, all lines are infinitely far from it.
    """
    lines, true = cut(extracted), cut(truth)
    if not len(true.start):
        nothing = np.full(len(lines.start), np.inf)
        back = Offsets(nothing, nothing, nothing, lines.lengths)
        return Match(back.within(0.0), back, lines.number, lines.middle_t, len(extracted), 0)
    if not len(lines.start):
        nothing = np.full(len(true.start), np.inf)
        there = Offsets(nothing, nothing, nothing, true.lengths)
        return Match(there, there.within(0.0), lines.number, lines.middle_t, len(extracted), len(truth))
    feet, _ = lines.nearest(true.middle)
    there = Offsets.between(true.middle, feet, true.left, true.lengths)
    feet, chord = true.nearest(lines.middle)
    back = Offsets.between(feet, lines.middle, true.left[chord], lines.lengths)
    return Match(there, back, lines.number, lines.middle_t, len(extracted), len(truth), chord)


def _worse(a: float, b: float) -> float:
    return float(a if abs(a) >= abs(b) else b)


def _rms(values: np.ndarray) -> float:
    return np.sqrt(np.mean(values**2)) if len(values) else np.nan


def _mean(values: np.ndarray) -> float:
    return np.mean(values) if len(values) else np.nan


def _p95(values: np.ndarray) -> float:
    return np.percentile(np.abs(values), 95) if len(values) else np.nan
