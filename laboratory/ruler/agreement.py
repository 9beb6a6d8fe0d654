"""How well the rails of two surveys of one place agree, and whether their stated standard errors explain the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.comparison import cut
from ...core.polyline import Chords
from ...core.rails import RailLine

SAME_RAIL_M = 0.30
"""Lines of two surveys this close are the same rail: registrations differ by centimetres."""


@dataclass(frozen=True)
class Agreement:
    """Differences between the rails of two surveys, second minus first, along the second; (n,) arrays in metres.

    Each stands for `length_m`; across, they are positive to the left. `sigma_m` and `sigmaz_m` are their standard
    errors, as both surveys state them.
    """

    length_m: np.ndarray
    across_m: np.ndarray
    height_m: np.ndarray
    sigma_m: np.ndarray
    sigmaz_m: np.ndarray

    @property
    def ratios(self) -> tuple[float, float]:
        """Root mean squares of the differences without their mean, over their standard errors: across, in height."""
        both = ((self.across_m, self.sigma_m), (self.height_m, self.sigmaz_m))
        across, height = (float(np.sqrt(np.mean(((off - off.mean()) / sigma) ** 2))) for off, sigma in both)
        return across, height

    def text(self) -> str:
        """Format length, mean and standard deviation in millimetres, and ratios, as `HEADER` names them."""
        parts = [f"{1000 * off.mean():.1f} ± {1000 * off.std():.1f}" for off in (self.across_m, self.height_m)]
        ratios = "".join(f"{ratio:>8.2f}" for ratio in self.ratios)
        return f"{self.length_m.sum():>8.0f}{parts[0]:>16}{parts[1]:>16}{ratios}"


HEADER = f"{'m':>8}{'across mm':>16}{'height mm':>16}{'/ sigma':>8}{'height':>8}"


def agreement(first: Sequence[RailLine], second: Sequence[RailLine]) -> Agreement | None:
    """Compare the rails of two surveys in the same coordinates, with standard errors; None if they share none."""
    there, here = (cut([rail.xyz for rail in rails]) for rails in (first, second))
    if not len(there.xyz) or not len(here.xyz):
        return None
    feet, number = there.nearest(here.middle)
    step = here.middle - feet
    mine = np.flatnonzero(np.hypot(step[:, 0], step[:, 1]) <= SAME_RAIL_M)
    if not len(mine):
        return None
    across = np.sum(step[:, :2] * there.left[number], axis=1)
    sigma_m = np.hypot(_sigmas(first, there, number[mine]), _sigmas(second, here, mine))
    return Agreement(here.lengths[mine], across[mine], step[mine, 2], *sigma_m)


def _sigmas(rails: Sequence[RailLine], chords: Chords, chosen: np.ndarray) -> np.ndarray:
    """Stated standard errors across and in height at some chords, (2, k) metres."""
    found = np.empty((2, len(chosen)))
    number, t = chords.number[chosen], chords.middle_t[chosen]
    for rail in np.unique(number):
        support = rails[rail].support
        if support is None:
            raise ValueError(f"The rail {rails[rail].rail_id} has no standard error.")
        mine = number == rail
        for line, values in zip(found, (support.sigma_m, support.sigmaz_m)):
            line[mine] = np.interp(t[mine], support.t, values)
    return found
