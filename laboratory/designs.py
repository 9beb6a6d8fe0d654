"""Random designs of tracks, with points that a survey of them would give: for the fit of alignments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from ..core.alignment.elements import Alignment, CantElement, VerticalElement, chained
from ..core.alignment.layouts import noted
from ..core.alignment.measured import Track
from ..core.frame import LocalFrame
from ..core.parameters import CLOTHOIDS, FitParameters


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

CANT_NOISE_M = 0.0004
"""Standard deviation of a measured cant, metres."""

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

    `white_m` is the standard deviation of errors that are independent from vertex to vertex, `misaligned_m` that of the
    misalignment, whose correlation falls to 1/e over `correlation_m`.
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


def with_cant(design: Alignment, line: np.ndarray, random: np.random.Generator) -> Track:
    """Return a line that was surveyed every metre, (n, 3), as a track with its measured cant."""
    s = np.arange(len(line), dtype=float)
    cant = np.column_stack([s, design.cants(s) + CANT_NOISE_M * random.standard_normal(len(s))])
    return Track(1, line, cant, np.zeros(len(line), dtype=bool))


@dataclass(frozen=True)
class TrackScene:
    """A design, the track that was measured of it, and how it is fitted; elements of `fixed` have given types."""

    design: Alignment
    track: Track
    settings: FitParameters = FitParameters()
    fixed: Optional[Alignment] = None


def scene(seed: int, family: str, count: int = 16, **errors: float) -> TrackScene:
    """Return a random design of `count` elements, surveyed with errors; see `surveyed`."""
    random = np.random.default_rng(seed)
    design = random_design(random, FAMILIES[family], count)
    return TrackScene(design, with_cant(design, surveyed(design, random, **errors), random))


def with_clothoids(seed: int) -> TrackScene:
    """Return a yard in whose alignment the curvature may not jump."""
    return replace(scene(seed, "yard", 12), settings=FitParameters(transitions=CLOTHOIDS))


def with_given(seed: int) -> TrackScene:
    """Return a main line whose fit is given the types of the true elements."""
    one = scene(seed, "main line")
    return replace(one, fixed=replace(one.design, plan=tuple(map(noted, one.design.plan))))


def with_gap(seed: int) -> TrackScene:
    """Return a branch line with a bridged gap of 60 m, over which the line is straight."""
    one = scene(seed, "branch line")
    line, bridged = one.track.xyz.copy(), one.track.is_bridged.copy()
    first = len(line) // 3
    line[first : first + 61] = np.linspace(line[first], line[first + 60], 61)
    bridged[first : first + 61] = True
    return replace(one, track=replace(one.track, xyz=line, is_bridged=bridged))


def with_strays(seed: int) -> TrackScene:
    """Return a branch line with stray vertices: its last three, and single ones every 70 m."""
    one = scene(seed, "branch line")
    line = one.track.xyz.copy()
    line[35::70, 1] += 0.08
    line[-3:, 1] += [0.1, 0.2, 0.4]
    return replace(one, track=replace(one.track, xyz=line))


def thinned(one: TrackScene, step: int) -> TrackScene:
    """Return a scene with every `step`-th vertex only, and the last."""
    kept = np.unique(np.append(np.arange(0, len(one.track.xyz), step), len(one.track.xyz) - 1))
    return replace(one, track=replace(one.track, xyz=one.track.xyz[kept], is_bridged=one.track.is_bridged[kept]))


TRACKS: dict[str, Callable[[int], TrackScene]] = {
    "main line": lambda seed: scene(seed, "main line"),
    "branch line": lambda seed: scene(seed, "branch line"),
    "yard": lambda seed: scene(seed, "yard"),
    "misaligned": lambda seed: scene(seed, "branch line", white_m=0.001, misaligned_m=0.003),
    "rough": lambda seed: scene(seed, "main line", white_m=0.001, misaligned_m=0.005, correlation_m=8.0),
    "smoothed": lambda seed: thinned(
        scene(seed, "branch line", white_m=0.00003, misaligned_m=0.0006, correlation_m=12.0), 3
    ),
    "few vertices": lambda seed: thinned(scene(seed, "main line"), 10),
    "clothoids": with_clothoids,
    "given": with_given,
    "gap": with_gap,
    "strays": with_strays,
}
"""Scenes by name, made from a seed, each for a kind of railway, of error or of request."""
