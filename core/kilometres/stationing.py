"""Kilometres along an axis: posts between which they are interpolated, and jumps at which numbers are missing or twice.

See docs/stationing.md. Lengths along the axis, `s`, are plan metres from its first vertex; kilometres increase with s.
Kilometres are also written as text in the ways of railways, and read back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import RailExtractError

JUMP_M = 10.0
"""Difference between the length of the axis and that of the numbers between two posts from which it is a jump: posts
are set to within a metre or two, and old ones are seldom off by more than five."""

SCALE_OFF, SCALE_OFF_M = 1e-3, 2.0
"""Smaller differences between two posts are spread without a word: the share by which a map's scale and a line drawn by
hand differ from the ground, and the metres to which posts are set."""

SAME_PLACE_M = 0.01
"""Anchors this close are at one place, where different numbers are a jump."""

SAME_KM = 1e-6
"""Numbers that differ by less, a millimetre, are the same."""


@dataclass(frozen=True)
class Jump:
    """A place at which the numbers jump, seen along increasing kilometres, from `back_km` to `ahead_km`.

    With a smaller number ahead, numbers are twice (overlap); with a larger one, numbers are missing (gap).
    """

    back_km: float
    ahead_km: float


@dataclass(frozen=True)
class Stationing:
    """Kilometres along an axis; (k,) arrays of knots, between which they are linear.

    `s`, metres, does not decrease: a jump has two knots at the same place. `km` increases within a piece; `piece` is
    the number of the piece between two jumps, from 0. `notices` are sentences about posts that do not fit.
    """

    s: np.ndarray
    km: np.ndarray
    piece: np.ndarray
    notices: tuple[str, ...] = ()

    @property
    def starts(self) -> np.ndarray:
        """Number of the first knot of each piece."""
        return np.flatnonzero(np.diff(self.piece, prepend=-1))

    @property
    def jumps(self) -> list[tuple[float, Jump]]:
        """The place, metres, and the numbers of each jump."""
        return [(float(self.s[at]), Jump(float(self.km[at - 1]), float(self.km[at]))) for at in self.starts[1:]]

    def at(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the piece, (n,) int, and the kilometre, (n,), of places along the axis; a jump is in the piece ahead.

        Beyond the first and the last knot they are those of the nearer one.
        """
        knot = np.maximum(np.searchsorted(self.s, s, side="right") - 1, 0)
        after = np.minimum(knot + 1, len(self.s) - 1)
        after = np.where(self.piece[after] == self.piece[knot], after, knot)
        length_m = self.s[after] - self.s[knot]
        share = np.clip(s - self.s[knot], 0.0, length_m) / np.where(length_m > 0, length_m, 1.0)
        return self.piece[knot], self.km[knot] + share * (self.km[after] - self.km[knot])

    def places(self, km: float) -> list[tuple[int, float]]:
        """Return piece and place, metres, of a kilometre: none in a gap, two where it is twice."""
        found = []
        for number in range(len(self.starts)):
            knots = self.piece == number
            own = self.km[knots]
            if own[0] - SAME_KM <= km <= own[-1] + SAME_KM:
                found.append((number, float(np.interp(km, own, self.s[knots]))))
        return found

    def counts_from(self) -> np.ndarray:
        """Return for each piece the number from which the next piece counts again, inf without an overlap."""
        back, ahead = self.km[self.starts[1:] - 1], self.km[self.starts[1:]]
        return np.append(np.where(ahead < back - SAME_KM, ahead, np.inf), np.inf)


def stationing_of(length_m: float, s: Sequence[float], km: Sequence[float], jumps: Sequence[Jump] = ()) -> Stationing:
    """Give an axis its kilometres from places `s`, metres, not decreasing, of which the kilometre is known.

    Between two of them, kilometres are interpolated, and beyond them they continue at true length. Where the axis is
    longer or shorter than the numbers by more than `JUMP_M` and no jump is stated, the numbers count on at true length
    up to the next place and jump there, as posts are numbered. `jumps` are in the order of increasing kilometres of the
    line.
    """
    knots = _Knots(list(jumps))
    knots.before(s[0], km[0])
    for place, number in zip(s[1:], km[1:]):
        knots.advance(place, number)
    knots.after(length_m)
    return Stationing(np.array(knots.s), np.array(knots.km), np.array(knots.piece), tuple(knots.notices))


@dataclass
class _Knots:
    """Knots found up to now, and the stated jumps that follow."""

    jumps: list[Jump]
    s: list[float] = field(default_factory=list)
    km: list[float] = field(default_factory=list)
    piece: list[int] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)

    def before(self, s: float, km: float) -> None:
        """Add the part before the first place, in which jumps are stated by their number ahead."""
        back: list[tuple[float, Jump]] = []
        place, number = s, km
        for jump in reversed(self._take_before(s, km)):
            at = place - 1000 * (number - jump.ahead_km)
            if not 0 <= at <= place:
                raise _not_on_axis(jump)
            place, number = at, jump.back_km
            back.insert(0, (at, jump))
        self._add(0.0, number - place / 1000)
        for at, jump in back:
            self._jump(at, jump)
        self._add(s, km)

    def _take_before(self, s: float, km: float) -> list[Jump]:
        """Take the stated jumps up to the last one whose number ahead leads from a place on the axis to this one."""
        leads = [
            jump.ahead_km <= km and s - 1000 * (km - jump.ahead_km) >= SAME_PLACE_M for jump in reversed(self.jumps)
        ]
        count = len(leads) - leads.index(True) if any(leads) else 0
        own, self.jumps = self.jumps[:count], self.jumps[count:]
        return own

    def advance(self, s: float, km: float) -> None:
        """Add the part up to the next place, with the stated jumps that explain its length."""
        start, start_km = self.s[-1], self.km[-1]
        own = self._between(s, km)
        if s - start <= SAME_PLACE_M and not own:
            if abs(km - start_km) > SAME_KM:
                self._jump(s, Jump(start_km, km))
            return
        numbers_km = km - start_km + sum(jump.back_km - jump.ahead_km for jump in own)
        off_m = (s - start) - 1000 * numbers_km
        if not own and km <= start_km:
            raise RailExtractError(
                f"The kilometres are out of order: km {km:.3f} follows km {start_km:.3f} along AXIS: correct the posts "
                "or M values, or state an overlap in JUMPS."
            )
        fits = abs(off_m) <= JUMP_M
        scale = (s - start) / numbers_km if fits else 1000.0
        for jump in own:
            self._jump(self.s[-1] + scale * (jump.back_km - self.km[-1]), jump)
        if fits:
            self._report_scale(start_km, km, s - start, off_m)
            self._add(s, km)
        else:
            self._jump_unstated(s, km, off_m)

    def _between(self, s: float, km: float) -> list[Jump]:
        """Take the stated jumps that make the numbers up to a place fit its distance better."""
        own: list[Jump] = []
        place, number = self.s[-1], self.km[-1]
        while self.jumps:
            jump = self.jumps[0]
            ahead_m = 1000 * (jump.back_km - number)
            plain_m = abs((s - place) - 1000 * (km - number))
            rest_m = abs((s - place) - ahead_m - 1000 * (km - jump.ahead_km))
            if ahead_m < -SAME_PLACE_M or ahead_m > s - place + JUMP_M or rest_m >= plain_m:
                break
            own.append(self.jumps.pop(0))
            place, number = place + ahead_m, jump.ahead_km
        return own

    def _jump_unstated(self, s: float, km: float, off_m: float) -> None:
        """Count on at true length up to a place, and jump there."""
        back_km = self.km[-1] + (s - self.s[-1]) / 1000
        kind = "longer" if off_m > 0 else "shorter"
        self.notices.append(
            f"AXIS is {abs(off_m):.1f} m {kind} than the numbers from km {self.km[-1]:.3f} to km {km:.3f}: taken as a "
            f"jump from km {back_km:.3f} to km {km:.3f}."
        )
        self._jump(s, Jump(back_km, km))

    def _report_scale(self, start_km: float, km: float, length_m: float, off_m: float) -> None:
        if abs(off_m) > max(SCALE_OFF_M, SCALE_OFF * length_m):
            self.notices.append(
                f"AXIS is {length_m:.1f} m long between km {start_km:.3f} and km {km:.3f}, where the numbers differ by "
                f"{length_m - off_m:.1f} m: they are spread evenly."
            )

    def after(self, length_m: float) -> None:
        """Add the part after the last place."""
        for jump in self.jumps:
            place = self.s[-1] + 1000 * (jump.back_km - self.km[-1])
            if not self.s[-1] - SAME_PLACE_M <= place <= length_m + SAME_PLACE_M:
                raise _not_on_axis(jump)
            self._jump(min(max(place, self.s[-1]), length_m), jump)
        self._add(length_m, self.km[-1] + (length_m - self.s[-1]) / 1000)

    def _jump(self, s: float, jump: Jump) -> None:
        self._add(s, jump.back_km)
        self.s.append(s)
        self.km.append(jump.ahead_km)
        self.piece.append(self.piece[-1] + 1)

    def _add(self, s: float, km: float) -> None:
        """Add a knot of the current piece unless it is at the place of the last one."""
        if self.s and s - self.s[-1] <= SAME_PLACE_M:
            return
        self.s.append(s)
        self.km.append(km)
        self.piece.append(self.piece[-1] if self.piece else 0)


def _not_on_axis(jump: Jump) -> RailExtractError:
    return RailExtractError(
        f"The jump from km {jump.back_km:.3f} to km {jump.ahead_km:.3f} is not on AXIS: correct JUMPS, whose rows must "
        "be in the order of increasing kilometres."
    )
