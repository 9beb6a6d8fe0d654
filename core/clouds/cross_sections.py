"""Cross-sections: the points around single places of a cloud, which is read once for all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..polyline import Polyline
from ..progress import SILENT, Progress
from .points import Request, touching


@dataclass(frozen=True)
class CrossSection:
    """A vertical plane across a line: a place on it, (3,) metres, height NaN if unknown, and a unit vector along it."""

    place: np.ndarray
    direction: np.ndarray

    def seen(self, xyz: np.ndarray) -> np.ndarray:
        """Return points, (n, 3) metres, as seen along the line, (n, 3): ahead, to the right, up.

        >>> CrossSection(np.array([10.0, 20.0, 5.0]), np.array([0.0, 1.0])).seen(np.array([[11.0, 22.0, 5.5]])).tolist()
        [[2.0, 1.0, 0.5]]
        """
        east, north, up = (xyz - self.place).T
        x, y = self.direction
        return np.column_stack([east * x + north * y, east * y - north * x, up])

    def crossings(self, line: np.ndarray) -> np.ndarray:
        """Return where a line, (n, 3) metres, crosses the plane, (k, 2): to the right, up."""
        ahead, right, up = self.seen(line).T
        numbers = np.flatnonzero((ahead[:-1] < 0) != (ahead[1:] < 0))
        share = ahead[numbers] / (ahead[numbers] - ahead[numbers + 1])
        return np.column_stack([one[numbers] + share * (one[numbers + 1] - one[numbers]) for one in (right, up)])


def cross_section_at(line: np.ndarray, share: float) -> CrossSection:
    """Return the plane across a line, (n, 3) metres, at a share of its plan length."""
    own = Polyline(line)
    at = share * own.length_m
    segment = int(np.clip(np.searchsorted(own.t, at, side="right") - 1, 0, len(line) - 2))
    place = own.at(np.array([at]))[0]
    step = line[segment + 1, :2] - line[segment, :2]
    return CrossSection(place, step / np.hypot(*step))


def points_near(
    request: Request, places: Sequence[np.ndarray], reach_m: float, progress: Progress = SILENT
) -> list[np.ndarray]:
    """Read the points around places, metres from the zero of the coordinate system, each file once.

    Returns (n, 3) for each place, up to `reach_m` away in plan; files without a place are skipped.
    """
    found: list[list[np.ndarray]] = [[np.empty((0, 3))] for _ in places]
    plan = np.array([place[:2] for place in places]).reshape(-1, 2)
    tree, areas = cKDTree(plan), np.column_stack([plan - reach_m, plan + reach_m]) / request.zero.horizontal_unit_m
    for header, share in zip(request.headers, request.shares(progress)):
        if not len(touching(areas, header.extent)):
            continue
        for xyz, *_ in request.read(header, share):
            local = request.zero.to_local(xyz)
            local = local[tree.query(local[:, :2])[0] <= reach_m]
            for number in range(len(plan)) if len(local) else ():
                near = local[np.hypot(*(local[:, :2] - plan[number]).T) <= reach_m]
                if len(near):
                    found[number].append(near)
    return [np.concatenate(parts) for parts in found]
