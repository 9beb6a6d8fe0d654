"""Chains of heights and cants as design elements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .chain import Chain
from .elements import CantElement, Figures, PlanElement, VerticalElement
from .given import Given
from .noise import Noise
from .signals import FINAL_ROUNDS, STILL_M, Signal, refitted, started
from .uncertainty import Errors, chain_errors

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

    Cant is built with the clothoids; the places of these are better known. A joint is moved only as far as its standard
    error allows, which is 0 if it is held.
    """
    ends = np.unique([s for one in plan if one.type == "clothoid" for s in (one.s_from, one.s_to)])
    if not len(ends) or not len(chain.p):
        return chain, np.zeros(len(chain.p), dtype=bool)
    nearest = ends[np.abs(chain.p[:, None] - ends).argmin(axis=1)]
    limit = np.minimum(SNAP_SIGMAS * errors.s[1:], SNAP_M)
    moves = (np.abs(nearest - chain.p) <= limit) & ~np.isin(nearest, chain.p)
    p = np.where(moves, nearest, chain.p)
    if (np.diff(np.concatenate([[chain.start], p, [chain.end]])) <= 0).any():
        return chain, np.zeros(len(chain.p), dtype=bool)
    moved = replace(chain, p=p, q=p.copy())
    return refitted(moved, signal, noise, np.inf), moves
