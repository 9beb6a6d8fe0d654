"""Standard errors of fitted elements that count the misalignment which neighbouring points share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from .chain import NOTHING, Chain, Held, Unknowns
from .noise import Noise, estimated, shared_covariance
from .plane_fit import PlanFit, Points
from .signals import FLOOR_M, Signal

LEAST_DEGREE, LARGEST_DEGREE = 0.0, 3.0
"""Limits of the degree of a polynomial that follows the errors of an element as much as the fit does."""

SURE = 3.0
"""Standard errors by which the distances of the points from the fitted curve have to show misalignment."""

SINGULAR = 1e-13
"""Share of the largest singular value below which a combination of unknowns is not determined."""


@dataclass(frozen=True)
class Errors:
    """Standard errors.

    Attributes
    ----------
    bend : (e,) array
        Of the bend of each element, 1/m; 0 where it is straight, NaN where it changes.
    length, s : (e,) array
        Of the length of each element and of its start, metres.
    """

    bend: np.ndarray
    length: np.ndarray
    s: np.ndarray


def remaining(fit: PlanFit, points: Points, tolerance_m: float) -> Noise:
    """Return the noise that explains the distances of the points from the fitted curve."""
    ends = np.searchsorted(fit.s, [one.s_to for one in fit.elements[:-1]])
    parts = [slice(first, last) for first, last in zip([0, *ends], [*ends, len(fit.s)])]
    covariance = fit.solver.covariance_rows(np.arange(fit.jacobian.shape[1]))
    pieces = []
    for part in parts:
        degree = _spent(fit.jacobian[part], points.weight[part], covariance) - 1.0
        used = points.weight[part] > 0
        pieces.append((fit.across[part][used], float(np.clip(degree, LEAST_DEGREE, LARGEST_DEGREE))))
    step = float(points.s[-1]) / (len(points.s) - 1)
    found = estimated(pieces, step, FLOOR_M, SURE)
    return Noise(found.white_m, min(found.shared_m, tolerance_m), found.length_m)


def _spent(jacobian: sparse.csr_matrix, weight: np.ndarray, covariance: np.ndarray) -> float:
    """Return how many parameters a fit spends on some points: the sum of their leverages."""
    which = np.unique(jacobian.indices)
    rows = jacobian[:, which].toarray()
    return float(np.einsum("i,ij,jk,ik->", weight, rows, covariance[np.ix_(which, which)], rows, optimize=True))


def plan_errors(fit: PlanFit, points: Points, used_m: float, noise: Noise) -> Errors:
    """Return standard errors of the elements in plan.

    Parameters
    ----------
    fit : PlanFit
    points : Points
    used_m : float
        Standard deviation of a single point for which the points were weighted, metres.
    noise : Noise
        That they have.
    """
    count = len(fit.elements)
    bends = fit.jacobian.shape[1] - 4 * count
    rows = fit.solver.covariance_rows(np.arange(3 * count, 4 * count + bends))
    spread = _spread(fit.jacobian, fit.s, points.weight, used_m, noise)
    starts = np.vstack([np.zeros(rows.shape[1]), np.cumsum(rows[bends:-1], axis=0)])
    bend, length, s = (_deviation(one, spread) for one in (rows[:bends], rows[bends:], starts))
    nodes = fit.nodes
    known = np.append(bend, 0.0)[nodes[:, 0]]
    return Errors(np.where(nodes[:, 0] == nodes[:, 1], known, np.nan), length, s)


def chain_errors(chain: Chain, signal: Signal, noise: Noise, held: Held = NOTHING) -> Errors:
    """Return standard errors of the parts of a chain whose joints are jumps.

    Parameters
    ----------
    chain : Chain
    signal : Signal
    noise : Noise
    held : Held
        Bends and starts that were not fitted.
    """
    unknowns = Unknowns.of(chain, held)
    weighted = unknowns.matrix(chain, signal.blocks(noise).near(chain))[:, :-1]
    linear, joints = int(unknowns.free.sum()), unknowns.knots[1::2] >= 0
    scale = np.linalg.norm(weighted, axis=0)
    scale[scale == 0] = 1.0
    half = np.linalg.pinv(np.linalg.qr(weighted / scale, mode="r"), rcond=SINGULAR) / scale[:, None]
    bends, starts = np.zeros((len(chain.bends), len(half))), np.zeros((len(chain.bends) + 1, len(half)))
    bends[unknowns.free[chain.order :]] = half[chain.order : linear]
    starts[1:-1][joints] = half[linear:]
    return Errors(*(np.linalg.norm(one, axis=1) for one in (bends, np.diff(starts, axis=0), starts[:-1])))


def _spread(
    jacobian: sparse.csr_matrix, s: np.ndarray, weight: np.ndarray, used_m: float, noise: Noise
) -> sparse.csr_matrix:
    """Return the covariance of the weighted sums that a least squares fit solves for, (u, u).

    Parameters
    ----------
    jacobian : (n, u) sparse array
    s, weight : (n,) array
        Of the points; the weight is their number over the square of `used_m`.
    used_m : float
        Standard deviation of a single point for which they were weighted, metres.
    noise : Noise
        That they have.
    """
    weighted = sparse.diags(weight) @ jacobian
    own = weighted.T @ jacobian * (noise.white_m / used_m) ** 2
    return (own + weighted.T @ (shared_covariance(s, noise) @ weighted)).tocsr()


def _deviation(rows: np.ndarray, spread: sparse.csr_matrix) -> np.ndarray:
    """Return the standard deviations of unknowns from their rows of the inverse normal matrix."""
    return np.sqrt(np.maximum(np.einsum("ij,ij->i", (spread.T @ rows.T).T, rows), 0.0))
