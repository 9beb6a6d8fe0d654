"""Offsets of strips, the passes of a scanner, along tracks.

See docs/method.md section 6.7.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..polyline import interpolate, left_normals, length_along, project
from ..rails import Centerline, StripCourse

REACH_M = 1.0
"""Distance from a centerline within which its rails are: half of the widest gauge and a head."""

STEP_M = 1.0
"""Length over which the offsets on both rails are averaged."""


def strip_courses(centerlines: Sequence[Centerline], rows: np.ndarray) -> tuple[StripCourse, ...]:
    """Describe how strips lie along tracks.

    Parameters
    ----------
    centerlines : sequence of Centerline
    rows : (k, 7) array
        See `heads.strips.rows_of`, in the frame of the centerlines.

    Returns
    -------
    tuple of StripCourse
        By track and strip.
    """
    lines = [one.xyz[:, :2] for one in centerlines]
    feet = project(lines, rows[:, :2], REACH_M)
    return tuple(
        course
        for number, one in enumerate(centerlines)
        for course in _courses(one, feet.of(number).t, rows[feet.of(number).point])
    )


def _courses(centerline: Centerline, t: np.ndarray, rows: np.ndarray) -> Iterator[StripCourse]:
    """Average the offsets of each strip along one track."""
    line = centerline.xyz[:, :2]
    normals = interpolate(left_normals(line), length_along(line), t)
    across = np.einsum("ij,ij->i", rows[:, 3:5], normals)
    for strip in np.unique(rows[:, 2]):
        mine = rows[:, 2] == strip
        step, number, count = np.unique(np.floor(t[mine] / STEP_M), return_inverse=True, return_counts=True)
        means = [1000 * np.bincount(number, values[mine]) / count for values in (across, rows[:, 5])]
        yield StripCourse(centerline.track_id, int(strip), (step + 0.5) * STEP_M, *means)
