"""All guides of a line together: parallel guides share most of their error, so each supports its neighbours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import Polyline
from .corridor import SECTION_M
from .course import GUIDE_M, STEP_M, Course, Evidence, guide_prior, trace
from .ridges import windows

FAR_M, NEAR_M, PARALLEL = 13.0, 2.5, 0.995
"""Guides this far apart at most, and this far at least, are those of one line where the cosine of their angle is
larger."""

OWN_M = 0.5
"""Standard deviation of a guide's own error beside that of its line."""

OWN_LENGTH_M, SMOOTHED_SECTIONS = 50.0, 7
"""Length over which this error is a new one, and the sections over which the joint course is averaged."""

MOST_TOGETHER = 8
"""Tracks whose curves are drawn together: the run time grows with the third power of their number."""

LEAST = -6.0
"""Score of places outside of the neighbour's reach."""


def courses(axes: Sequence[Polyline], found: Sequence[Evidence]) -> tuple[list[Course], list[np.ndarray]]:
    """Find the courses of parallel tracks.

    Returns
    -------
    list of Course
    list of (sections, c) arrays
        Score of each place together with that of the neighbours, for `rivals`.
    """
    together = [one.best + _support(number, axes, found) for number, one in enumerate(found)]
    joined = []
    for one, score in zip(found, together):
        shared = Evidence(one.across, one.score + (score - one.best)[:, None, :])
        course = trace(shared, guide_prior(one.across, len(score)))
        padded = np.pad(course.across, SMOOTHED_SECTIONS // 2, mode="edge")
        middle = np.convolve(padded, np.ones(SMOOTHED_SECTIONS) / SMOOTHED_SECTIONS, "valid")
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
    """Return beside which places, (n, 2), with unit vectors to the left, (n, 2), another line is parallel.

    Returns
    -------
    parallel : (n,) bool array
    t : (n,) array
        Chainage of the other line there.
    opposite : (n,) bool array
        Whether it runs the other way.
    """
    distance, nearest = cKDTree(other.xy).query(place, distance_upper_bound=FAR_M)
    near = np.isfinite(distance)
    nearest = np.where(near, nearest, 0)
    cosine = (normal * other.normals[nearest]).sum(axis=1)
    near &= (np.abs(cosine) > PARALLEL) & (distance > NEAR_M)
    return near, other.t[nearest], cosine < 0


def _blurred(score: np.ndarray) -> np.ndarray:
    """Return the best score at a similar place, less the cost of the difference."""
    aside = int(round(2 * OWN_M / STEP_M))
    step = np.arange(-aside, aside + 1) * STEP_M
    padded = np.pad(score, ((0, 0), (aside, aside)), constant_values=LEAST)
    return (windows(padded, 2 * aside + 1) - 0.5 * (step / OWN_M) ** 2).max(axis=-1)


RIVAL_M, RIVAL_SHARE, RIVAL_SECTIONS, SAME_M = 2.5, 0.8, 9, 0.2
"""Another track is at least this far away and has this share of the score over as many sections; places this close
are the same."""


def certainty(course: Course, score: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Return how likely the guide means this track and not another one within reach, (sections,).

    Parameters
    ----------
    score : (sections, c) array
        Together with the neighbours.
    across : (c,) array
    """
    kernel = np.ones(min(RIVAL_SECTIONS, len(score)))
    mean = np.column_stack([np.convolve(one, kernel / len(kernel), "same") for one in score.T])
    apart = np.abs(across - course.across[:, None])
    own = np.where(apart < SAME_M, mean, 0.1).max(axis=1)
    rival = (apart > RIVAL_M) & (mean > RIVAL_SHARE * own[:, None])
    nearest = np.where(rival, np.abs(across), np.inf).min(axis=1)
    return 1 / (1 + np.exp(-(np.minimum(nearest, 10.0) ** 2 - course.across**2) / (2 * GUIDE_M**2)))
