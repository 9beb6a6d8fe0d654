"""Random designs of tracks, with points that a survey of them would give: for the fit of alignments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.alignment.elements import Alignment, CantElement, VerticalElement, chained
from ..core.frame import LocalFrame


@dataclass(frozen=True)
class Family:
    """The measures of a kind of railway.

    Attributes
    ----------
    radii_m : (float, float)
        Least and largest radius in plan; radii are drawn evenly by their logarithm, and made round.
    fixed_m, ramp_m : (float, float)
        Least and largest length of a line or an arc, and of a clothoid.
    jump_share : float
        Share of joints without a clothoid, as in turnouts.
    vertical_m : (float, float)
        Least and largest radius in height.
    grade_pm : float
        Largest gradient, per mille.
    """

    radii_m: tuple[float, float]
    fixed_m: tuple[float, float]
    ramp_m: tuple[float, float]
    jump_share: float
    vertical_m: tuple[float, float]
    grade_pm: float


FAMILIES = {
    "main line": Family((300.0, 25_000.0), (60.0, 600.0), (30.0, 160.0), 0.05, (5_000.0, 30_000.0), 12.5),
    "branch line": Family((180.0, 1_500.0), (25.0, 250.0), (20.0, 80.0), 0.10, (2_000.0, 10_000.0), 25.0),
    "yard": Family((150.0, 2_000.0), (12.0, 100.0), (12.0, 50.0), 0.40, (1_500.0, 5_000.0), 8.0),
}

LEAST_SHIFT_M = 0.02
"""Least way by which a transition between two curvatures moves the line, L² |k1 - k2| / 24, metres: a shorter clothoid
would not be built. A jump has to turn the line out of its course as far within the length of its neighbours."""

CANT_STEP_M, MAX_CANT_M = 0.005, 0.15
"""Cant is designed in steps, and limited, metres."""

CANT_RADII_M = 1_500.0
"""Curves of larger radius than this times a factor up to 2 have no cant, metres."""


def random_design(random: np.random.Generator, family: Family, count: int = 100) -> Alignment:
    """Return a design of `count` elements in plan, with height and cant.

    Lines and arcs follow each other, joined by clothoids or by a jump of the curvature; some arcs follow an arc of the
    same hand (compound curves) or of the other (S-curves, with one clothoid through the inflection or with two).
    """
    shapes = _plan(random, family, count)
    plan = chained((0.0, 0.0), random.uniform(-np.pi, np.pi), shapes)
    length = plan[-1].s_to
    return Alignment(
        1,
        LocalFrame(np.zeros(3)),
        plan,
        tuple(_heights(random, family, length)),
        tuple(_cants(random, shapes)),
    )


def _plan(random: np.random.Generator, family: Family, count: int) -> list[tuple[float, float, float]]:
    """Return length and curvatures of the elements in plan."""
    before = 0.0
    shapes = [(_length(random, family.fixed_m), 0.0, 0.0)]
    while len(shapes) < count:
        bend = _next_curvature(random, family, before)
        length, ramp = _length(random, family.fixed_m), _length(random, family.ramp_m)
        change = abs(bend - before)
        if random.random() < family.jump_share and change * length**2 / 24 > LEAST_SHIFT_M:
            joint: list[tuple[float, float, float]] = []
        elif change * ramp**2 / 24 < LEAST_SHIFT_M:
            continue
        elif bend * before < 0 and random.random() < 0.3:
            first = ramp * abs(before) / change
            joint = [(first, before, 0.0), (1.3 * (ramp - first), 0.0, bend)]
        else:
            joint = [(ramp, before, bend)]
        shapes += [*joint, (length, bend, bend)]
        before = bend
    return shapes[:count]


def _next_curvature(random: np.random.Generator, family: Family, before: float) -> float:
    """Return the curvature of the next line or arc, which differs from that before."""
    if before and random.random() < 0.6:
        return 0.0
    radius = np.exp(random.uniform(*np.log(family.radii_m)))
    radius = max(5.0 * round(radius / 5.0), family.radii_m[0])
    bend = float(random.choice([-1.0, 1.0])) / radius
    return bend if abs(bend - before) > 0.15 * max(abs(bend), abs(before)) else 0.0


def _length(random: np.random.Generator, limits: tuple[float, float]) -> float:
    return float(np.exp(random.uniform(*np.log(limits))))


def _heights(random: np.random.Generator, family: Family, length: float) -> Iterator[VerticalElement]:
    """Yield grades and the parabolas between them, from end to end."""
    s, z, grade = 0.0, 50.0, random.uniform(-0.5, 0.5) * family.grade_pm / 1000
    while s < length:
        step = min(random.uniform(80.0, 500.0), length - s)
        yield VerticalElement(s, step, z, grade, grade)
        s, z = s + step, z + step * grade
        change = random.uniform(-1.0, 1.0) * family.grade_pm / 1000
        after = float(np.clip(grade + change, -family.grade_pm / 1000, family.grade_pm / 1000))
        curve = abs(after - grade) * np.exp(random.uniform(*np.log(family.vertical_m)))
        if curve < 10.0 or s + curve > length:
            continue
        yield VerticalElement(s, curve, z, grade, after)
        s, z, grade = s + curve, z + 0.5 * curve * (grade + after), after


def _cants(random: np.random.Generator, shapes: list[tuple[float, float, float]]) -> Iterator[CantElement]:
    """Yield constant cant on lines and arcs, ramps on clothoids; a jump of curvature has no cant on either side."""
    has_ramps = [len({1 for near in shapes[max(i - 1, 0) : i + 2] if near[1] != near[2]}) for i in range(len(shapes))]
    values = []
    for (length, start, end), ramps in zip(shapes, has_ramps):
        flat = start != end or not start or not ramps or abs(1 / start) > CANT_RADII_M or length < 20.0
        size = 0.0 if flat else min(CANT_STEP_M * round(6.0 / abs(1 / start) / CANT_STEP_M), MAX_CANT_M)
        values.append(-np.sign(start) * size)
    s = 0.0
    for i, (length, start, end) in enumerate(shapes):
        ends = (values[i - 1] if i else 0.0, values[i + 1] if i + 1 < len(shapes) else 0.0)
        before, after = ends if start != end else (values[i], values[i])
        yield CantElement(s, length, float(before), float(after))
        s += length


def surveyed(
    design: Alignment,
    random: np.random.Generator,
    white_m: float = 0.002,
    misaligned_m: float = 0.0,
    correlation_m: float = 15.0,
    step_m: float = 1.0,
) -> np.ndarray:
    """Return vertices of a line along a design, (n, 3) metres, with errors across and in height.

    Parameters
    ----------
    design : Alignment
    random : Generator
    white_m : float
        Standard deviation of errors that are independent from vertex to vertex, metres.
    misaligned_m, correlation_m : float
        Standard deviation of the misalignment, and the distance at which its correlation has fallen to 1/e, metres.
    step_m : float
        Distance between the vertices.
    """
    s = np.arange(design.s_from, design.s_to + 1e-9, step_m)
    heading = design.headings(s)
    left = np.column_stack([-np.sin(heading), np.cos(heading), np.zeros(len(s))])
    across, up = (
        white_m * random.standard_normal(len(s)) + misaligned_m * _correlated(random, s, correlation_m) for _ in "yz"
    )
    return design.xyz(s) + across[:, None] * left + up[:, None] * [0.0, 0.0, 1.0]


def _correlated(random: np.random.Generator, s: np.ndarray, correlation_m: float) -> np.ndarray:
    """Return smooth noise with standard deviation 1 and a Gaussian correlation along `s`, (n,)."""
    step = s[1] - s[0]
    reach = int(np.ceil(3.0 * correlation_m / step))
    kernel = np.exp(-2.0 * (np.arange(-reach, reach + 1) * step / correlation_m) ** 2)
    raw = np.convolve(random.standard_normal(len(s) + 2 * reach), kernel, mode="valid")
    return raw / np.sqrt(np.sum(kernel**2))
