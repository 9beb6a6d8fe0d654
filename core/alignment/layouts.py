"""Chains of heights and cants as design elements, the standard errors of all elements, and what a fit holds.

Standard errors count the misalignment which neighbouring points share. Held are types, radii and starts of a corrected
table; proposals are round radii.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Optional

import numpy as np
from scipy import sparse

from ..errors import ParameterError
from ..frame import LocalFrame
from ..progress import SILENT, Progress
from .chain import NOTHING, Chain, Held, Span, Unknowns, assembled
from .elements import Alignment, CantElement, Element, Figures, PlanElement, VerticalElement
from .noise import Noise, estimated, shared_covariance
from .plane_fit import FitError, MeasuredLine, PlanFit, fit_plan
from .structure import FINAL_ROUNDS, FLOOR_M, PLAN, STILL_M, Signal, is_within, refitted, started

SNAP_SIGMAS, SNAP_M = 2.58, 10.0
"""A ramp's end takes the place of a clothoid's end within this many standard errors (1 % level), and metres: the end of
a ramp of 5 mm over 150 m is known to 3 m."""

EDITED_R, EDITED_M = 1e-6, 0.0005
"""A radius (as a share) and a start (metres) were edited if they differ by more from what the fit has noted."""

TOUCHING_M = 0.01
"""Elements whose ends differ by less touch, metres."""

BENT = ("arc", "parabola", "ramp")
"""Types whose bend is constant and not 0."""


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


def remaining(fit: PlanFit, points: MeasuredLine, tolerance_m: float) -> Noise:
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


def plan_errors(fit: PlanFit, points: MeasuredLine, used_m: float, noise: Noise) -> Errors:
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


@dataclass(frozen=True)
class Given:
    """The structure that a table states.

    `poses`, (e, 3), is the place and direction at the start of each element in plan; None for those of the line.
    """

    chain: Chain
    held: Held = NOTHING
    poses: Optional[np.ndarray] = None


def given_of(fixed: Alignment, first_m: float, length_m: float) -> Given:
    """Return the structure of the elements in plan for a part of a line: where on the line it begins, and its length.

    The first and the last element are continued to the ends of the part.
    """
    plan = [moved(one, -first_m) for one in fixed.plan]
    bounds = _bounds(fixed.track_id, plan, 0.0, length_m)
    if plan[0].s_to <= 0.0 or (len(plan) > 1 and bounds[-2] >= length_m):
        raise ParameterError(
            f"The elements of track {fixed.track_id} in FIXED end at {fixed.s_to:.0f} m, but its line is "
            f"{first_m + length_m:.0f} m long: give the table of this line."
        )
    spans = [
        Span(start, end, one.type == "clothoid", one.type == "arc", one.k_to, one.k_from)
        for one, start, end in zip(plan, bounds[:-1], bounds[1:])
    ]
    chain = assembled(spans, 2)
    parts = [one for one in plan if one.type != "clothoid"]
    numbers = np.flatnonzero(chain.extents[1] > chain.extents[0])
    bends = {int(number): one.k_from for number, one in zip(numbers, parts) if _has_edited_radius(one)}
    poses = [_pose(fixed, one, start + first_m) for one, start in zip(fixed.plan, bounds)]
    return Given(chain, Held(bends, _edited_starts(plan, bounds)), np.array(poses))


def given_along(track_id: Optional[int], shape: Sequence[Element], signal: Signal) -> Given:
    """Return the structure of the elements in height or of cant; those beyond the ends of the signal are left out."""
    first, last = float(signal.s[0]), float(signal.s[-1])
    covering = max(sum(one.s_from <= first for one in shape) - 1, 0)
    known = [one for number, one in enumerate(shape) if number == covering or first < one.s_from < last]
    bounds = _bounds(track_id, known, first, last)
    spans = [
        Span(start, end, False, one.type in BENT, _bend(one)) for one, start, end in zip(known, bounds[:-1], bounds[1:])
    ]
    bends = {number: _bend(one) for number, one in enumerate(known) if _has_edited_radius(one)}
    return Given(assembled(spans, signal.kind.order), Held(bends, _edited_starts(known, bounds)))


def without(elements: Sequence[PlanElement], number: int, length_m: float) -> Given:
    """Return the structure of fitted elements of which one is closed by its neighbours, on a line of some length."""
    rest = [noted(one) for at, one in enumerate(elements) if at != number]
    return given_of(Alignment(None, LocalFrame(np.zeros(3)), tuple(rest)), 0.0, length_m)


def noted(one: PlanElement, **figures: Any) -> PlanElement:
    """Return a fitted element with its figures, which note radius and start so that an edit shows."""
    radius = 1.0 / one.k_from if one.type == "arc" else None
    return replace(one, figures=Figures(r_fit_m=radius, s_fit_m=one.s_from, **figures))


def moved(one: PlanElement, by_m: float) -> PlanElement:
    """Return an element that starts farther along the line."""
    noted_m = None if one.figures.s_fit_m is None else one.figures.s_fit_m + by_m
    return replace(one, s_from=one.s_from + by_m, figures=replace(one.figures, s_fit_m=noted_m))


def _pose(fixed: Alignment, one: PlanElement, start: float) -> tuple[float, float, float]:
    """Return place and direction of an element that is continued to a start."""
    alone, s = replace(fixed, plan=(one,)), np.array([start])
    (x, y), heading = alone.places(s)[0], alone.headings(s)[0]
    return float(x), float(y), float(heading)


def _bounds(track_id: Optional[int], elements: Sequence[Element], first: float, last: float) -> list[float]:
    """Return where elements start, and the end of the last one; the outer ones reach to `first` and `last`."""
    bounds = [first, *(_joint(before, after) for before, after in zip(elements[:-1], elements[1:])), last]
    wrong = next((at for at in range(1, len(bounds) - 1) if bounds[at] <= bounds[at - 1]), None)
    if wrong is not None:
        raise ParameterError(
            f"In FIXED, the element {wrong + 1} in layout {elements[wrong].layout} of track {track_id} does not start "
            f"after the one before it: correct its s_from of {elements[wrong].s_from:.4f} m."
        )
    return bounds


def _joint(before: Element, after: Element) -> float:
    """Return where two elements meet: midway if the row between them is missing."""
    if abs(before.s_to - after.s_from) < TOUCHING_M or _is_edited(after):
        return after.s_from
    return 0.5 * (before.s_to + after.s_from)


def _edited_starts(elements: Sequence[Element], bounds: Sequence[float]) -> dict[int, float]:
    """Return the starts that were edited, by the number of their element."""
    return {number: bounds[number] for number, one in enumerate(elements) if number and _is_edited(one)}


def _is_edited(one: Element) -> bool:
    """Return whether the start of an element was edited."""
    return one.figures.s_fit_m is not None and abs(one.s_from - one.figures.s_fit_m) > EDITED_M


def _has_edited_radius(one: Element) -> bool:
    """Return whether the radius of an arc or a parabola was edited, or stands in a table that no fit made."""
    if one.type not in ("arc", "parabola"):
        return False
    return one.figures.r_fit_m is None or abs(one.figures.r_fit_m * _bend(one) - 1.0) > EDITED_R


def _bend(one: Element) -> float:
    """Return the bend of an element that has a constant one, 1/m."""
    if isinstance(one, PlanElement):
        return one.k_from
    return one.curvature if isinstance(one, VerticalElement) else (one.cant_to_m - one.cant_from_m) / one.length_m


STEPS_M = (1000.0, 500.0, 100.0, 50.0, 25.0, 10.0, 5.0, 1.0)
"""Steps of round radii, the roundest first, metres."""

SIGMAS = 2.0
"""A radius may be rounded by this many standard errors."""

MOST_RISE = 6.6
"""Largest rise of chi-square for a rounded radius: its 1 % level."""


def with_round_radii(
    chain: Chain, points: MeasuredLine, fit: PlanFit, elements: Sequence[PlanElement], progress: Progress = SILENT
) -> tuple[PlanElement, ...]:
    """Return elements with proposed round radii, and how far the track lies off with all of them."""
    parts = np.flatnonzero(chain.extents[1] > chain.extents[0])
    of_part = [number for number, one in enumerate(elements) if one.type != "clothoid"]
    before = _chi_square(fit, points)
    poses = np.array([(one.x, one.y, one.heading) for one in fit.elements])
    proposed = [round_radius(one, SIGMAS) for one in elements]
    radii = [(int(part), proposed[one]) for part, one in zip(parts, of_part)]
    held = {part: 1.0 / radius for part, radius in radii if radius}
    if not held:
        return tuple(elements)
    try:
        rounded = fit_plan(chain, points, Held(held), progress, poses)
    except FitError:
        return tuple(elements)
    if _chi_square(rounded, points) - before > MOST_RISE * len(held):
        return tuple(elements)
    return tuple(
        _with_round(one, radius, off_element(rounded, points, number)[0])
        for number, (one, radius) in enumerate(zip(elements, proposed))
    )


def _with_round(one: PlanElement, radius: Optional[float], rms_mm: Optional[float]) -> PlanElement:
    """Return an element with a proposal."""
    return replace(one, figures=replace(one.figures, r_round_m=radius, dev_rms_round_mm=rms_mm))


def round_radius(one: PlanElement, sigmas: float) -> Optional[float]:
    """Return the roundest radius of an arc within a number of standard errors, signed; None if there is none."""
    sigma = one.figures.sigma_r_m
    if one.type != "arc" or sigma is None:
        return None
    radius = 1.0 / one.k_from
    for step in STEPS_M:
        rounded = step * round(radius / step)
        if rounded and abs(rounded - radius) <= sigmas * sigma:
            return float(rounded)
    return None


def off_element(fit: PlanFit, points: MeasuredLine, number: int) -> tuple[Optional[float], Optional[float]]:
    """Return the root mean square and the largest deviation of the points of an element, millimetres."""
    one = fit.elements[number]
    first, last = one.s_from if number else -np.inf, one.s_to if number + 1 < len(fit.elements) else np.inf
    rest = 1000.0 * fit.across[(fit.s >= first) & (fit.s < last) & (points.weight > 0)]
    if not len(rest):
        return None, None
    return float(np.sqrt(np.mean(rest**2))), float(rest[np.abs(rest).argmax()])


def _chi_square(fit: PlanFit, points: MeasuredLine) -> float:
    return float(points.weight @ fit.across**2)
