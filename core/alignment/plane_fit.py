"""Final fit in plan: all elements of a track at once, by the distances of the points across.

Each element has a pose at its start (place and direction), a curvature at both ends and a length. Constraints make the
end of an element the start of the next one. The curvature of a clothoid's end is that of the neighbour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Optional

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..progress import SILENT, Progress
from .chain import NOTHING, Chain, Held
from .elements import PANEL_RAD, UNIT_NODES, UNIT_WEIGHTS, PlanElement, displaced, turned

ROUNDS, CLOSED_M, OPEN_M = 40, 1e-6, 1e-5
"""Largest number of steps, the gap between elements and the change at which they end, and the gap beyond which the fit
has failed, metres."""

CLOSING_ROUNDS = 8
"""Largest number of steps that only close gaps."""

STILL_M = 0.0001
"""The fit ends when no place or length changes by more, metres: chi-square hardly shows how long a weak element is, and
a fit that goes on from the table of this one must find the same."""

MOST_RISE = 0.1
"""Rise of chi-square that a step may cause: to close the last gaps costs some."""

GAP_SIGMA_M = 0.001
"""Standard deviation at which gaps count beside the points where a step is judged, metres or radians: a step may be as
long as the gaps stay small that its curvature opens."""

STIFF, STIFFER, LOOSER, STIFFEST = 1e-6, 10.0, 0.3, 100.0
"""Damping after a failed step, its growth after another one, its fall after a good one, and where the fit ends, as
shares of the diagonal."""

MOST_TURN_RAD = 20.0
"""Largest turn of an element: three circles."""

LEAST_M = 1.0
"""Least length of an element, metres: one that the points would make shorter keeps this length."""

SHARE = 0.4
"""Share of its length by which an element may shrink or grow in a step."""

HEADING_CHORD_M = 5.0
"""Half of the chord that gives the first direction of an element, metres."""

NEAR_M = 1.0
"""A given place of an element's start is a first value if it is nearer to the line than this, metres."""

RIDGE = 1e-9
"""Added to the diagonal of the scaled normal matrix, so that an element without points stays where it is."""


@dataclass(frozen=True)
class MeasuredLine:
    """The measured line: `xy`, (n, 2) local metres, and the distance `s` along it, (n,).

    `weight`, (n,), is the inverse of the variance across, 1/m²; 0 where the line bridges a gap.
    """

    xy: np.ndarray
    s: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class PlanFit:
    """Elements that fit the points, with what the fit says about them.

    `across` and `s`, (n,), are the distance of each point from the curve, positive to the left, and its foot, metres.
    `nodes`, (e, 2), is the number of the curvature at start and end of each element; -1 is 0. `jacobian`, (n, u), holds
    the derivatives of `across` with respect to the unknowns (poses, curvatures, lengths), and `solver` is that of the
    equations of the last step.
    """

    elements: tuple[PlanElement, ...]
    across: np.ndarray
    s: np.ndarray
    nodes: np.ndarray
    jacobian: sparse.csr_matrix
    solver: _Solver


@dataclass
class _State:
    """The unknowns: poses (e, 3), curvatures (c,) and lengths (e,), and the numbers of the curvatures (e, 2)."""

    pose: np.ndarray
    bend: np.ndarray
    length: np.ndarray
    nodes: np.ndarray

    @property
    def ends(self) -> np.ndarray:
        """Curvature at start and end of each element, (e, 2)."""
        return np.append(self.bend, 0.0)[self.nodes]

    @property
    def starts(self) -> np.ndarray:
        """Distance along the curve at which each element starts, (e,)."""
        return np.concatenate([[0.0], np.cumsum(self.length[:-1])])


class _Solver:
    """The equations of a step, with the constraints as further unknowns; scaled, so that all units are alike."""

    def __init__(self, normal: sparse.spmatrix, constraints: sparse.spmatrix, ridge: float) -> None:
        diagonal = normal.diagonal()
        self.scale = 1.0 / np.sqrt(np.maximum(diagonal, 1.0))
        scaling = sparse.diags(self.scale)
        a = scaling @ normal @ scaling + ridge * sparse.identity(len(self.scale))
        c = constraints @ scaling
        self.weights = 1.0 / np.sqrt(np.asarray(c.multiply(c).sum(axis=1)).ravel())
        c = sparse.diags(self.weights) @ c
        self.factor = splu(sparse.bmat([[a, c.T], [c, None]], format="csc"))

    def step(self, gradient: np.ndarray, gaps: np.ndarray) -> np.ndarray:
        """Return the change of the unknowns."""
        right = np.concatenate([gradient * self.scale, gaps * self.weights])
        return self.factor.solve(right)[: len(gradient)] * self.scale

    def covariance_rows(self, which: np.ndarray) -> np.ndarray:
        """Return rows of the inverse of the constrained normal matrix, (len(which), u)."""
        right = np.zeros((len(self.weights) + len(self.scale), len(which)))
        right[which, np.arange(len(which))] = self.scale[which]
        return (self.factor.solve(right)[: len(self.scale)] * self.scale[:, None]).T


def fit_plan(
    chain: Chain,
    points: MeasuredLine,
    held: Held = NOTHING,
    progress: Progress = SILENT,
    poses: Optional[np.ndarray] = None,
) -> PlanFit:
    """Fit the elements of a chain, which has the first values, to points; first poses, (e, 3), else are the line's."""
    number = np.where(chain.curved, np.cumsum(chain.curved) - 1, -1)
    bends = chain.bends.copy()
    bends[list(held.bends)] = list(held.bends.values())
    chain = replace(chain, bends=bends)
    numbers = Held({int(number[part]): bend for part, bend in held.bends.items()}, held.starts)
    now = _Look.at(_first_state(chain, points, poses), points, points.s, numbers)
    last = _closed(_settled(now, points, progress), points)
    return PlanFit(_elements(last.state), last.across, last.feet, last.state.nodes, last.jacobian, last.solver(RIDGE))


class FitError(Exception):
    """The elements could not be joined."""


@dataclass(frozen=True)
class _Look:
    """A state with what follows from it: feet, distances across with their derivatives, gaps with theirs."""

    state: _State
    feet: np.ndarray
    across: np.ndarray
    jacobian: sparse.csr_matrix
    constraints: sparse.csr_matrix
    gaps: np.ndarray
    weight: np.ndarray
    held: Held

    @classmethod
    def at(cls, state: _State, points: MeasuredLine, feet: np.ndarray, held: Held) -> _Look:
        seen = _seen(state, points, feet)
        to_the_end = replace(held, starts={**held.starts, len(state.length): float(seen[0][-1])})
        constraints, gaps = _with_held(*_constraints(state), state, to_the_end)
        return cls(state, *seen, constraints, gaps, points.weight, held)

    @property
    def weighted(self) -> sparse.csr_matrix:
        return sparse.diags(self.weight) @ self.jacobian

    @property
    def chi_square(self) -> float:
        return float(self.weight @ self.across**2)

    @property
    def misfit(self) -> float:
        """Chi-square of points and gaps."""
        return self.chi_square + float(np.sum((self.gaps / GAP_SIGMA_M) ** 2))

    @property
    def gap_m(self) -> float:
        """Largest gap between elements, metres or radians."""
        return float(np.abs(self.gaps).max(initial=0.0))

    def solver(self, ridge: float) -> _Solver:
        return _Solver(self.jacobian.T @ self.weighted, self.constraints, ridge)

    def change(self, solver: _Solver) -> np.ndarray:
        """Return the change of the unknowns in a step."""
        return solver.step(-(self.weighted.T @ self.across), -self.gaps)

    def shrinking(self, change: np.ndarray, least_m: float) -> list[int]:
        """Return the numbers of the elements that a step makes shorter than the least length."""
        return np.flatnonzero(_taken(self.state, change)[0].length < least_m).tolist()

    def stepped(self, points: MeasuredLine, solver: _Solver, change: np.ndarray) -> tuple[Optional[_Look], float]:
        """Return the look after a change, None if it makes no sense, and the largest shift.

        Where the change does more harm than good, the gaps are closed that its curvature has opened.
        """
        state, moved = _taken(self.state, change)
        if not _is_sane(state):
            return None, moved
        after = _Look.at(state, points, self.feet, self.held)
        if after.misfit > self.misfit:
            state, _ = _taken(state, solver.step(np.zeros(len(change)), -after.gaps))
            after = _Look.at(state, points, after.feet, self.held) if _is_sane(state) else after
        return after, moved


def _settled(now: _Look, points: MeasuredLine, progress: Progress) -> _Look:
    """Return the look from which no step leads to a better one."""
    ridge = RIDGE
    for _ in range(ROUNDS):
        progress.check()
        solver = now.solver(ridge)
        change = now.change(solver)
        short = [one for one in now.shrinking(change, LEAST_M) if one not in now.held.lengths]
        if short:
            held = replace(now.held, lengths={**now.held.lengths, **dict.fromkeys(short, LEAST_M)})
            now = _Look.at(now.state, points, now.feet, held)
            continue
        after, moved = now.stepped(points, solver, change)
        if after is None or after.misfit > now.misfit + MOST_RISE:
            ridge = max(ridge * STIFFER, STIFF)
            if ridge > STIFFEST:
                break
            continue
        now, ridge = after, max(ridge * LOOSER, RIDGE)
        if now.gap_m < CLOSED_M and moved < STILL_M:
            break
    return now


def _closed(look: _Look, points: MeasuredLine) -> _Look:
    """Return a look in which elements meet, moved no more than that needs."""
    for _ in range(CLOSING_ROUNDS):
        if look.gap_m < CLOSED_M:
            return look
        solver = look.solver(STIFFEST)
        after, _ = look.stepped(points, solver, look.change(solver))
        look = after if after is not None else look
    if look.gap_m > OPEN_M:
        raise FitError
    return look


def _is_sane(state: _State) -> bool:
    """Return whether no element winds up, as those of a failed step do."""
    return bool(np.isfinite(state.pose).all() and (np.abs(state.ends).max(axis=1) * state.length).max() < MOST_TURN_RAD)


def _first_state(chain: Chain, points: MeasuredLine, poses: Optional[np.ndarray]) -> _State:
    """Return poses from the points or as they are given, and curvatures and lengths from the chain."""
    number = np.where(chain.curved, np.cumsum(chain.curved) - 1, -1)
    starts, ends = chain.extents
    rows = []
    for i in range(len(chain.bends)):
        if ends[i] > starts[i]:
            rows.append((starts[i], ends[i], number[i], number[i]))
        if i < len(chain.p) and chain.q[i] > chain.p[i]:
            rows.append((chain.p[i], chain.q[i], number[i], number[i + 1]))
    start, end, *nodes = np.array(rows).T
    pose = _poses_on(points, start)
    if poses is not None:
        near = np.hypot(*(poses - pose)[:, :2].T) < NEAR_M
        pose[near] = poses[near]
    state = _State(pose, chain.bends[np.array(chain.curved)], end - start, np.array(nodes).T.astype(int))
    turns = np.cumsum(0.5 * state.ends.sum(axis=1) * state.length)[:-1]
    expected = pose[0, 2] + np.append(0.0, turns)
    pose[:, 2] += 2.0 * np.pi * np.round((expected - pose[:, 2]) / (2.0 * np.pi))
    return state


def _poses_on(points: MeasuredLine, s: np.ndarray) -> np.ndarray:
    """Return places and directions of the line, (e, 3)."""
    place, behind, ahead = (
        np.column_stack([np.interp(at, points.s, axis) for axis in points.xy.T])
        for at in (s, s - HEADING_CHORD_M, s + HEADING_CHORD_M)
    )
    chord = ahead - behind
    return np.column_stack([place, np.arctan2(chord[:, 1], chord[:, 0])])


def _seen(state: _State, points: MeasuredLine, feet: np.ndarray) -> tuple[np.ndarray, np.ndarray, sparse.csr_matrix]:
    """Return feet, distances across, and the derivatives of these."""
    starts = state.starts
    for _ in range(2):
        at, u, place, heading, bend = _placed(state, starts, feet)
        away = points.xy - place
        ahead = away[:, 0] * np.cos(heading) + away[:, 1] * np.sin(heading)
        across = away[:, 1] * np.cos(heading) - away[:, 0] * np.sin(heading)
        feet = feet + ahead / np.maximum(1.0 - bend * across, 0.5)
    at, u, place, heading, bend = _placed(state, starts, feet)
    normal = np.column_stack([-np.sin(heading), np.cos(heading)])
    across = np.einsum("ij,ij->i", points.xy - place, normal)
    by = _derivatives(state, at, u)
    values = -np.einsum("ikj,ij->ik", by, normal)
    count, bends = len(state.length), len(state.bend)
    rows = np.repeat(np.arange(len(at)), 6)
    numbers = np.column_stack([3 * at, 3 * at + 1, 3 * at + 2, 3 * count + state.nodes[at], 3 * count + bends + at])
    keep = np.column_stack([np.ones((len(at), 3), bool), state.nodes[at] >= 0, np.ones((len(at), 1), bool)]).ravel()
    data = sparse.coo_matrix(
        (values.ravel()[keep], (rows[keep], numbers.ravel()[keep])), shape=(len(at), 4 * count + bends)
    )
    return feet, across, data.tocsr()


def _placed(state: _State, starts: np.ndarray, feet: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return element, distance in it, place, direction and curvature at each foot."""
    at = np.clip(np.searchsorted(starts, feet, side="right") - 1, 0, len(starts) - 1)
    u = feet - starts[at]
    k_from, k_to = state.ends[at].T
    change = (k_to - k_from) / state.length[at]
    place = state.pose[at, :2] + displaced(u, state.pose[at, 2], k_from, change)
    return at, u, place, state.pose[at, 2] + turned(u, k_from, change), k_from + u * change


def _derivatives(state: _State, at: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return derivatives of places: by x, y and direction of the pose, both curvatures and the length, (n, 6, 2)."""
    k_from, k_to = state.ends[at].T
    length = state.length[at]
    change = (k_to - k_from) / length
    made = np.zeros((len(u), 6, 2))
    made[:, 0, 0] = made[:, 1, 1] = 1.0
    panels = int(np.ceil((np.abs(u) * (np.abs(k_from) + np.abs(change * u))).max(initial=0.0) / PANEL_RAD)) or 1
    ends = u[:, None] * np.arange(panels + 1) / panels
    for start, end in zip(ends.T[:-1], ends.T[1:]):
        v = start[:, None] + (end - start)[:, None] * UNIT_NODES
        angle = state.pose[at, 2][:, None] + turned(v, k_from[:, None], change[:, None])
        weights = (end - start)[:, None] * UNIT_WEIGHTS
        half = v * v / (2.0 * length[:, None])
        for axis, normal in enumerate((-np.sin(angle) * weights, np.cos(angle) * weights)):
            by_to = (normal * half).sum(axis=1)
            made[:, 2, axis] += normal.sum(axis=1)
            made[:, 3, axis] += (normal * v).sum(axis=1) - by_to
            made[:, 4, axis] += by_to
            made[:, 5, axis] -= change * by_to
    return made


def _constraints(state: _State) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Return derivatives and values of the gaps between elements, and that the first pose keeps its place along."""
    count, bends = len(state.length), len(state.bend)
    e = np.arange(count - 1)
    k_from, k_to = state.ends[e].T
    length = state.length[e]
    change = (k_to - k_from) / length
    heading = state.pose[e, 2] + turned(length, k_from, change)
    end = np.column_stack([state.pose[e, :2] + displaced(length, state.pose[e, 2], k_from, change), heading])
    by = np.concatenate([_derivatives(state, e, length), np.zeros((len(e), 6, 1))], axis=2)
    by[:, 2, 2] = 1.0
    by[:, 3, 2] = by[:, 4, 2] = 0.5 * length
    by[:, 5, 0] += np.cos(heading)
    by[:, 5, 1] += np.sin(heading)
    by[:, 5, 2] = 0.5 * (k_from + k_to)
    numbers = np.column_stack([3 * e, 3 * e + 1, 3 * e + 2, 3 * count + state.nodes[e], 3 * count + bends + e])
    keep = np.column_stack([np.ones((len(e), 3), bool), state.nodes[e] >= 0, np.ones((len(e), 1), bool)])
    rows, columns, values = [], [], []
    for axis in range(3):
        rows += [np.repeat(3 * e + axis, 6)[keep.ravel()], 3 * e + axis]
        columns += [numbers.ravel()[keep.ravel()], 3 * (e + 1) + axis]
        values += [by[:, :, axis].ravel()[keep.ravel()], np.full(len(e), -1.0)]
    cos, sin = np.cos(state.pose[0, 2]), np.sin(state.pose[0, 2])
    rows.append(np.array([3 * len(e), 3 * len(e)]))
    columns.append(np.array([0, 1]))
    values.append(np.array([cos, sin]))
    gaps = np.append((end - state.pose[1:]).ravel(), 0.0)
    shape = (len(gaps), 4 * count + bends)
    flat = (np.concatenate(rows), np.concatenate(columns))
    return sparse.coo_matrix((np.concatenate(values), flat), shape=shape).tocsr(), gaps


def _with_held(
    constraints: sparse.csr_matrix, gaps: np.ndarray, state: _State, held: Held
) -> tuple[sparse.csr_matrix, np.ndarray]:
    """Add what is held to the constraints; here, curvatures have the numbers of the unknowns."""
    first = 3 * len(state.length)
    rows, more = [constraints], [gaps]
    for number, bend in held.bends.items():
        rows.append(_row(constraints.shape[1], [first + number]))
        more.append(np.array([state.bend[number] - bend]))
    for number, length in held.lengths.items():
        rows.append(_row(constraints.shape[1], [first + len(state.bend) + number]))
        more.append(np.array([state.length[number] - length]))
    for number, start in held.starts.items():
        lengths = first + len(state.bend) + np.arange(number)
        rows.append(_row(constraints.shape[1], lengths))
        more.append(np.array([state.length[:number].sum() - start]))
    return sparse.vstack(rows, format="csr"), np.concatenate(more)


def _row(size: int, columns: Sequence[int] | np.ndarray) -> sparse.csr_matrix:
    """Return a row with ones in some columns."""
    return sparse.csr_matrix((np.ones(len(columns)), (np.zeros(len(columns), int), columns)), shape=(1, size))


def _taken(state: _State, change: np.ndarray) -> tuple[_State, float]:
    """Return the state after a step, and the largest shift of a place or length."""
    count, bends = len(state.length), len(state.bend)
    pose = change[: 3 * count].reshape(-1, 3)
    longer = np.clip(change[3 * count + bends :], -SHARE * state.length, SHARE * state.length)
    bend = state.bend + change[3 * count : 3 * count + bends]
    moved = max(float(np.abs(pose[:, :2]).max()), float(np.abs(longer).max()))
    return _State(state.pose + pose, bend, state.length + longer, state.nodes), moved


def _elements(state: _State) -> tuple[PlanElement, ...]:
    """Return the elements."""
    rows = zip(state.starts, state.length, state.pose, state.ends)
    return tuple(
        PlanElement(float(s), float(length), float(x), float(y), float(heading), float(k_from), float(k_to))
        for s, length, (x, y, heading), (k_from, k_to) in rows
    )
