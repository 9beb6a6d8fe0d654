"""Chains of heights and cants as design elements, and the standard errors of all elements.

Standard errors count the misalignment which neighbouring points share.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from .chain import NOTHING, Chain, Held, Unknowns
from .elements import CantElement, Figures, PlanElement, VerticalElement
from .held import Given
from .noise import Noise, estimated, shared_covariance
from .plane_fit import PlanFit, Points
from .signals import FINAL_ROUNDS, FLOOR_M, PLAN, STILL_M, Signal, refitted, started
from .structure import is_within

SNAP_SIGMAS, SNAP_M = 2.58, 10.0
"""A ramp's end takes the place of a clothoid's end within this many standard errors (1 % level), and metres: the end of
a ramp of 5 mm over 150 m is known to 3 m."""


def heights(chain: Chain, signal: Signal, noise: Noise, errors: Errors) -> tuple[VerticalElement, ...]:
    """Return grades and parabolas."""
    z, grade = map(float, started(chain, signal, noise))
    made = []
    for start, end, bend, figures in _parts(chain, errors):
        length = end - start
        made.append(VerticalElement(start, length, z, grade, grade + bend * length, figures))
        z, grade = z + length * (grade + 0.5 * bend * length), grade + bend * length
    return tuple(made)


def cants(chain: Chain, signal: Signal, noise: Noise, errors: Errors) -> tuple[CantElement, ...]:
    """Return constant cants and ramps."""
    (cant,) = map(float, started(chain, signal, noise))
    made = []
    for start, end, bend, figures in _parts(chain, errors):
        made.append(CantElement(start, end - start, cant, cant + bend * (end - start), figures))
        cant += bend * (end - start)
    return tuple(made)


def _parts(chain: Chain, errors: Errors) -> list[tuple[float, float, float, Figures]]:
    """Return start, end, bend and figures of the parts."""
    made = []
    for number, (start, end, bend) in enumerate(zip(*chain.extents, chain.bends)):
        has_radius = bool(bend) and chain.order == 2
        figures = Figures(
            joint="G1" if chain.order == 2 and number else None,
            sigma_r_m=float(errors.bend[number] / bend**2) if has_radius else None,
            sigma_len_m=float(errors.length[number]),
            sigma_s_m=float(errors.s[number]),
            r_fit_m=float(1.0 / bend) if has_radius else None,
            s_fit_m=float(start),
        )
        made.append((float(start), float(end), float(bend), figures))
    return made


def on_clothoids(
    given: Given, plan: tuple[PlanElement, ...], signal: Signal, noise: Noise, least_m: float
) -> tuple[Chain, Errors]:
    """Return a fitted chain of cants whose ramps begin and end where clothoids do, and its standard errors.

    Joints that took their place from a clothoid have no error of their own.
    """
    chain, before = given.chain, None
    for _ in range(FINAL_ROUNDS):
        chain = refitted(chain, signal, noise, least_m, given.held)
        errors = chain_errors(chain, signal, noise, given.held)
        chain, moved = _snapped(chain, plan, signal, noise, errors)
        if before is not None and np.abs(chain.knots - before.knots).max() < STILL_M:
            break
        before = chain
    sure = np.concatenate([[False], moved])
    return chain, replace(errors, s=np.where(sure, np.nan, errors.s))


def _snapped(
    chain: Chain, plan: tuple[PlanElement, ...], signal: Signal, noise: Noise, errors: Errors
) -> tuple[Chain, np.ndarray]:
    """Return a chain of cants in which ramps begin and end where clothoids do, and which joints were moved there.

    Cant is built with the clothoids; the places of these are better known. A joint is moved as far as its standard
    error allows, which is 0 if it is held; farther, if the measured cant shows no difference.
    """
    ends = np.unique([s for one in plan if one.type == "clothoid" for s in (one.s_from, one.s_to)])
    if not len(ends) or not len(chain.p):
        return chain, np.zeros(len(chain.p), dtype=bool)
    sure = np.minimum(SNAP_SIGMAS * errors.s[1:], SNAP_M)
    far, moves = _moved(chain, ends, np.where(sure > 0, SNAP_M, 0.0))
    far = refitted(far, signal, noise, np.inf)
    if is_within(far, signal.blocks(noise).near(far), signal.kind.shown(noise)):
        return far, moves
    near, moves = _moved(chain, ends, sure)
    return refitted(near, signal, noise, np.inf) if moves.any() else chain, moves


def _moved(chain: Chain, ends: np.ndarray, limit_m: np.ndarray) -> tuple[Chain, np.ndarray]:
    """Return a chain whose joints are at the nearest of some places within limits, (j,), and which have moved."""
    nearest = ends[np.abs(chain.p[:, None] - ends).argmin(axis=1)]
    moves = (np.abs(nearest - chain.p) <= limit_m) & ~np.isin(nearest, chain.p)
    p = np.where(moves, nearest, chain.p)
    if (np.diff(np.concatenate([[chain.start], p, [chain.end]])) <= 0).any():
        return chain, np.zeros(len(chain.p), dtype=bool)
    return replace(chain, p=p, q=p.copy()), moves


SURE = 3.0
"""Standard errors by which the distances of the points from the fitted curve have to show misalignment."""

SINGULAR = 1e-13
"""Share of the largest singular value below which a combination of unknowns is not determined."""


@dataclass(frozen=True)
class Errors:
    """Standard errors of elements, (e,) arrays: of the length and of the start, metres, and of the bend, 1/m.

    That of the bend is 0 where the element is straight, NaN where the bend changes.
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
        pieces.append((fit.across[part][used], float(np.clip(degree, 0, PLAN.degrees[-1]))))
    step = float(points.s[-1]) / (len(points.s) - 1)
    found = estimated(pieces, step, FLOOR_M, SURE)
    return Noise(found.white_m, min(found.shared_m, tolerance_m), found.length_m)


def _spent(jacobian: sparse.csr_matrix, weight: np.ndarray, covariance: np.ndarray) -> float:
    """Return how many parameters a fit spends on some points: the sum of their leverages."""
    which = np.unique(jacobian.indices)
    rows = jacobian[:, which].toarray()
    return float(np.einsum("i,ij,jk,ik->", weight, rows, covariance[np.ix_(which, which)], rows, optimize=True))


def plan_errors(fit: PlanFit, points: Points, used_m: float, noise: Noise) -> Errors:
    """Return standard errors of the elements in plan, given the one for which points were weighted and their noise."""
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
    """Return standard errors of the parts of a chain whose joints are jumps; those of what was held are 0."""
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
    """Return the covariance of the weighted sums that a least squares fit solves for, (u, u); see `plan_errors`."""
    weighted = sparse.diags(weight) @ jacobian
    own = weighted.T @ jacobian * (noise.white_m / used_m) ** 2
    return (own + weighted.T @ (shared_covariance(s, noise) @ weighted)).tocsr()


def _deviation(rows: np.ndarray, spread: sparse.csr_matrix) -> np.ndarray:
    """Return the standard deviations of unknowns from their rows of the inverse normal matrix."""
    return np.sqrt(np.maximum(np.einsum("ij,ij->i", (spread.T @ rows.T).T, rows), 0.0))
