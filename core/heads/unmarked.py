"""Strips that points do not state: passes of a scanner whose heads are on several levels, the same along all lines.

The registration of each pass is in error by a vector of its own. Where passes differ in height by more than the noise,
the crowns of all heads are on the same few levels above each other; nothing else in a railway is. See docs/method.md
section 6.6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from ..clouds.points import RailPoints
from ..polyline import Polyline, interpolate
from .head_points import MIN_ON_HEAD, HeadPoints, Widths, near_lines
from .level import AXIS_SHARE, MIN_NOISE_M, PRIOR_SLOPE
from .outline import Blurred, Grid, Outline
from .strips import STEP_M, UNKNOWN, Shown

MAX_LEVELS = 4
"""Most levels that are looked for."""

START_NOISE_M = 0.01
"""Noise at the start: it holds what passes differ by, so that one level alone is between them."""

ENOUGH_ON_CROWNS = 20_000
"""Points that the search for levels needs at most: each line keeps the same share of its points."""

SEPARATE_SIGMAS = 2.9
"""Least distance of two levels in standard deviations of the noise: 93 % of the points are on the nearer one then.
Levels three of these apart are told although the noise found is a few per cent too large."""

LEAST_GAIN = 0.03
"""Least gain of the mean logarithm of the likelihood of a point from one more level: half of what two equal levels at
the least distance give."""

LEAST_SHARE = 0.1
"""Least share of the points on each level: other surfaces beside the crown have less."""

AGREED_SHARE = 0.125
"""Largest distance of a level of one line from that of all, as a share of the least distance of levels."""

COURSE_SIGMA_STEPS = 2.0
"""Standard deviation of the windows, in stations, in which the level and the slope of a head are averaged."""

STRAY_SHARES, STRAY_M = (0.005, 0.5), 0.1
"""Limits of the share of points on no level, and height over which they are spread."""

ROUNDS, SETTLED = 40, 1e-3
"""Most rounds of expectation maximization, and change of the mean logarithm of the likelihood at which it ends."""

MATCHES, BLUR_M = 16, 0.005
"""Rounds in which heads are moved across onto their points, and the least blur of the first half of them: edges that
are further apart than the noise draw each other only if they are blurred."""

MAX_MOVE_M = 0.004
"""Farthest that a head is moved in a round."""

APART_M, MIDDLE_M = 0.02, 0.005
"""Standard deviation of what passes are apart, and of the middle that crowns show of a section."""

VIEW_M = 20.0
"""Length of the sections of lines in which heads are compared with their outline."""


@dataclass(frozen=True)
class _Course:
    """Level of a head and its slope across at stations `STEP_M` apart, above a polynomial along the line."""

    trend: np.ndarray
    level: np.ndarray
    slope: np.ndarray

    def above(self, points: HeadPoints) -> np.ndarray:
        """Return the heights of points above the mean of the levels, without the slope across."""
        at, t = (np.arange(len(self.level)) + 0.5) * STEP_M, points.t
        level, slope = np.interp(t, at, self.level), np.interp(t, at, self.slope)
        return points.z - np.polyval(self.trend, t / points.length_m) - level - slope * points.across


@dataclass(frozen=True)
class _Levels:
    """Levels of all heads, (k,) metres above the course of each line, and shares of the points on them.

    Of each line, `likelihood` is the mean logarithm of the likelihood of its points, and `own_m` and `own_shares`,
    (l, k), are the levels and the shares that it shows by itself.
    """

    up_m: np.ndarray
    shares: np.ndarray
    noise_m: float
    courses: tuple[_Course, ...]
    likelihood: np.ndarray
    own_m: np.ndarray
    own_shares: np.ndarray

    @property
    def apart_m(self) -> float:
        """Least distance of two levels."""
        return float(np.diff(np.sort(self.up_m)).min())

    @property
    def are_separate(self) -> bool:
        """Whether points can be given to the nearest level."""
        return self.apart_m >= SEPARATE_SIGMAS * self.noise_m and bool(self.shares.min() >= LEAST_SHARE)

    @property
    def agree(self) -> np.ndarray:
        """Which lines show all levels where the others do, (l,) bool."""
        off_m = np.abs(self.own_m - self.up_m).max(axis=1)
        return (off_m <= AGREED_SHARE * self.apart_m) & (self.own_shares.min(axis=1) >= LEAST_SHARE)


def told_apart(points: RailPoints, lines: Sequence[np.ndarray], widths: Widths) -> RailPoints:
    """Return points with the strips that the levels of heads show, if the points state none, and else as they are.

    Lines, (k, 2) each, are within 3 cm of their rails. Points that tell no strip are of strip `UNKNOWN`.
    """
    if points.strips is not None or not lines:
        return points
    near = near_lines(lines, replace(points, strips=np.arange(len(points.xyz)), blunt=False), widths)
    near = [head for head in near if head.within(AXIS_SHARE).sum() >= MIN_ON_HEAD]
    crowns = [head[head.within(AXIS_SHARE)] for head in near]
    every = max(sum(len(crown.t) for crown in crowns) // ENOUGH_ON_CROWNS, 1)
    levels = _find_levels([crown[np.arange(len(crown.t)) % every == 0] for crown in crowns])
    if levels is None:
        return points
    order = np.argsort(levels.up_m)
    levels = replace(levels, up_m=levels.up_m[order], shares=levels.shares[order])
    views = [view for head, course in zip(near, levels.courses) for view in _views(head, course, levels)]
    apart_m = _apart(views, levels)
    strips, passes = _strips_of(views, apart_m, levels, len(points.xyz))
    apart = np.column_stack([apart_m, levels.up_m])
    apart = np.column_stack([apart - passes @ apart / passes.sum(), passes])
    return replace(points, strips=strips, apart=apart, blunt=False)


def _strips_of(
    views: Sequence[_View], apart_m: np.ndarray, levels: _Levels, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the strip of each point, (n,) from 1, and the number of passes of each strip, (k,).

    It is unknown which pass shows a section alone. A level with twice or three times as many points on crowns as
    another is of as many passes; a face is on all levels.
    """
    strips, best = np.full(count, UNKNOWN), np.zeros(count)
    counts = np.zeros(len(levels.up_m))
    for view in views:
        own, density = view.nearest(apart_m, levels)
        on_each = np.bincount(own[own != UNKNOWN], minlength=len(counts))
        shown = on_each > LEAST_SHARE * on_each.sum()
        better = (shown.sum() > 1) & (density > best[view.numbers])
        strips[view.numbers[better]] = np.where(own == UNKNOWN, UNKNOWN, own + 1)[better]
        best[view.numbers[better]] = density[better]
        counts += view.on_crowns(own, apart_m) * shown.all()
    numbers = np.arange(1, MAX_LEVELS)
    ratio = counts / max(counts.min(), 1.0)
    return strips, numbers[np.argmin(np.abs(np.log(numbers / ratio.clip(1.0)[:, None])), axis=1)]


def _find_levels(crowns: Sequence[HeadPoints]) -> _Levels | None:
    """Find the levels on which crowns are; None if they are on one, or if a single line decides it."""
    if len(crowns) < 2:
        return None
    count = np.array([len(crown.t) for crown in crowns])
    found = _fit(crowns, np.zeros(1), START_NOISE_M)
    several = None
    for _ in range(MAX_LEVELS - 1):
        apart_m = found.noise_m * np.array([-1.0, 1.0])
        tried = [
            _fit(crowns, np.append(np.delete(found.up_m, number), up_m + apart_m), found.noise_m / 2)
            for number, up_m in enumerate(found.up_m)
        ]
        more = max(tried, key=lambda one: float(count @ one.likelihood))
        gain = more.likelihood - found.likelihood
        shown = count[(gain > LEAST_GAIN) & more.agree]
        # Two rails at least: one alone may have another surface beside its crown.
        if not more.are_separate or len(shown) < 2 or shown.sum() < 0.5 * count.sum():
            break
        several = found = more
    return several


def _fit(crowns: Sequence[HeadPoints], up_m: np.ndarray, noise_m: float) -> _Levels:
    """Find levels, noise and the course of each line by expectation maximization from a start."""
    up_m, shares, stray = up_m - up_m.mean(), np.full(len(up_m), 1 / len(up_m)), STRAY_SHARES[0]
    courses = [
        _course(crown, _trend(crown), np.zeros(len(crown.t)), np.ones(len(crown.t)), noise_m) for crown in crowns
    ]
    likelihood, own_shares = np.full(len(crowns), -np.inf), np.zeros((len(crowns), len(up_m)))
    own_m = np.zeros_like(own_shares)
    for _ in range(ROUNDS):
        before = likelihood.copy()
        weight, sums, squares, count = np.zeros(len(up_m)), np.zeros(len(up_m)), 0.0, 0
        for number, crown in enumerate(crowns):
            on = _on_levels(courses[number].above(crown), up_m, shares, noise_m, stray)
            likelihood[number] = np.mean(np.log(on.sum(axis=0) + stray / STRAY_M))
            on /= on.sum(axis=0) + stray / STRAY_M
            whole = on.sum(axis=0)
            level_m = (on * up_m[:, None]).sum(axis=0) / np.maximum(whole, 1e-9)
            courses[number] = _course(crown, courses[number].trend, level_m, whole, noise_m)
            above, on_each = courses[number].above(crown), on.sum(axis=1)
            own_m[number], own_shares[number] = on @ above / np.maximum(on_each, 1e-9), on_each / len(above)
            weight, sums = weight + on_each, sums + on @ above
            squares += float((on * (above - up_m[:, None]) ** 2).sum())
            count += len(above)
        shares = weight / weight.sum()
        up_m = sums / np.maximum(weight, 1e-9)
        own_m, up_m = own_m - shares @ up_m, up_m - shares @ up_m
        noise_m = max(np.sqrt(squares / weight.sum()), MIN_NOISE_M)
        stray = float(np.clip(1 - weight.sum() / count, *STRAY_SHARES))
        if np.abs(likelihood - before).max() < SETTLED:
            break
    return _Levels(up_m, shares, noise_m, tuple(courses), likelihood, own_m, own_shares)


def _on_levels(above: np.ndarray, up_m: np.ndarray, shares: np.ndarray, noise_m: float, stray: float) -> np.ndarray:
    """Return the densities of heights, (n,), on each level, (k, n), per metre."""
    off = (above - up_m[:, None]) / noise_m
    return (1 - stray) * shares[:, None] * np.exp(-0.5 * off**2) / (np.sqrt(2 * np.pi) * noise_m)


def _trend(crown: HeadPoints) -> np.ndarray:
    """Fit a cubic to the heights along a line: it takes the grade away."""
    return np.polyfit(crown.t / crown.length_m, crown.z, 3)


def _course(crown: HeadPoints, trend: np.ndarray, own_m: np.ndarray, weight: np.ndarray, noise_m: float) -> _Course:
    """Average level and slope of a head in windows, given the level that each point is on, (n,), and its weight."""
    count = max(int(np.ceil(crown.length_m / STEP_M)), 1)
    step = np.minimum((crown.t / STEP_M).astype(int), count - 1)
    x, y = crown.across, crown.z - np.polyval(trend, crown.t / crown.length_m) - own_m
    sums = np.array([np.bincount(step, weight * one, count) for one in (np.ones_like(x), x, y, x * x, x * y)])
    n, sx, sy, xx, xy = gaussian_filter1d(sums, COURSE_SIGMA_STEPS, axis=1, mode="nearest")
    n = np.maximum(n, 1e-9)
    slope = (xy - sx * sy / n) / (xx - sx**2 / n + (noise_m / PRIOR_SLOPE) ** 2)
    return _Course(trend, (sy - slope * sx) / n, slope)


class _View:
    """A section of a line: its points counted in bins around the head, and where the head of each level is in them."""

    def __init__(self, head: HeadPoints, above: np.ndarray, levels: _Levels, middles_m: np.ndarray) -> None:
        self.numbers, count = np.asarray(head.strips), len(levels.up_m)
        line = Polyline(head.line)
        self.normal = interpolate(line.normals, line.t, np.array([head.t.mean()]))[0]
        self.middles_m = middles_m
        known = middles_m[np.isfinite(middles_m)]
        self.middle_m = float(known.mean()) if len(known) else 0.0
        self.grid, self.outline = Grid.of(head.width_m), Outline.of(head.width_m)
        self.across, self.crown_m = head.across - self.middle_m, AXIS_SHARE * head.width_m
        self.bins = self.grid.number(self.across, above)
        self.counts = np.bincount(self.bins[self.bins >= 0], minlength=self.grid.size).astype(float)
        self.off_m = 0.0
        parts = len(self.outline.parts) + 1
        self.shares = np.full((count, parts), 1 / (count * parts))

    def heads(self, apart_m: np.ndarray, levels: _Levels, noise_m: float) -> list[Blurred]:
        """Put the head of each level at its place."""
        blur = np.log(noise_m)
        return [
            Blurred.at(np.array([self.off_m + left_m, up_m, 0.0, 0.0, blur, blur, 0.0]), self.outline, self.grid)
            for left_m, up_m in zip(apart_m @ self.normal, levels.up_m)
        ]

    def pull(self, apart_m: np.ndarray, levels: _Levels, noise_m: float) -> tuple[np.ndarray, np.ndarray]:
        """Return how far points pull the head of each level to the left, and how sure they are, (k,) each.

        The section follows what pulls all heads, and the shares of their parts follow the points.
        """
        heads = self.heads(apart_m, levels, noise_m)
        density = sum(one.density(own) for one, own in zip(heads, self.shares))
        ratio = self.counts / np.maximum(density, 1e-12)
        scores = np.array([one.by_place(own)[0] for one, own in zip(heads, self.shares)])
        gradient, information = scores @ ratio, scores**2 @ (ratio / np.maximum(density, 1e-12))
        self.off_m += float(np.clip(gradient.sum() / max(information.sum(), 1.0), -MAX_MOVE_M, MAX_MOVE_M))
        self.shares = np.array([own * (one.parts @ ratio) for one, own in zip(heads, self.shares)])
        self.shares /= self.shares.sum()
        return gradient, information

    def nearest(self, apart_m: np.ndarray, levels: _Levels) -> tuple[np.ndarray, np.ndarray]:
        """Return the likeliest level of each point, and the density of its head there, (n,) each."""
        heads = self.heads(apart_m, levels, levels.noise_m)
        densities = np.array([own[:-1] @ one.parts[:-1] for one, own in zip(heads, self.shares)])
        own = np.where(
            densities.max(axis=0) > self.shares[:, -1].sum() / self.grid.size, densities.argmax(axis=0), UNKNOWN
        )
        inside = self.bins >= 0
        return np.where(inside, own[self.bins], UNKNOWN), np.where(inside, densities.max(axis=0)[self.bins], 0.0)

    def on_crowns(self, own: np.ndarray, apart_m: np.ndarray) -> np.ndarray:
        """Count the points near the axis of the head of each level, (k,), given the level of each point, (n,)."""
        axes_m = self.off_m + apart_m @ self.normal
        near = (own != UNKNOWN) & (np.abs(self.across - axes_m[own]) < self.crown_m)
        return np.bincount(own[near], minlength=len(axes_m))


def _views(head: HeadPoints, course: _Course, levels: _Levels) -> Iterator[_View]:
    """Divide a line into sections, with the middles of the heads that the crowns show."""
    above = course.above(head)
    off_m = np.abs(above - levels.up_m[:, None])
    own = np.where(off_m.min(axis=0) < SEPARATE_SIGMAS * levels.noise_m, np.argmin(off_m, axis=0), UNKNOWN)
    shown = [Shown.by(head[own == number]) for number in range(len(levels.up_m))]
    nothing = np.full(len(course.level), np.nan)
    across = np.array([nothing if one is None else one.across for one in shown])
    at = (np.arange(len(course.level)) + 0.5) * STEP_M
    count = max(int(round(head.length_m / VIEW_M)), 1)
    ends = np.linspace(0, head.length_m, count + 1)
    for start, end in zip(ends[:-1], ends[1:]):
        mine, here = (head.t >= start) & (head.t < end), (at >= start) & (at < end)
        if np.count_nonzero(mine) >= MIN_ON_HEAD:
            seen = here & np.isfinite(across).all(axis=0)
            middles = across[:, seen].mean(axis=1) if seen.any() else np.full(len(across), np.nan)
            yield _View(head[mine], above[mine], levels, middles)


def _apart(views: Sequence[_View], levels: _Levels) -> np.ndarray:
    """Find by how much the passes are apart in plan, (k, 2) metres, the same for all lines."""
    weights = levels.shares
    normals = np.array([view.normal for view in views])
    middles = np.array([view.middles_m for view in views])
    seen = np.isfinite(middles).all(axis=1)
    off_m = middles[seen] - (middles[seen] @ weights)[:, None]
    known = normals[seen].T @ normals[seen] + (MIDDLE_M / APART_M) ** 2 * np.eye(2)
    apart_m = np.linalg.solve(known, normals[seen].T @ off_m).T
    for number in range(MATCHES):
        noise_m = max(levels.noise_m, BLUR_M) if number < MATCHES // 2 else levels.noise_m
        pulls = [view.pull(apart_m, levels, noise_m) for view in views]
        gradient, information = (np.array(one) for one in zip(*pulls))
        for level in range(len(apart_m)):
            known = (normals * information[:, level, None]).T @ normals + np.eye(2) / APART_M**2
            move_m = np.linalg.solve(known, gradient[:, level] @ normals - apart_m[level] / APART_M**2)
            apart_m[level] += move_m * min(1.0, MAX_MOVE_M / max(np.hypot(*move_m), 1e-9))
        apart_m -= weights @ apart_m
    return apart_m
