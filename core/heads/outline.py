"""The outline of a railhead in the points of a section: where it lies, and which parts of it the scanner sees.

A scanner to one side sees one face of a head and the corner above it, whose points pile up at that edge: whatever looks
at offsets alone moves towards the scanner. Offset and height together show which part of the outline a point may be
from. See docs/method.md section 6.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

CROWN_RADIUS_M = 0.300
"""Radius of the running surface: 300 mm on 60E1. With 254 mm, as on American rails, it falls by 0.2 mm more."""

CORNER_RADIUS_M = 0.013
"""Radius of the corners in EN 13674-1; 9.5 to 14.3 mm on American rails."""

FACE_DEPTH_M = 0.0375
"""Depth of the lower end of the faces below the top: that of 60E1 (EN 13674-1). Points further down than the model's
face draw the axis towards the scanner, 0.7 mm where they reach 2.5 mm further; a face that ends sooner does not."""

WEB_HALF_M, WEB_FROM_M, WEB_TO_M = 0.008, 0.048, 0.1
"""Half the thickness of the web, which is 16.5 mm on 60E1, and depths below the top of its upper end and of what is
used of it: the underside of the head, which no scanner above the rail sees, meets it 10 mm below the faces."""

FACE_TURN = np.pi / 4
"""Angle between the axis and the normal of the surface from which a classification may leave the surface out."""

RAYS_DEG, RAY_M = (12.0, 25.0, 45.0, 65.0), 0.06
"""Angles above the horizontal from which a beam may meet both the far edge of a head and what is behind it, whose
distance is then in between; and length of the line of sight behind the edge on which such points are. A scanner on
the track itself sees the nearest edges at 70°."""

SAMPLE_M = 0.002
"""Largest distance between samples of the outline: finer than the noise of any cloud."""

VIEWS_DEG = (5.0, 12.0, 22.0, 40.0, 90.0, 140.0, 158.0, 168.0, 175.0)
"""Angles of view above the horizontal on the right; scanners and passes may see a head from several."""

FACES = slice(len(VIEWS_DEG), len(VIEWS_DEG) + 6)
"""Parts of the outline that are its lower corners and its faces, in two halves, on either side; see `Outline`."""

BIN_M = 0.002
"""Side of the bins in which points are counted."""

BESIDE_M, ABOVE_M, BELOW_M = 0.024, 0.024, 0.046
"""Reach of the bins beyond the edges, above the top and below it: three standard deviations of noise of 8 mm. With
16 mm above the top, such noise would lower it."""

MIN_STRAY_SHARE = 0.02
"""Smallest share of points that are on no part of the outline: it limits how far a single one can pull."""

START_NOISE_M, MIN_NOISE_M = 0.005, 0.001
"""Noise at the start of a fit, and the least that a scanner has."""

LEAN_SIGMA = 0.06
"""Expected error of the slope across from `level.cross_slope`, which side faces turn by up to 0.1."""

NOISE_RATIO_SIGMA = 0.3
"""Expected logarithm of the ratio of the noise across and in height."""

WIDTH_SIGMA_M = 0.0005
"""Expected error of the head width: half of what tables differ by, because most agree."""

BEND_SIGMA = 0.25 / CROWN_RADIUS_M
"""Expected error of the bend of the crown, 1/m: half of that of a new one, because worn crowns are flatter."""

MAX_STEPS = np.array([0.004, 0.004, 0.1, 0.002, 0.3, 0.3, 1.0])
"""Largest changes of the place in a round: metres, metres, slope, metres, logarithms of the noise, and 1/m."""

PLACE = len(MAX_STEPS)
"""Number of the unknowns of the place."""

MAX_ROUNDS, SETTLED = 40, 0.1
"""Largest number of rounds of a fit, and the gain of the log-likelihood from which it goes on; most need ten."""

RIDGE = np.array([400.0, 400.0, 1.0, 1.0, 0.1, 0.1, 0.0])
"""Information about the place that is always there, as of 5 cm and of a factor of 20 in the noise: drawn or computed
points, which are all in a few bins, may say nothing about some of it."""

STEP_PARTS = (1.0, 1 / 3, 1 / 9)
"""Parts of a step that are tried until the likelihood rises."""

MIN_SHARE_LEFT = 0.3
"""Part of its share that a part keeps in a step."""

WRONG_WIDTH_SIGMAS = 8.0
"""Error of the head width, in standard errors, from which it is rather taken for wrong, and the points decide alone."""

USED_SHARE = 2e-3
"""Parts with a smaller share of the points do not count among the unknowns."""

SHARE_RIDGE = 0.02
"""Weight of the shares of the last round in the next, relative to that of the points: views next to each other look
alike."""

SHARE_DOUBT = 2e-5
"""The same where the error of a section is estimated: nothing is known of the shares before."""


@dataclass(frozen=True)
class Outline:
    """The outline of a head, and the parts of it that have a share of the points each.

    Samples, (j,), are `left` of the axis and `up` above the top, metres. `widening` is how far each moves to the left
    if the head is a metre wider, `falling` how far it falls per bend of the crown, m². `parts`, (k, j), are the points
    of each part by sample; rows sum to 1. The first parts are what is seen of the crown and the upper corners from each
    view. Those of `FACES` are the lower corners and the faces, which classifications may leave out. The last ones are
    lines of sight behind either edge, which are on no part of the head, and the sides of the web, if it is asked for.
    """

    left: np.ndarray
    up: np.ndarray
    widening: np.ndarray
    falling: np.ndarray
    parts: np.ndarray

    @classmethod
    def of(cls, head_width_m: float, rays_deg: Sequence[float] = RAYS_DEG, web: bool = False) -> Outline:
        """Sample the outline of a head, or with its `web` as the last parts.

        Rays at equal angles meet a surface in proportion to how it faces them.
        """
        half = 0.5 * head_width_m
        inner, reach = half - CORNER_RADIUS_M, CROWN_RADIUS_M - CORNER_RADIUS_M
        shoulder = np.arcsin(inner / reach)
        drop = CROWN_RADIUS_M - reach * np.cos(shoulder)
        middle = 0.5 * (drop + FACE_DEPTH_M)
        turn, size = _samples(-shoulder, shoulder, CROWN_RADIUS_M)
        pieces = [(CROWN_RADIUS_M * np.sin(turn), CROWN_RADIUS_M * (np.cos(turn) - 1), turn, size)]
        for side in (-1, 1):
            for first, last in ((shoulder, FACE_TURN), (FACE_TURN, np.pi / 2)):
                turn, size = _samples(first, last, CORNER_RADIUS_M)
                left = side * (inner + CORNER_RADIUS_M * np.sin(turn))
                pieces.append((left, CORNER_RADIUS_M * np.cos(turn) - drop, side * turn, size))
            for first, last in ((drop, middle), (middle, FACE_DEPTH_M)):
                down, size = _samples(first, last, 1.0)
                level = np.full(len(down), side * 0.5 * np.pi)
                pieces.append((np.full(len(down), side * half), -down, level, size))
        rays = [_behind(side, np.radians(ray), inner, drop) for side in (-1, 1) for ray in rays_deg]
        rays += [_web(side) for side in (-1, 1)] if web else []
        left, up, turn, size = (np.concatenate(column) for column in zip(*pieces, *rays))
        number = np.repeat(np.arange(len(pieces) + len(rays)), [len(piece[0]) for piece in pieces + rays])
        seen = np.sin(np.radians(VIEWS_DEG)[:, None] + turn) * size
        open_parts = np.where(np.abs(turn) < FACE_TURN, np.maximum(seen, 0), 0)
        others = (2, 3, 4, 6, 7, 8, *range(len(pieces), len(pieces) + len(rays)))
        parts = np.concatenate([open_parts, [np.where(number == piece, size, 0) for piece in others]])
        crown = np.clip(left, -inner, inner)
        return cls(left, up, crown / (2 * inner), crown**2, parts / parts.sum(axis=1, keepdims=True))


def _behind(side: int, ray: float, inner: float, drop: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Sample a line of sight from where it touches the corner on one side.

    Returns offsets to the left and heights of the samples, angles of a surface that is on no crown, and lengths.
    """
    away, step = _samples(0.0, RAY_M, 0.5)
    left = inner + CORNER_RADIUS_M * np.sin(ray) + away * np.cos(ray)
    up = CORNER_RADIUS_M * np.cos(ray) - drop - away * np.sin(ray)
    return side * left, up, np.full(len(away), side * 0.5 * np.pi), step


def _web(side: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Sample one side of the web; see `_behind`."""
    down, size = _samples(WEB_FROM_M, WEB_TO_M, 1.0)
    return np.full(len(down), side * WEB_HALF_M), -down, np.full(len(down), side * 0.5 * np.pi), size


def _samples(first: float, last: float, metres: float) -> tuple[np.ndarray, np.ndarray]:
    """Divide a range into equal pieces: their middles and their lengths in metres."""
    borders = np.linspace(first, last, max(int(np.ceil((last - first) * metres / SAMPLE_M)), 2) + 1)
    return 0.5 * (borders[1:] + borders[:-1]), np.diff(borders) * metres


@dataclass(frozen=True)
class Grid:
    """Bins across and in height around a head, by their middles, metres."""

    left: np.ndarray
    up: np.ndarray

    @classmethod
    def of(cls, head_width_m: float, below_m: float = BELOW_M) -> Grid:
        """Lay out the bins for a head, `below_m` deep."""
        reach = 0.5 * head_width_m + BESIDE_M
        return cls(_bins(-reach, reach), _bins(-below_m, ABOVE_M))

    def number(self, left: np.ndarray, up: np.ndarray) -> np.ndarray:
        """Return the number of the bin of each point, (n,), and -1 for those outside."""
        column = np.floor((left - self.left[0]) / BIN_M + 0.5)
        row = np.floor((up - self.up[0]) / BIN_M + 0.5)
        inside = (column >= 0) & (column < len(self.left)) & (row >= 0) & (row < len(self.up))
        return np.where(inside, column * len(self.up) + row, -1.0).astype(int)

    @property
    def size(self) -> int:
        """Number of bins."""
        return len(self.left) * len(self.up)


def _bins(first: float, last: float) -> np.ndarray:
    """Return the middles of the bins of a range."""
    return first + BIN_M * (np.arange(int(round((last - first) / BIN_M))) + 0.5)


@dataclass(frozen=True)
class Section:
    """The head in one section of a line.

    `place`, (7,), has the offset of the axis to the left, height of the top, slope across, excess of the head width,
    the logarithms of the noise across and in height, and the excess of the bend of the crown, 1/m; lengths in metres.
    `shares`, (k + 1,), are the shares of the points of each part, and of those on none.
    """

    place: np.ndarray
    shares: np.ndarray

    @property
    def noise_m(self) -> np.ndarray:
        """Noise across and in height, (2,) metres."""
        return np.exp(self.place[4:6])


@dataclass(frozen=True)
class Blurred:
    """An outline at a place, blurred by noise across and in height, (2,) metres.

    `across`, (x, j), and `height`, (j, y), are the densities of each sample in the bins; `off` and `above`, of the same
    shapes, are the distances of the bins from each sample in standard deviations of the noise. `parts`, (k + 1, b), is
    the density of each part by bin, and of strays.
    """

    outline: Outline
    across: np.ndarray
    height: np.ndarray
    off: np.ndarray
    above: np.ndarray
    noise: np.ndarray
    parts: np.ndarray

    @classmethod
    def at(cls, place: np.ndarray, outline: Outline, grid: Grid) -> Blurred:
        """Put the outline at a place and blur it."""
        left, up, lean, wider, *_, bend = place
        noise = np.exp(place[4:6])
        off = (grid.left[:, None] - left - outline.left - wider * outline.widening + lean * outline.up) / noise[0]
        above = (grid.up - (up + outline.up + lean * outline.left - bend * outline.falling)[:, None]) / noise[1]
        across = np.exp(-0.5 * off**2) * (BIN_M / (noise[0] * np.sqrt(2 * np.pi)))
        height = np.exp(-0.5 * above**2) * (BIN_M / (noise[1] * np.sqrt(2 * np.pi)))
        parts = np.full((len(outline.parts) + 1, grid.size), 1 / grid.size)
        parts[:-1] = ((across * outline.parts[:, None, :]) @ height).reshape(len(outline.parts), -1)
        return cls(outline, across, height, off, above, noise, parts)

    def density(self, shares: np.ndarray) -> np.ndarray:
        """Return the density of points in each bin, (b,), given the shares of the parts."""
        return shares @ self.parts

    def by_place(self, shares: np.ndarray) -> np.ndarray:
        """Return the derivatives of the density with respect to the place, (7, b)."""
        across = self.across * (shares[:-1] @ self.outline.parts)
        moved, lifted = across * self.off / self.noise[0], self.height * self.above / self.noise[1]
        derivatives = (
            moved @ self.height,
            across @ lifted,
            (across * self.outline.left) @ lifted - (moved * self.outline.up) @ self.height,
            (moved * self.outline.widening) @ self.height,
            (across * (self.off**2 - 1)) @ self.height,
            across @ (self.height * (self.above**2 - 1)),
            -(across * self.outline.falling) @ lifted,
        )
        return np.array(derivatives).reshape(PLACE, -1)


def fit_section(counts: np.ndarray, outline: Outline, grid: Grid, start: Section | None = None) -> Section:
    """Find the place of a head and the shares of its parts that explain the points in each bin, (b,), best.

    Shares follow by expectation maximization, the place together with the shares by Fisher scoring. `start` is an
    estimate, such as that of the section before.
    """
    section = start if start is not None else _start(outline)
    used = counts > 0
    blurred = Blurred.at(section.place, outline, grid)
    best = -np.inf
    for number in range(MAX_ROUNDS):
        section = Section(section.place, _maximized(counts, section.shares, blurred))
        before, best = best, _log_likelihood(counts, section, blurred)
        step = _scoring_step(counts, section, blurred, used)
        for part in STEP_PARTS:
            tried = _moved(section, part * step)
            moved = Blurred.at(tried.place, outline, grid)
            gained = _log_likelihood(counts, tried, moved)
            if gained > best:
                section, blurred, best = tried, moved, gained
                break
        if number > 1 and best - before < SETTLED:
            break
    return section


def log_likelihood(counts: np.ndarray, section: Section, outline: Outline, grid: Grid) -> float:
    """Return the logarithm of the likelihood of the points in each bin, (b,), given a section that explains them."""
    return _log_likelihood(counts, section, Blurred.at(section.place, outline, grid))


def _start(outline: Outline) -> Section:
    """Return a head in the middle of the bins, all parts of which have the same share."""
    count = len(outline.parts) + 1
    noise = np.log(START_NOISE_M)
    return Section(np.array([0.0, 0.0, 0.0, 0.0, noise, noise, 0.0]), np.full(count, 1 / count))


def _log_likelihood(counts: np.ndarray, section: Section, blurred: Blurred) -> float:
    """Return the logarithm of the likelihood of the points and of what is expected of the place."""
    lean, wider, across, height, bend = section.place[2:]
    usual = (lean / LEAN_SIGMA) ** 2 + ((across - height) / NOISE_RATIO_SIGMA) ** 2 + (bend / BEND_SIGMA) ** 2
    width = WRONG_WIDTH_SIGMAS**2 * np.log1p((wider / (WRONG_WIDTH_SIGMAS * WIDTH_SIGMA_M)) ** 2)
    return float(counts @ np.log(blurred.density(section.shares)) - 0.5 * (usual + width))


def _expected(place: np.ndarray) -> np.ndarray:
    """Return the information about the place that does not come from the points, (7, 7)."""
    known = np.zeros((PLACE, PLACE))
    known[2, 2] = LEAN_SIGMA**-2
    known[3, 3] = WIDTH_SIGMA_M**-2 / (1 + (place[3] / (WRONG_WIDTH_SIGMAS * WIDTH_SIGMA_M)) ** 2)
    known[4:6, 4:6] = np.array([[1, -1], [-1, 1]]) / NOISE_RATIO_SIGMA**2
    known[6, 6] = BEND_SIGMA**-2
    return known


def _maximized(counts: np.ndarray, shares: np.ndarray, blurred: Blurred) -> np.ndarray:
    """Return the shares of the parts that one round of expectation maximization gives."""
    return _normalized(shares * (blurred.parts @ (counts / blurred.density(shares))))


def _normalized(shares: np.ndarray) -> np.ndarray:
    """Scale shares to a sum of 1, with a minimum for strays."""
    shares = shares / shares.sum()
    stray = max(shares[-1], MIN_STRAY_SHARE)
    return np.append(shares[:-1] * ((1 - stray) / max(shares[:-1].sum(), 1e-9)), stray)


def _scoring_step(counts: np.ndarray, section: Section, blurred: Blurred, used: np.ndarray) -> np.ndarray:
    """Return the change of place and shares, (7 + k + 1,), that the gradient and the information ask for."""
    known, rates = _rates(section, blurred, used)
    gradient = rates @ counts[used]
    gradient[:PLACE] -= _expected(section.place) @ section.place
    own = section.shares[known]
    gradient[PLACE:] -= own @ gradient[PLACE:] / max(own.sum(), USED_SHARE)  # their sum stays
    found = np.linalg.solve(_information(counts[used], section, known, rates), gradient)
    found *= min(1.0, 1 / max(np.abs(found[:PLACE] / MAX_STEPS).max(), 1e-12))
    step = np.zeros(PLACE + len(section.shares))
    step[:PLACE], step[PLACE + known] = found[:PLACE], found[PLACE:]
    return step


def _rates(section: Section, blurred: Blurred, used: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the parts whose shares count as unknowns, and the relative derivatives, (7 + p, u), in the used bins."""
    known = np.flatnonzero(section.shares[:-1] > USED_SHARE)
    derivatives = np.concatenate([blurred.by_place(section.shares)[:, used], blurred.parts[np.ix_(known, used)]])
    return known, derivatives / blurred.density(section.shares)[used]


def _information(
    counts: np.ndarray, section: Section, known: np.ndarray, rates: np.ndarray, ridge: float = SHARE_RIDGE
) -> np.ndarray:
    """Return the Fisher information about the place and the shares, with the weight `ridge` of shares known before."""
    found = (rates * counts) @ rates.T
    found[:PLACE, :PLACE] += _expected(section.place) + np.diag(RIDGE)
    found[range(PLACE, len(found)), range(PLACE, len(found))] += ridge * counts.sum() / section.shares[known]
    return found


def _moved(section: Section, step: np.ndarray) -> Section:
    """Apply a step; shares stay positive."""
    place = section.place + step[:PLACE]
    place[4:6] = np.maximum(place[4:6], np.log(MIN_NOISE_M))
    return Section(place, _normalized(np.maximum(section.shares + step[PLACE:], MIN_SHARE_LEFT * section.shares)))


@dataclass(frozen=True)
class Scores:
    """What each bin contributes to the offset and the height of a head, and how well the section knows both.

    `by_bin`, (2, b), are derivatives of the log-likelihood of a point with respect to the offset and the height, 1/m,
    each less what a wrong value of the other or a wrong slope across would add to it. `per_point` is the information
    about the height that a point has on average, 1/m², and `common_m`, (2,), are the standard errors of both in the
    section that more points next to a station would not reduce. `stray`, (b,), is the probability of a point to be on
    no part of the outline.
    """

    by_bin: np.ndarray
    per_point: float
    common_m: np.ndarray
    stray: np.ndarray

    @classmethod
    def of(cls, counts: np.ndarray, section: Section, outline: Outline, grid: Grid) -> Scores:
        """Find the scores of a fitted section."""
        blurred = Blurred.at(section.place, outline, grid)
        density = blurred.density(section.shares)
        scores = blurred.by_place(section.shares)[:3] / density
        products = (scores * density) @ scores.T + np.diag(RIDGE[:3] / max(counts.sum(), 1.0))
        inverse = np.linalg.inv(products)[:2]
        by_bin = inverse @ scores / inverse.diagonal()[:, None]
        used = counts > 0
        known, rates = _rates(section, blurred, used)
        whole = np.linalg.inv(_information(counts[used], section, known, rates, SHARE_DOUBT)).diagonal()[:2]
        chance = 1 / np.maximum(by_bin**2 @ counts, RIDGE[:2])
        stray = section.shares[-1] * blurred.parts[-1] / density
        return cls(by_bin, float(by_bin[1] ** 2 @ density), np.sqrt(np.maximum(whole - chance, 0.0)), stray)
