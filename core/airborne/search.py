"""Where beside its guide each track runs: the places that most evidence supports, found by dynamic programming.

Parallel guides share most of their error, so each supports its neighbours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import Polyline
from .guide_line import SECTION_M, Corridor
from .ridges import HALF_M, RidgeShape, binned, fit, windows

STEP_M, SLOPE_STEP, SLOPES = 0.05, 0.02, 7
"""Distance between the places that are tried, and the directions of the guide's errors: their step and number."""

BLOCK = 24
"""Sections that are fitted at once, which limits the memory to about 100 MB."""

LEAST = -6.0
"""Least evidence of a section, so that none decides alone; it is that of a place out of reach."""

SATURATION, ALWAYS = 0.2, 1.0
"""Share of the gain of expected rails up to which evidence counts, and a gain that always does: two real tracks must
tie, so that the guide decides between them."""

STEP_COST, TURN_COST = 0.5, 1.0
"""Cost of a place that differs by one step from where the direction leads, and of a turn by one step of direction."""

GUIDE_M, GUIDE_LENGTH_M = 1.2, 20.0
"""Standard deviation of a guide, and the length over which its error is a new one."""

APART_M, TRACKS_APART_M = 0.4, 2.8
"""Places this far apart are others, and two tracks are at least this far apart."""

IMPOSSIBLE = -1e9
"""Score of a place where no course runs: below every sum of scores."""

FAR_M, PARALLEL = 13.0, 0.995
"""Guides this far apart at most are those of one line where the cosine of their angle is larger."""

LONG = 7
"""Sections that are looked at as one: one section may be hidden, or mislead."""

OWN_M = 0.5
"""Standard deviation of a guide's own error beside that of its line."""

OWN_LENGTH_M = 50.0
"""Length over which this error is a new one."""

MOST_TOGETHER = 8
"""Tracks whose curves are drawn together: the run time grows with the third power of their number."""

RIVAL_SHARE, RIVAL_SECTIONS = 0.8, 9
"""Another track has this share of the score over as many sections."""


@dataclass(frozen=True)
class Evidence:
    """How well places beside a guide show a track.

    The places are `across`, (c,), to the left of the guide, every `STEP_M`; `score` is (sections, SLOPES, c).
    """

    across: np.ndarray
    score: np.ndarray

    @property
    def best(self) -> np.ndarray:
        """Score of each place in its best direction, (sections, c)."""
        return self.score.max(axis=1)


@dataclass(frozen=True)
class GuideCourse:
    """A course beside a guide, (sections,) arrays.

    `across` is its distance to the left of the guide in the middle of each section of `SECTION_M`, and `margin` its
    score above that of the best course that is elsewhere in the section.
    """

    across: np.ndarray
    margin: np.ndarray


def slopes() -> np.ndarray:
    """Return the directions that are tried, metres to the left per metre along the guide."""
    return (np.arange(SLOPES) - SLOPES // 2) * SLOPE_STEP


def evidence(corridor: Corridor, reach_m: float, shape: RidgeShape) -> Evidence:
    """Weigh every place within reach of the axis in every section."""
    half, places = int(round(HALF_M / STEP_M)), 2 * int(round(reach_m / STEP_M)) + 1
    width = 2 * half + 1
    bins = places + width - 1
    low_m = -(places // 2 + half + 0.5) * STEP_M
    section = np.floor((corridor.t - corridor.start_m) / SECTION_M).astype(np.int64)
    ahead = corridor.t - corridor.start_m - (section + 0.5) * SECTION_M
    tables = [
        binned(section, corridor.across - slope * ahead, corridor.height, corridor.sections, low_m, bins, STEP_M)
        for slope in slopes()
    ]
    count, height = (np.stack(one, axis=1) for one in zip(*tables))
    u = (np.arange(width) - half) * STEP_M
    score = np.empty((corridor.sections, SLOPES, places), np.float32)
    for first in range(0, corridor.sections, BLOCK):
        block = slice(first, first + BLOCK)
        found = fit(windows(count[block], width), windows(height[block], width), u, shape)
        gain = np.minimum(found.gain, SATURATION * found.most + ALWAYS) - found.flaw
        score[block] = np.maximum(gain, LEAST)
    return Evidence((np.arange(places) - places // 2) * STEP_M, score)


def guide_prior(across: np.ndarray, sections: int) -> np.ndarray:
    """Return what a guide says about places beside it, (sections, c)."""
    return np.tile(-0.5 * (across / GUIDE_M) ** 2 * SECTION_M / GUIDE_LENGTH_M, (sections, 1))


def trace(found: Evidence, prior: np.ndarray) -> GuideCourse:
    """Find the course with the largest sum of evidence and prior, (sections, c), less the cost of its turns."""
    score = found.score + prior[:, None, :]
    ahead, back = _Move(len(found.across), 1), _Move(len(found.across), -1)
    best, choices = [score[0]], []
    for section in score[1:]:
        reached, choice = ahead(best[-1])
        best.append(reached + section)
        choices.append(choice)
    rest = [np.zeros_like(score[0])]
    for section in score[:0:-1]:
        rest.append(back(rest[-1] + section)[0])
    state = int(np.argmax(best[-1]))
    states = [state]
    for choice in reversed(choices):
        state = int(choice.ravel()[state])
        states.append(state)
    across = found.across[np.array(states[::-1]) % len(found.across)]
    marginal = np.array([(one + other).max(axis=0) for one, other in zip(best, rest[::-1])])
    elsewhere = np.where(np.abs(found.across - across[:, None]) > APART_M, marginal, IMPOSSIBLE).max(axis=1)
    return GuideCourse(across, marginal.max(axis=1) - elsewhere)


class _Move:
    """The step from a section to the next one, or to the one before: best predecessor of each direction and place."""

    def __init__(self, places: int, direction: int) -> None:
        lean = np.arange(SLOPES) - SLOPES // 2
        per_slope = int(round(SECTION_M * SLOPE_STEP / 2 / STEP_M))
        moved = direction * per_slope * (lean[:, None] + lean)
        place = np.arange(places)
        source = place - moved[:, :, None]
        self._inside = (source >= 0) & (source < places)
        self._source = np.where(self._inside, source, 0) + np.arange(SLOPES)[None, :, None] * places
        self._cost = (TURN_COST * np.abs(lean[:, None] - lean))[:, :, None]
        self._places = places

    def __call__(self, score: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the best score of each state, (SLOPES, places), and the state from which it comes."""
        beside = np.pad(score, ((0, 0), (1, 1)), constant_values=IMPOSSIBLE)
        near = np.stack([beside[:, :-2] - STEP_COST, score, beside[:, 2:] - STEP_COST])
        aside = near.argmax(axis=0)
        wide = np.take_along_axis(near, aside[None], axis=0)[0]
        reached = np.where(self._inside, wide.ravel()[self._source], IMPOSSIBLE) - self._cost
        lean = reached.argmax(axis=1)
        found = np.take_along_axis(reached, lean[:, None], axis=1)[:, 0]
        source = np.take_along_axis(self._source, lean[:, None], axis=1)[:, 0]
        return found, source + aside.ravel()[source] - 1


def courses(axes: Sequence[Polyline], found: Sequence[Evidence]) -> tuple[list[GuideCourse], list[np.ndarray]]:
    """Find the courses of parallel tracks, and the score, (sections, c), of each place together with its neighbours."""
    together = [one.best + _support(number, axes, found) for number, one in enumerate(found)]
    joined = []
    for one, score in zip(found, together):
        shared = Evidence(one.across, one.score + (score - one.best)[:, None, :])
        course = trace(shared, guide_prior(one.across, len(score)))
        padded = np.pad(course.across, LONG // 2, mode="edge")
        middle = np.convolve(padded, np.ones(LONG) / LONG, "valid")
        prior = -0.5 * ((one.across - middle[:, None]) / OWN_M) ** 2 * SECTION_M / OWN_LENGTH_M
        joined.append(trace(one, prior))
    return joined, together


def groups(axes: Sequence[Polyline]) -> list[list[int]]:
    """Return the numbers of the guides whose curves are drawn together: parallel ones, `MOST_TOGETHER` at most."""
    found: list[list[int]] = []
    for number, axis in enumerate(axes):
        for group in found:
            if len(group) < MOST_TOGETHER and any(parallel(axis.xy, axis.normals, axes[one])[0].any() for one in group):
                group.append(number)
                break
        else:
            found.append([number])
    return found


def _support(number: int, axes: Sequence[Polyline], found: Sequence[Evidence]) -> np.ndarray:
    """Return what the neighbours of a guide say about places beside it, (sections, c)."""
    own, sections = axes[number], len(found[number].score)
    t = own.t[0] + (np.arange(sections) + 0.5) * SECTION_M
    place, normal = own.at(t), own.left_at(t)
    support = np.zeros((sections, len(found[number].across)))
    for other, evidence in enumerate(found):
        if other == number:
            continue
        near, t, opposite = parallel(place, normal, axes[other])
        section = ((t - axes[other].t[0]) / SECTION_M).astype(np.int64)
        score = evidence.best[np.clip(section, 0, len(evidence.score) - 1)]
        score = np.where(opposite[:, None], score[:, ::-1], score)
        support += np.where(near[:, None], _blurred(score), 0.0)
    return support


def parallel(place: np.ndarray, normal: np.ndarray, other: Polyline) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where another line is parallel, given places, (n, 2), with unit vectors to the left: three (n,) arrays.

    They are whether it is parallel, the chainage of the other line there, and whether it runs the other way.
    """
    distance, nearest = cKDTree(other.xy).query(place, distance_upper_bound=FAR_M)
    near = np.isfinite(distance)
    nearest = np.where(near, nearest, 0)
    cosine = (normal * other.normals[nearest]).sum(axis=1)
    near &= (np.abs(cosine) > PARALLEL) & (distance > TRACKS_APART_M)
    return near, other.t[nearest], cosine < 0


def _blurred(score: np.ndarray) -> np.ndarray:
    """Return the best score at a similar place, less the cost of the difference."""
    aside = int(round(2 * OWN_M / STEP_M))
    step = np.arange(-aside, aside + 1) * STEP_M
    padded = np.pad(score, ((0, 0), (aside, aside)), constant_values=LEAST)
    return (windows(padded, 2 * aside + 1) - 0.5 * (step / OWN_M) ** 2).max(axis=-1)


def certainty(course: GuideCourse, score: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Return how likely the guide means this track and not another one within reach, (sections,).

    `score`, (sections, c), is that of each place in `across`, (c,), together with the neighbours.
    """
    kernel = np.ones(min(RIVAL_SECTIONS, len(score)))
    mean = np.column_stack([np.convolve(one, kernel / len(kernel), "same") for one in score.T])
    apart = np.abs(across - course.across[:, None])
    own = np.where(apart < APART_M, mean, 0.1).max(axis=1)
    rival = (apart > TRACKS_APART_M) & (mean > RIVAL_SHARE * own[:, None])
    nearest = np.where(rival, np.abs(across), np.inf).min(axis=1)
    return 1 / (1 + np.exp(-(np.minimum(nearest, 10.0) ** 2 - course.across**2) / (2 * GUIDE_M**2)))
